/* SPDX-License-Identifier: MIT
 * The real-time thread: runs the cycles and writes a row about each into a ring. It takes no lock
 * and makes no file, log or allocation call after its start (tests/hil/test_realtime.py). */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOOP_H
#define COMPBOX_HAL_LINUX_DAEMON_LOOP_H

#include <stdbool.h>
#include <stdint.h>
#include <time.h>

#include "firmware/box/box.h"
#include "hal/cycle.h"
#include "hal/linux/box_hal.h"
#include "hal/linux/files/row.h"
#include "hal/linux/files/state.h"
#include "hal/linux/mailbox.h"

/* A minute of rows at 30 ms: the longest delay of the other thread without loss. */
enum { CB_LOOP_ROWS = 2048, CB_LOOP_STATES = 2, CB_LOOP_STATE_US = 1000000 };

/* The normal thread makes an offer and may withdraw it; the loop takes it and resets it to NONE. */
enum cb_loop_offer { CB_LOOP_OFFER_NONE, CB_LOOP_OFFER_MADE, CB_LOOP_OFFER_IN_HAND };

/* Generation n of the coefficient file uses boxes[n % 2]; the other box is the spare for the next
 * one. The normal thread fills and offers it, the loop takes it. */
struct cb_loop {
    struct cb_box boxes[2];
    struct cb_box *box;  /* the running one; its config is loaded before the start */
    uint32_t generation; /* of the coefficient file; incremented when another takes over; atomic */
    uint32_t offer;      /* enum cb_loop_offer, atomic: whether the spare box is to take over … */
    bool at_rest_only;   /* … set before it: … only while the running one is at rest */
    struct cb_linux target; /* its wires are started first */
    clockid_t clock;        /* of the ticks */
    uint64_t cycles;        /* number of cycles before it stops; 0: no limit */
    bool quit;              /* flag from outside: exit at once, without a clean stop */
    bool finished;          /* flag to outside: the thread is about to end */
    bool stopped;           /* read after finished: STOPPED was written and confirmed */
    struct cb_cycle cycle;
    struct cb_ring ring;
    struct cb_row rows[CB_LOOP_ROWS];
    struct cb_row beside;      /* the newest row where the ring is full … */
    bool is_beside;            /* … and whether it is; both read after finished */
    struct cb_state resumed;   /* state from before the start */
    struct cb_ring state_ring; /* the lags, once a second … */
    struct cb_state states[CB_LOOP_STATES];
    uint32_t state_generations[CB_LOOP_STATES]; /* generation of their signals */
    int64_t state_us;                           /* time of the last publication */
    uint64_t made;                              /* number of cycles, those without a row included */
};

/* Call it first: the first box becomes the running one. */
void cb_loop_init(struct cb_loop *loop);

/* For the normal thread, without a pending offer: the box whose configuration may be filled. */
struct cb_box *cb_loop_spare(struct cb_loop *loop);

/* Offers the spare box, started, to take over between two cycles; at_rest_only: once the running
 * one is at rest (cb_box_at_rest()). The offer also stays pending while an output would step
 * (cb_box_adopt()). */
void cb_loop_offer(struct cb_loop *loop, bool at_rest_only);

/* out: true: the offer is withdrawn, the spare box may be filled; false: too late */
bool cb_loop_withdraw(struct cb_loop *loop);

/* in : an offer was made and not withdrawn
 * out: true: the spare box runs now, the previous one is spare. Its rows published earlier are of
 *      the previous generation. */
bool cb_loop_answered(const struct cb_loop *loop);

/* The running box, for any thread. Valid until the next offer is taken. */
const struct cb_box *cb_loop_box(const struct cb_loop *loop);

/* For any thread. out: true if the running box has found its configuration changed in memory; it
 * then takes no offer. */
bool cb_loop_is_corrupt(const struct cb_loop *loop);

/* Thread function; argument: struct cb_loop *. Ends after a clean stop or on quit. */
void *cb_loop_run(void *argument);

#endif
