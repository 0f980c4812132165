/* SPDX-License-Identifier: MIT
 * The memory of the lags across a restart: saved by the normal thread with the time by two clocks,
 * resumed by a lag whose pause was short against its time constant (docs/compboxd.md, "State").
 * Within one boot CLOCK_BOOTTIME measures the pause. Across boots the wall clock does, where the
 * kernel held it synchronised both at saving and at loading; otherwise the pause is unknown. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_STATE_H
#define COMPBOX_HAL_LINUX_DAEMON_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box.h"

/* A pause longer than this part of tau is not resumed: what the input did meanwhile is unknown, and
 * the old state still counts for e^-1/4 = 78 %. */
enum { CB_STATE_PAUSES = 4 };

enum { CB_BOOT_ID_SIZE = 40 }; /* a UUID in hexadecimal, 36 characters */

/* One lag at one moment. */
struct cb_lag_state {
    struct cb_lag lag;
    int64_t time_us; /* of its last value; CLOCK_BOOTTIME */
    bool settled;    /* it has begun: lag means something */
};

/* All lags, by the index of their signal. What the loop hands over once a second, and what it is
 * given before it starts. */
struct cb_state {
    struct cb_lag_state lags[CB_MAX_SIGNALS];
};

/* One moment by the clocks that a pause is measured with. */
struct cb_state_clock {
    int64_t boottime_us;
    int64_t unix_us;
    bool synchronised;             /* the kernel holds unix_us synchronised with a time source */
    char boot_id[CB_BOOT_ID_SIZE]; /* of this boot, ends with a zero; "": unknown */
};

/* out: now. What the kernel does not permit to be asked counts as not synchronised, or unknown. */
void cb_state_clock_read(struct cb_state_clock *clock);

/* The box's lags as they are. */
void cb_state_take(struct cb_state *state, const struct cb_box *box);

/* Into a box that was just started. A lag that is not settled stays as it is. */
void cb_state_give(const struct cb_state *state, struct cb_box *box);

/* Writes a temporary file beside `path`, syncs it and renames it over it.
 * in : now: both clocks at one moment, by which the lags' times also become wall-clock times
 * out: 0, or errno (ENOTSUP: what is there is not a regular file); then the file that was there is
 *      untouched */
int cb_state_write(const struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now);

/* in : said[size] for one sentence about what was found
 * out: true: *state holds the lags that may go on, the others not settled; false: the file is not
 *      there, damaged, or of something else: *state is empty. A lag goes on where name, signal,
 *      power and tau are the same and its pause is known and was short. */
bool cb_state_read(struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now, char *said, size_t size);

#endif
