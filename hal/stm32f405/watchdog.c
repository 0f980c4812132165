/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/watchdog.h"

#include "hal/stm32f405/mcu.h"

/* The oscillator's 32 kHz by 256: 8 ms a count. */
enum { UNLOCK = 0x5555, FEED = 0xAAAA, START = 0xCCCC, BY_256 = 6, MS_PER_COUNT = 8, TOP = 4095 };
enum { TRIES = 100000 };

void cb_watchdog_start(uint32_t timeout_ms) {
    const uint32_t counts = (timeout_ms + MS_PER_COUNT - 1) / MS_PER_COUNT;
    cb_write(&CB_IWDG->kr, START);
    cb_write(&CB_IWDG->kr, UNLOCK);
    cb_write(&CB_IWDG->pr, BY_256);
    cb_write(&CB_IWDG->rlr, counts < TOP ? counts : TOP);
    for (uint32_t i = 0; i < TRIES && cb_read(&CB_IWDG->sr) != 0; ++i) {
    }
    cb_write(&CB_IWDG->kr, FEED);
}

void cb_watchdog_feed(void) {
    cb_write(&CB_IWDG->kr, FEED);
}
