/* SPDX-License-Identifier: MIT
 * The operations of hal.h on the STM32F405: ticks, Modbus RTU, the watchdog. */
#ifndef COMPBOX_HAL_STM32F405_BOX_HAL_H
#define COMPBOX_HAL_STM32F405_BOX_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "hal/stm32f405/wire.h"

enum { CB_BOARD_SAMPLES = 64 /* capacity of one cycle */ };

struct cb_board {
    uint32_t period_us;
    struct cb_wire plc;
    struct cb_rtu_dialog dialog; /* with the PLC */
    uint8_t plc_unit;
    int64_t next_tick_us; /* 0: none yet */
    size_t waiting;       /* number of samples for the next cycle */
    struct cb_sample samples[CB_BOARD_SAMPLES];
    bool stop;               /* requested on the console */
    uint32_t watchdog_ms;    /* the watchdog's time from the first cycle on; 0: already set */
    void (*idle)(void);      /* called repeatedly while there is time; each call is short */
    void (*meanwhile)(void); /* called while waiting for the PLC; each call is very short */
};

/* Starts the line to the PLC. in: manners as in cb_rtu_dialog_start, lumps_us as in
 * cb_wire_start */
void cb_board_start_plc(struct cb_board *board, uint8_t unit, const struct cb_rtu_manners *manners,
                        uint32_t lumps_us);

/* Sleeps for the rest of the period and calls idle() in between. out: number of missed ticks */
uint32_t cb_board_wait_tick(struct cb_board *board);

struct cb_hal cb_board_hal(struct cb_board *board);

#endif
