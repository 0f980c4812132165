/* SPDX-License-Identifier: MIT
 * The registers as memory of a host's test, which simulates the hardware. Included by mcu.h alone,
 * with CB_MCU_MODEL. The functions belong to the test: each access is one call, where time passes
 * and an interrupt may come (tests/support/stm32f405_model.h). */
#ifndef COMPBOX_HAL_STM32F405_MCU_MODEL_H
#define COMPBOX_HAL_STM32F405_MCU_MODEL_H

struct cb_mcu_model {
    struct cb_rcc rcc;
    struct cb_gpio gpio_a, gpio_b;
    struct cb_usart_registers usart_1, usart_2, usart_3;
    struct cb_iwdg iwdg;
    struct cb_flash flash;
    struct cb_systick systick;
    struct cb_scb scb;
    cb_cell nvic_iser[3], nvic_ispr[3], unique_id[3];
};
extern struct cb_mcu_model cb_mcu_model;
extern uint8_t cb_model_slots[2][CB_FLASH_SLOT_BYTES];

#define CB_RCC (&cb_mcu_model.rcc)
#define CB_GPIOA (&cb_mcu_model.gpio_a)
#define CB_GPIOB (&cb_mcu_model.gpio_b)
#define CB_USART1 (&cb_mcu_model.usart_1)
#define CB_USART2 (&cb_mcu_model.usart_2)
#define CB_USART3 (&cb_mcu_model.usart_3)
#define CB_IWDG (&cb_mcu_model.iwdg)
#define CB_FLASH (&cb_mcu_model.flash)
#define CB_SYSTICK (&cb_mcu_model.systick)
#define CB_SCB (&cb_mcu_model.scb)
#define CB_NVIC_ISER (cb_mcu_model.nvic_iser)
#define CB_NVIC_ISPR (cb_mcu_model.nvic_ispr)
#define CB_UNIQUE_ID (cb_mcu_model.unique_id)
#define CB_FLASH_SLOT_A ((const void *)cb_model_slots[0])
#define CB_FLASH_SLOT_B ((const void *)cb_model_slots[1])

uint32_t cb_read(const cb_cell *at);
void cb_write(cb_cell *at, uint32_t word);
void cb_barrier(void);
void cb_interrupts_off(void);
void cb_interrupts_on(void);
void cb_wait_for_interrupt(void);

#endif
