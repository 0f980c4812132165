/* SPDX-License-Identifier: MIT
 * The real-time thread: cycle after cycle, and a row about each into a ring. It takes no lock and
 * makes no file, log or allocation call after its start (tests/hil/test_realtime.py). */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOOP_H
#define COMPBOX_HAL_LINUX_DAEMON_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/box.h"
#include "hal/cycle.h"
#include "hal/linux/box_hal.h"
#include "hal/linux/daemon/row.h"
#include "hal/linux/daemon/state.h"
#include "hal/linux/mailbox.h"

/* A minute of rows at 30 ms: how long the other thread may be kept from running or writing. */
enum { CB_LOOP_ROWS = 2048, CB_LOOP_STATES = 2, CB_LOOP_STATE_US = 1000000 };

struct cb_loop {
    struct cb_box box;      /* its config loaded before the start */
    struct cb_linux target; /* its tcp started before the start */
    uint64_t cycles;        /* then stop by itself; 0: never */
    bool quit;              /* flag from outside: end at once, without a clean stop */
    bool finished;          /* flag to outside: the thread is about to end */
    bool stopped;           /* read after finished: STOPPED was written and confirmed */
    struct cb_cycle cycle;
    struct cb_ring ring;
    struct cb_row rows[CB_LOOP_ROWS];
    struct cb_state resumed;   /* lags that go on from before the start */
    struct cb_ring state_ring; /* the lags, once a second … */
    struct cb_state states[CB_LOOP_STATES];
    int64_t state_us; /* … and when last */
};

/* Thread function; argument: struct cb_loop *. Ends after a clean stop or on quit. */
void *cb_loop_run(void *argument);

#endif
