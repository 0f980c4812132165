/* SPDX-License-Identifier: MIT
 * The operations of hal.h on the STM32F405: ticks, Modbus RTU, the watchdog. */
#ifndef COMPBOX_HAL_STM32F405_BOX_HAL_H
#define COMPBOX_HAL_STM32F405_BOX_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

struct cb_board {
    uint32_t period_us;
    int64_t next_tick_us;        /* 0: none yet */
    bool stop;                   /* the console asked for it */
    void (*idle)(void *context); /* called while there is time: again and again, each time short */
    void *idle_context;
};

/* Sleeps for the rest of the period, with idle() in between, and returns how many ticks were
 * missed. */
uint32_t cb_board_wait_tick(struct cb_board *board);

struct cb_hal cb_board_hal(struct cb_board *board);

#endif
