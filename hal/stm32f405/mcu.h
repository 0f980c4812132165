/* SPDX-License-Identifier: MIT
 * Registers of the STM32F405 used by the box, from the reference manual RM0090 and the Cortex-M4
 * programming manual PM0214. Their addresses and access: mcu_target.h, or mcu_model.h in the host's
 * tests. */
#ifndef COMPBOX_HAL_STM32F405_MCU_H
#define COMPBOX_HAL_STM32F405_MCU_H

#include <stdint.h>

/* A word that changes outside the program's flow: a register, or a variable written by an
 * interrupt. It is a struct, so that only cb_read, cb_write and their users access it. */
typedef struct {
    volatile uint32_t word;
} cb_cell;

struct cb_rcc {
    cb_cell cr, pllcfgr, cfgr, cir, ahb1rstr, ahb2rstr, ahb3rstr, reserved0, apb1rstr, apb2rstr,
        reserved1[2], ahb1enr, ahb2enr, ahb3enr, reserved2, apb1enr, apb2enr, reserved3[2],
        ahb1lpenr, ahb2lpenr, ahb3lpenr, reserved4, apb1lpenr, apb2lpenr, reserved5[2], bdcr, csr;
};

struct cb_gpio {
    cb_cell moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afrl, afrh;
};

struct cb_usart_registers {
    cb_cell sr, dr, brr, cr1, cr2, cr3, gtpr;
};

struct cb_iwdg {
    cb_cell kr, pr, rlr, sr;
};

struct cb_systick {
    cb_cell csr, rvr, cvr, calib;
};

struct cb_scb {
    cb_cell cpuid, icsr, vtor, aircr, scr, ccr, shpr[3], shcsr, cfsr, hfsr, dfsr, mmfar, bfar, afsr;
};

struct cb_mpu {
    cb_cell type, ctrl, rnr, rbar, rasr;
};

struct cb_flash {
    cb_cell acr, keyr, optkeyr, sr, cr, optcr;
};

enum { CB_FLASH_SLOT_BYTES = 128 * 1024 }; /* sectors 5 and 6: one coefficient file in each */

#ifdef CB_MCU_MODEL
#include "hal/stm32f405/mcu_model.h"
#else
#include "hal/stm32f405/mcu_target.h"
#endif

/* Positions in the vector table behind the 16 of the core. */
enum { CB_IRQ_USART1 = 37, CB_IRQ_USART2 = 38, CB_IRQ_USART3 = 39, CB_IRQ_COUNT = 82 };

enum {
    CB_RCC_CR_HSION = 1 << 0,
    CB_RCC_CR_HSIRDY = 1 << 1,
    CB_RCC_CR_HSEON = 1 << 16,
    CB_RCC_CR_HSERDY = 1 << 17,
    CB_RCC_CR_CSSON = 1 << 19,
    CB_RCC_CR_PLLON = 1 << 24,
    CB_RCC_CR_PLLRDY = 1 << 25,
    CB_RCC_CFGR_SW = 3 << 0,
    CB_RCC_CFGR_SW_PLL = 2 << 0,
    CB_RCC_CFGR_SWS = 3 << 2,
    CB_RCC_CFGR_SWS_PLL = 2 << 2,
    CB_RCC_CFGR_APB1_BY_4 = 5 << 10,
    CB_RCC_CFGR_APB2_BY_4 = 5 << 13,
    CB_RCC_PLL_HSE = 1 << 22,
    CB_RCC_CIR_CSSF = 1 << 7,
    CB_RCC_CIR_CSSC = 1 << 23,
    CB_RCC_CSR_RMVF = 1 << 24,
    CB_RCC_CSR_BORRSTF = 1 << 25,
    CB_RCC_CSR_PINRSTF = 1 << 26,
    CB_RCC_CSR_PORRSTF = 1 << 27,
    CB_RCC_CSR_SFTRSTF = 1 << 28,
    CB_RCC_CSR_IWDGRSTF = 1 << 29,
    CB_RCC_CSR_WWDGRSTF = 1 << 30,
    CB_FLASH_OPTCR_BOR_LEV = 2, /* position of its two bits */
};
#define CB_RCC_CSR_LPWRRSTF (1u << 31)

enum {
    CB_USART_SR_PE = 1 << 0,
    CB_USART_SR_FE = 1 << 1,
    CB_USART_SR_NE = 1 << 2,
    CB_USART_SR_ORE = 1 << 3,
    CB_USART_SR_RXNE = 1 << 5,
    CB_USART_SR_TC = 1 << 6,
    CB_USART_SR_TXE = 1 << 7,
    CB_USART_CR1_RE = 1 << 2,
    CB_USART_CR1_TE = 1 << 3,
    CB_USART_CR1_RXNEIE = 1 << 5,
    CB_USART_CR1_TCIE = 1 << 6,
    CB_USART_CR1_TXEIE = 1 << 7,
    CB_USART_CR1_PS_ODD = 1 << 9,
    CB_USART_CR1_PCE = 1 << 10,
    CB_USART_CR1_M = 1 << 12,
    CB_USART_CR1_UE = 1 << 13,
    CB_USART_CR2_STOP_2 = 2 << 12,
};

#define CB_SCB_ICSR_PENDSTSET (1u << 26)
#define CB_SCB_AIRCR_RESET (0x05FAu << 16 | 1u << 2)
#define CB_SCB_SHCSR_FAULTS                                               \
    (7u << 16) /* memory, bus and usage faults have handlers of their own \
                */
#define CB_SCB_CCR_DIV_0 (1u << 4)

static inline void cb_replace_bits(cb_cell *at, uint32_t mask, uint32_t bits) {
    cb_write(at, (cb_read(at) & ~mask) | bits);
}

static inline void cb_set_bits(cb_cell *at, uint32_t bits) {
    cb_write(at, cb_read(at) | bits);
}

static inline void cb_clear_bits(cb_cell *at, uint32_t bits) {
    cb_write(at, cb_read(at) & ~bits);
}

/* Restarts the processor; does not return. */
static inline _Noreturn void cb_reset(void) {
    cb_barrier();
    cb_write(&CB_SCB->aircr, CB_SCB_AIRCR_RESET);
    cb_barrier();
    for (;;) {
    }
}

#endif
