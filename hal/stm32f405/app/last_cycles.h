/* SPDX-License-Identifier: MIT
 * The last cycles before an unwanted restart, in memory that survives it (retained.h): a flight
 * recorder for the run, and the one of the run that such a restart ended last. */
#ifndef COMPBOX_HAL_STM32F405_LAST_CYCLES_H
#define COMPBOX_HAL_STM32F405_LAST_CYCLES_H

#include <stdint.h>

#include "firmware/box/recorder.h"
#include "hal/stm32f405/retained.h"

enum { CB_LAST_CYCLES = 40 }; /* 1.2 s at 30 ms */

/* Call it once at start. After an unwanted restart the cycles before it are kept, until the next
 * one or the loss of power. */
void cb_last_cycles_open(enum cb_start_cause cause);

/* Call it after each step. */
void cb_last_cycles_note(const struct cb_box *box);

/* out: the kept ones; its count is 0 if there are none */
const struct cb_recorder *cb_last_cycles_kept(void);

#endif
