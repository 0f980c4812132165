/* SPDX-License-Identifier: MIT
 * The file of the box's state (firmware/box/state.h). The normal thread saves the state with the
 * time on two clocks. A lag is resumed if its pause was short against its time constant
 * (docs/compboxd.md, "State"). Within one boot CLOCK_BOOTTIME measures the pause. Across boots the
 * wall clock does, if the kernel held it synchronised both at saving and at loading; otherwise the
 * pause is unknown. */
#ifndef COMPBOX_HAL_LINUX_FILES_STATE_H
#define COMPBOX_HAL_LINUX_FILES_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box/state.h"

/* A pause longer than this fraction of tau is not resumed: the input during the pause is unknown,
 * and the old state still has a weight of e^-1/4 = 78 %. */
enum { CB_STATE_PAUSES = 4 };

/* The PLC's heartbeat has 16 bits and counts at most once a millisecond. A beat older than this may
 * have wrapped around, and is dropped. */
enum { CB_STATE_BEAT_US = 30000000 };

/* Time by which the uncertainty of adapted terms grows over a pause of unknown length: a week. */
#define CB_STATE_UNKNOWN_US ((int64_t)7 * 24 * 3600 * 1000000)

enum { CB_BOOT_ID_SIZE = 40 }; /* a UUID in hexadecimal, 36 characters */

/* One moment on both clocks that measure a pause. */
struct cb_state_clock {
    int64_t boottime_us;
    int64_t unix_us;
    bool synchronised;             /* the kernel holds unix_us synchronised with a time source */
    char boot_id[CB_BOOT_ID_SIZE]; /* of this boot, ended by 0; "": unknown */
};

/* out: now. Where the kernel refuses a query: not synchronised, or unknown. */
void cb_state_clock_read(struct cb_state_clock *clock);

/* Writes a temporary file beside `path`, syncs it and renames it over `path`.
 * in : now: both clocks at one moment, which convert all times to wall-clock times
 * out: 0, or errno (ENOTSUP: `path` is not a regular file); on error the old file is unchanged */
int cb_state_write(const struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now);

/* in : message[size] for one sentence about the result
 * out: true: *state holds the resumable lags, the others not settled, the ending, and the PLC's
 *      heartbeat if its pause is known and short, and the probes of terms with the same name and
 *      model after any pause; false: the file is missing, damaged, or of
 *      another kind, and *state is empty. A lag is resumable if name, signal, power and tau are the
 *      same and its pause is known and short. */
bool cb_state_read(struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now, char *message, size_t size);

/* The coefficient file of the run that wrote the state. */
struct cb_last_run {
    char machine[40];
    uint32_t revision; /* 0: a version wrote it that did not keep it */
};

/* out: true and *ran; false: the file is missing or damaged */
bool cb_state_last_run(struct cb_last_run *ran, const char *path);

#endif
