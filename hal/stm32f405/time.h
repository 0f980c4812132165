/* SPDX-License-Identifier: MIT
 * Time since start from SysTick, which interrupts every millisecond. */
#ifndef COMPBOX_HAL_STM32F405_TIME_H
#define COMPBOX_HAL_STM32F405_TIME_H

#include <stdint.h>

/* in : frequency of the processor, a multiple of 1 MHz. Time begins at 0. */
void cb_time_start(uint32_t core_hz);

/* Microseconds since start, from any context; monotonic. */
int64_t cb_time_us(void);

/* Number of interrupts so far; wraps. */
uint32_t cb_time_interrupts(void);

/* Call it from every interrupt. */
void cb_time_note_interrupt(void);

/* in : seen: cb_time_interrupts() from before the program looked for work
 * Sleeps until an interrupt comes. Returns at once if one has come since `seen`, because it may
 * have brought work. SysTick comes within a millisecond. */
void cb_time_sleep(uint32_t seen);

/* The interrupt. */
void cb_systick_handler(void);

#endif
