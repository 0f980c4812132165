/* SPDX-License-Identifier: MIT
 * Time since start from SysTick, which interrupts every millisecond. */
#ifndef COMPBOX_HAL_STM32F405_TIME_H
#define COMPBOX_HAL_STM32F405_TIME_H

#include <stdint.h>

/* in : frequency of the processor, a multiple of 1 MHz. Time begins at 0. */
void cb_time_start(uint32_t core_hz);

/* Microseconds since start, from any context; monotonic. */
int64_t cb_time_us(void);

/* The processor sleeps until an interrupt comes; SysTick brings one within a millisecond. */
void cb_time_sleep(void);

/* The interrupt. */
void cb_systick_handler(void);

#endif
