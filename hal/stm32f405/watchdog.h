/* SPDX-License-Identifier: MIT
 * The independent watchdog: starts the processor anew when no cycle is completed. */
#ifndef COMPBOX_HAL_STM32F405_WATCHDOG_H
#define COMPBOX_HAL_STM32F405_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

/* in : time without a feed after which it bites, 8 … 32 000 ms. Cannot be stopped again; may be
 *      called again for another time. */
void cb_watchdog_start(uint32_t timeout_ms);

void cb_watchdog_feed(void);

/* Whether it caused this start; call once, it clears the reset flags. */
bool cb_watchdog_bit(void);

#endif
