/* SPDX-License-Identifier: MIT
 * What the box keeps across a restart: the lags, how the run ended, and the PLC's last heartbeat.
 * Saved by the normal thread with the time by two clocks; a lag is resumed when its pause was short
 * against its time constant (docs/compboxd.md, "State").
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

/* The PLC's heartbeat has 16 bits and counts at most once a millisecond: one that was read longer
 * ago than this may have wrapped around, and is dropped. */
enum { CB_STATE_BEAT_US = 30000000 };

enum { CB_BOOT_ID_SIZE = 40 }; /* a UUID in hexadecimal, 36 characters */

/* One lag at one moment. */
struct cb_lag_state {
    struct cb_lag lag;
    int64_t time_us; /* of its last value; CLOCK_BOOTTIME */
    bool settled;    /* it has begun: lag means something */
};

/* What the loop hands over once a second, and what it is given before it starts. */
struct cb_state {
    struct cb_lag_state lags[CB_MAX_SIGNALS]; /* by the index of their signal */
    int64_t beat_us;                          /* when plc_heartbeat was read; CLOCK_BOOTTIME */
    uint16_t plc_heartbeat;
    bool beat;    /* plc_heartbeat and beat_us mean something */
    bool stopped; /* the run ended STOPPED, and the PLC confirmed that */
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

/* The box's lags and the PLC's heartbeat as they are, of a run that goes on: `stopped` is false. */
void cb_state_take(struct cb_state *state, const struct cb_box *box);

/* in : the box of a run that has ended
 * out: the PLC holds STOPPED: this run's last write, confirmed, or the run before's, when this run
 *      wrote nothing */
bool cb_state_ended_stopped(const struct cb_box *box);

/* Into a box that was just started. A lag that is not settled stays as it is. */
void cb_state_give(const struct cb_state *state, struct cb_box *box);

/* Writes a temporary file beside `path`, syncs it and renames it over it.
 * in : now: both clocks at one moment, by which all times also become wall-clock times
 * out: 0, or errno (ENOTSUP: what is there is not a regular file); then the file that was there is
 *      untouched */
int cb_state_write(const struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now);

/* in : said[size] for one sentence about what was found
 * out: true: *state holds the lags that may go on, the others not settled, how the run ended, and
 *      the PLC's heartbeat, if its pause is known and was short; false: the file is not there,
 *      damaged, or of something else: *state is empty. A lag goes on where name, signal, power and
 *      tau are the same and its pause is known and was short. */
bool cb_state_read(struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now, char *said, size_t size);

#endif
