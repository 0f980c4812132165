/* SPDX-License-Identifier: MIT
 * The memory of the lags across a restart: saved with wall-clock time by the normal thread, resumed
 * by a lag whose pause was short against its time constant (docs/compboxd.md, "State"). */
#ifndef COMPBOX_HAL_LINUX_DAEMON_STATE_H
#define COMPBOX_HAL_LINUX_DAEMON_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box.h"

/* A pause longer than this part of tau is not resumed: what the input did meanwhile is unknown, and
 * the old state still counts for e^-1/4 = 78 %. */
enum { CB_STATE_PAUSES = 4 };

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

/* The box's lags as they are. */
void cb_state_take(struct cb_state *state, const struct cb_box *box);

/* Into a box that was just started. A lag that is not settled stays as it is. */
void cb_state_give(const struct cb_state *state, struct cb_box *box);

/* Writes a temporary file beside `path`, syncs it and renames it over it; times become wall-clock
 * times. out: 0, or errno (ENOTSUP: what is there is not a regular file); then the file that was
 * there is untouched. */
int cb_state_write(const struct cb_state *state, const struct cb_config *config, const char *path,
                   int64_t boottime_us, int64_t unix_us);

/* in : said[size] for one sentence about what was found
 * out: true: *state holds the lags that may go on, the others not settled; false: the file is not
 *      there, damaged, or of something else: *state is empty. A lag goes on where name, signal,
 *      power and tau are the same and its pause was short. */
bool cb_state_read(struct cb_state *state, const struct cb_config *config, const char *path,
                   int64_t boottime_us, int64_t unix_us, char *said, size_t size);

#endif
