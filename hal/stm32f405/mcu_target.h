/* SPDX-License-Identifier: MIT
 * The registers at their addresses: each access is one plain load or store. Included by mcu.h
 * alone; no other file of this folder contains an address. */
#ifndef COMPBOX_HAL_STM32F405_MCU_TARGET_H
#define COMPBOX_HAL_STM32F405_MCU_TARGET_H

#define CB_RCC ((struct cb_rcc *)0x40023800u)
#define CB_GPIOA ((struct cb_gpio *)0x40020000u)
#define CB_GPIOB ((struct cb_gpio *)0x40020400u)
#define CB_USART1 ((struct cb_usart_registers *)0x40011000u)
#define CB_USART2 ((struct cb_usart_registers *)0x40004400u)
#define CB_USART3 ((struct cb_usart_registers *)0x40004800u)
#define CB_IWDG ((struct cb_iwdg *)0x40003000u)
#define CB_FLASH ((struct cb_flash *)0x40023C00u)
#define CB_SYSTICK ((struct cb_systick *)0xE000E010u)
#define CB_NVIC_ISER ((cb_cell *)0xE000E100u)
#define CB_NVIC_ISPR ((cb_cell *)0xE000E200u)
#define CB_SCB ((struct cb_scb *)0xE000ED00u)
#define CB_MPU ((struct cb_mpu *)0xE000ED90u)
#define CB_CPACR ((cb_cell *)0xE000ED88u)
#define CB_UNIQUE_ID ((const cb_cell *)0x1FFF7A10u) /* three words */

/* Sectors 5 and 6. */
#define CB_FLASH_SLOT_A ((const void *)0x08020000u)
#define CB_FLASH_SLOT_B ((const void *)0x08040000u)

static inline uint32_t cb_read(const cb_cell *at) {
    return at->word;
}

static inline void cb_write(cb_cell *at, uint32_t word) {
    at->word = word;
}

static inline void cb_barrier(void) {
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

/* Disables interrupts, except faults and the clock's failure. */
static inline void cb_interrupts_off(void) {
    __asm__ volatile("cpsid i" ::: "memory");
}

/* Enables interrupts; pending ones run at once. */
static inline void cb_interrupts_on(void) {
    __asm__ volatile("cpsie i\n\tisb" ::: "memory");
}

/* Returns when an interrupt is pending, also with interrupts disabled. */
static inline void cb_wait_for_interrupt(void) {
    __asm__ volatile("wfi" ::: "memory");
}

#endif
