/* SPDX-License-Identifier: MIT
 * The independent watchdog: starts the processor anew when no cycle is completed. Its oscillator
 * has 32 kHz nominally, 17 to 47 kHz for certain: a time may be 0.68 to 1.9 times as long as asked
 * for. */
#ifndef COMPBOX_HAL_STM32F405_WATCHDOG_H
#define COMPBOX_HAL_STM32F405_WATCHDOG_H

#include <stdint.h>

/* in : time without a feed after which it bites, 8 … 32 000 ms. Cannot be stopped again; may be
 *      called again for another time. */
void cb_watchdog_start(uint32_t timeout_ms);

void cb_watchdog_feed(void);

#endif
