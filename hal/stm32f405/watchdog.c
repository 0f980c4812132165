/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/watchdog.h"

#include "hal/stm32f405/mcu.h"

/* Its oscillator has 32 kHz nominally, 17 to 47 kHz for certain: by 256, 8 ms a count, at worst
 * 5.4 ms. */
enum { UNLOCK = 0x5555, FEED = 0xAAAA, START = 0xCCCC, BY_256 = 6, MS_PER_COUNT = 8, TOP = 4095 };
enum { TRIES = 100000 };

void cb_watchdog_start(uint32_t timeout_ms) {
    const uint32_t counts = (timeout_ms + MS_PER_COUNT - 1) / MS_PER_COUNT;
    CB_IWDG->kr = START;
    CB_IWDG->kr = UNLOCK;
    CB_IWDG->pr = BY_256;
    CB_IWDG->rlr = counts < TOP ? counts : TOP;
    for (uint32_t i = 0; i < TRIES && CB_IWDG->sr != 0; ++i) {
    }
    CB_IWDG->kr = FEED;
}

void cb_watchdog_feed(void) {
    CB_IWDG->kr = FEED;
}

bool cb_watchdog_bit(void) {
    const bool bit = (CB_RCC->csr & CB_RCC_CSR_IWDGRSTF) != 0;
    CB_RCC->csr |= CB_RCC_CSR_RMVF;
    return bit;
}
