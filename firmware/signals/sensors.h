/* SPDX-License-Identifier: MIT
 * Sensors that check each other: each is predicted from all others, and one that contradicts them
 * for long is doubted.
 *
 * With d = value - center and the precision matrix P of the sensors in healthy operation, the
 * residual of sensor j is r_j = (P d)_j, and r_j / P_jj is its reading less the prediction by the
 * others. z_j^2 = r_j^2 / P_jj is the gain in likelihood if sensor j alone is wrong. For a fault f
 * of sensor j, z_j^2 = f^2 P_jj, and z_k^2 = f^2 P_kj^2 / P_kk is not larger, by Cauchy's
 * inequality. So the largest one is the sensor at fault (Willsky, Automatica 12, 1976: generalised
 * likelihood ratio).
 *
 * A doubted or stale sensor takes the value that the others predict (one step of Gauss-Seidel a
 * second on P d = 0), so that it accuses no other one. Lags of a doubted one follow it too. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_SENSORS_H
#define COMPBOX_FIRMWARE_SIGNALS_SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/base/limits.h"
#include "firmware/signals/signals.h"

struct cb_config;

enum {
    CB_SENSORS_PASS_US = 1000000, /* a pass over all sensors */
    CB_SENSORS_TRUST = 10,        /* times after_s of agreement until a doubted one is trusted */
};

/* All zero: no comparison was made. */
struct cb_sensors_state {
    float away[CB_MAX_SENSORS];  /* reading less center; of a doubted or stale one the others'
                                    prediction */
    uint32_t us[CB_MAX_SENSORS]; /* time of disagreement; of a doubted one of agreement, divided by
                                    CB_SENSORS_TRUST */
    int64_t pass_us;             /* start of this pass over all sensors; 0: none */
    uint32_t elapsed_us;         /* from the start of the pass before to that of this one; 0:
                                    this one judges nobody */
    uint32_t reads;     /* a bit of each: at the start of this pass not stale, not doubted */
    uint32_t doubted;   /* a bit of each; at most a third of all */
    float worst_square; /* largest z^2 of this pass so far … */
    uint8_t worst;      /* … and its sensor */
    uint8_t next;       /* the sensor to compare next; of an ended pass the number of all */
};
_Static_assert(CB_MAX_SENSORS <= 32, "a bit of a word for each");

/* in : a file with sensors; the signals with the values accepted in this step; now_us, of this step
 * out: doubted, streak and expected of the signals, by *state. A doubted signal is not fresh
 *      (signals.c).
 *      Counts each new doubt.
 * A pass over all sensors begins each second. A step compares one of them; all that are left if the
 * second is over. */
void cb_sensors_watch(const struct cb_config *config, struct cb_signal_state *signals,
                      struct cb_sensors_state *state, struct cb_counters *counters, int64_t now_us);

#endif
