/* SPDX-License-Identifier: MIT
 * Registers of the STM32F405 that the box uses, from the reference manual RM0090 and the Cortex-M4
 * programming manual PM0214. Nothing else of this folder knows an address. */
#ifndef COMPBOX_HAL_STM32F405_MCU_H
#define COMPBOX_HAL_STM32F405_MCU_H

#include <stdint.h>

typedef volatile uint32_t cb_register;

struct cb_rcc {
    cb_register cr, pllcfgr, cfgr, cir, ahb1rstr, ahb2rstr, ahb3rstr, reserved0, apb1rstr, apb2rstr,
        reserved1[2], ahb1enr, ahb2enr, ahb3enr, reserved2, apb1enr, apb2enr, reserved3[2],
        ahb1lpenr, ahb2lpenr, ahb3lpenr, reserved4, apb1lpenr, apb2lpenr, reserved5[2], bdcr, csr;
};

struct cb_gpio {
    cb_register moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afrl, afrh;
};

struct cb_usart_registers {
    cb_register sr, dr, brr, cr1, cr2, cr3, gtpr;
};

struct cb_iwdg {
    cb_register kr, pr, rlr, sr;
};

struct cb_systick {
    cb_register csr, rvr, cvr, calib;
};

struct cb_scb {
    cb_register cpuid, icsr, vtor, aircr, scr, ccr, shpr[3], shcsr, cfsr, hfsr, dfsr, mmfar, bfar,
        afsr;
};

struct cb_mpu {
    cb_register type, ctrl, rnr, rbar, rasr;
};

#define CB_RCC ((struct cb_rcc *)0x40023800u)
#define CB_GPIOA ((struct cb_gpio *)0x40020000u)
#define CB_GPIOB ((struct cb_gpio *)0x40020400u)
#define CB_USART1 ((struct cb_usart_registers *)0x40011000u)
#define CB_USART2 ((struct cb_usart_registers *)0x40004400u)
#define CB_USART3 ((struct cb_usart_registers *)0x40004800u)
#define CB_IWDG ((struct cb_iwdg *)0x40003000u)
#define CB_FLASH_ACR (*(cb_register *)0x40023C00u)
#define CB_SYSTICK ((struct cb_systick *)0xE000E010u)
#define CB_NVIC_ISER ((cb_register *)0xE000E100u)
#define CB_NVIC_ISPR ((cb_register *)0xE000E200u)
#define CB_SCB ((struct cb_scb *)0xE000ED00u)
#define CB_MPU ((struct cb_mpu *)0xE000ED90u)
#define CB_CPACR (*(cb_register *)0xE000ED88u)

/* Sectors 5 and 6, 128 KiB each: one coefficient file in each (firmware/slot.h). */
#define CB_FLASH_SLOT_A ((const void *)0x08020000u)
#define CB_FLASH_SLOT_B ((const void *)0x08040000u)
enum { CB_FLASH_SLOT_BYTES = 128 * 1024 };

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
    CB_RCC_CFGR_APB2_BY_2 = 4 << 13,
    CB_RCC_PLL_HSE = 1 << 22,
    CB_RCC_CIR_CSSF = 1 << 7,
    CB_RCC_CIR_CSSC = 1 << 23,
    CB_RCC_CSR_RMVF = 1 << 24,
    CB_RCC_CSR_IWDGRSTF = 1 << 29,
};

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

static inline void cb_barrier(void) {
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

/* Starts the processor anew; does not return. */
static inline _Noreturn void cb_reset(void) {
    cb_barrier();
    CB_SCB->aircr = CB_SCB_AIRCR_RESET;
    cb_barrier();
    for (;;) {
    }
}

#endif
