/* SPDX-License-Identifier: MIT
 * One cycle of the box on any hardware, called by every target's main loop (docs/DESIGN.md §4;
 * reasons: docs/decisions/0002-one-cycle.md). */
#ifndef COMPBOX_HAL_CYCLE_H
#define COMPBOX_HAL_CYCLE_H

#include <stdint.h>

#include "firmware/box/box.h"
#include "hal/hal.h"

/* Place of a read-back without which nothing may be written. */
enum cb_turn {
    CB_TURN_BESIDE, /* behind the reading, in its cycle */
    CB_TURN_NEXT,   /* the only request of the next cycle, because two do not fit into one */
    CB_TURN_DONE,   /* was the only request of this cycle; the next reading completes it */
};

/* Times and results of one cycle, for statistics and the flight recorder. */
struct cb_cycle {
    struct cb_inputs in;
    struct cb_outputs out;
    int64_t tick_us;              /* now_us right after the tick */
    int64_t exchange_us;          /* time spent in read, write or write_read */
    int64_t step_us;              /* time spent in cb_box_step */
    int64_t step_at_us;           /* now_us of the step … */
    uint32_t step_exchange_us;    /* … and two of its inputs, which the write */
    uint8_t step_last_write;      /* after the step has changed */
    enum cb_transfer read, write; /* of this cycle, read: or of the read-back in its place; FAILED
                                     if there was nothing to write */
    uint8_t turn;                 /* enum cb_turn; BESIDE when another box takes over */
};

/* Sets *cycle to the state before the first tick. */
void cb_cycle_start(struct cb_cycle *cycle);

/* Waits for the tick, exchanges with the PLC, steps the box, writes, feeds the watchdog.
 * fc3+fc16: read, step, write share one deadline, 4/5 of the period after the tick. When the read
 *   failed, the box's heartbeat and held outputs are still written while there is time.
 * fc23: one request writes the previous cycle's outputs and reads the inputs, then comes the step.
 *   While the box must not write (no contact yet, or lost: box/box.h) FC3 reads the inputs, also
 *   after a suspend: outputs of a step more than CB_CLOCK_PERIODS periods ago are not written.
 * When the box no longer knows the PLC's outputs, FC3 reads the write block back: behind the
 *   reading, or with fc23 in the next cycle in place of the reading, if that took more than half of
 *   the time. The step behind the next reading then gets both.
 * Returns when the cycle is complete, before the next tick. */
void cb_cycle_run(struct cb_cycle *cycle, struct cb_box *box, const struct cb_hal *hal);

#endif
