/* SPDX-License-Identifier: MIT
 * The real-time thread: cycle after cycle, and a row about each into a ring. It takes no lock and
 * makes no file, log or allocation call after its start (tests/hil/test_realtime.py). */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOOP_H
#define COMPBOX_HAL_LINUX_DAEMON_LOOP_H

#include <stdbool.h>
#include <stdint.h>
#include <time.h>

#include "firmware/box.h"
#include "hal/cycle.h"
#include "hal/linux/box_hal.h"
#include "hal/linux/daemon/row.h"
#include "hal/linux/daemon/state.h"
#include "hal/linux/mailbox.h"

/* A minute of rows at 30 ms: how long the other thread may be kept from running or writing. */
enum { CB_LOOP_ROWS = 2048, CB_LOOP_STATES = 2, CB_LOOP_STATE_US = 1000000 };

/* The normal thread makes an offer and may withdraw it; the loop takes it: then there is none. */
enum cb_loop_offer { CB_LOOP_OFFER_NONE, CB_LOOP_OFFER_MADE, CB_LOOP_OFFER_IN_HAND };

/* Generation n of the coefficient file lives in boxes[n % 2]: the other one is spare, for the next.
 * The normal thread fills it and offers it; the loop takes it. */
struct cb_loop {
    struct cb_box boxes[2];
    struct cb_box *box;  /* the one that runs; its config loaded before the start */
    uint32_t generation; /* of the coefficient file; counts up when another is taken over; atomic */
    uint32_t offer;      /* enum cb_loop_offer, atomic: whether the spare box is to take over … */
    bool at_rest_only;   /* … written before it: … only while the running one is at rest */
    struct cb_linux target; /* its wires started before the start */
    clockid_t clock;        /* of the ticks */
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
    uint32_t state_generations[CB_LOOP_STATES]; /* of whose signals they are */
    int64_t state_us;                           /* … and when last */
    uint64_t made; /* cycles so far, those that no row tells about too */
};

/* Before everything else: the first box runs. */
void cb_loop_init(struct cb_loop *loop);

/* For the normal thread, while no offer is out: the box whose configuration may be filled. */
struct cb_box *cb_loop_spare(struct cb_loop *loop);

/* The spare box, started, shall take over between two cycles; at_rest_only: as soon as the running
 * one is at rest (cb_box_at_rest()). It waits too where it would step (cb_box_adopt()). */
void cb_loop_offer(struct cb_loop *loop, bool at_rest_only);

/* out: true: the offer is withdrawn, the spare box may be filled; false: too late */
bool cb_loop_withdraw(struct cb_loop *loop);

/* in : an offer was made and not withdrawn
 * out: true: the spare box runs now, the one before is spare. Rows that it published before are of
 *      the generation before. */
bool cb_loop_answered(const struct cb_loop *loop);

/* The box that runs; from any thread. Valid until the next offer is taken. */
const struct cb_box *cb_loop_box(const struct cb_loop *loop);

/* From any thread: the box that runs has found that its configuration changed in memory, and takes
 * no offer any more. */
bool cb_loop_is_corrupt(const struct cb_loop *loop);

/* Thread function; argument: struct cb_loop *. Ends after a clean stop or on quit. */
void *cb_loop_run(void *argument);

#endif
