/* SPDX-License-Identifier: MIT
 * The independent watchdog: restarts the processor when no cycle is completed. Its oscillator has
 * 32 kHz nominally, 17 to 47 kHz guaranteed: the actual time may be 0.68 to 1.9 times the requested
 * one. */
#ifndef COMPBOX_HAL_STM32F405_WATCHDOG_H
#define COMPBOX_HAL_STM32F405_WATCHDOG_H

#include <stdint.h>

/* in : time without a feed until the reset, 8 … 32 000 ms. The watchdog cannot be stopped; another
 *      call changes its time. */
void cb_watchdog_start(uint32_t timeout_ms);

void cb_watchdog_feed(void);

#endif
