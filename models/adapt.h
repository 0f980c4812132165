/* SPDX-License-Identifier: MIT
 * Bounded adaptation of a model by probes: y = b + (1 + g) m.
 *
 * b (µm) is a bias, g a relative gain, m (µm) the model's value. Both drift as random walks between
 * probes. A probe z = b + (1 + g) m + noise is one step of a Kalman filter of two states. Its
 * covariance is U D U' with d > 0, so no rounding makes it indefinite.
 *
 * Invariants, for any sequence of calls with any numbers (adapt.c proves them):
 *   (1) |y - m| <= bias_max_um + gain_max |m|, exactly;
 *   (2) a probe moves b + (1 + g) m at its own m by step_max_um at most, within rounding;
 *   (3) |b| <= bias_max_um, |g| <= gain_max, and the covariance is positive and finite.
 *
 * Rounding: b + (1 + g) m and its standard deviation are within 2e-7 of the largest number of a run
 * of 150 probes from those of a filter in 50 digits (tests/oracle/adapt.py). */
#ifndef COMPBOX_MODELS_ADAPT_H
#define COMPBOX_MODELS_ADAPT_H

#include <stdbool.h>
#include <stdint.h>

#include "models/sigma.h"

/* A measurement or model value beyond this size is implausible. */
#define CB_ADAPT_MOST_UM 1e6f

/* Settings, constant. Ranges are inclusive. */
struct cb_adapt_settings {
    float bias_max_um;           /* 0 … 1e6: bound of |b| */
    float gain_max;              /* 0 … 10: bound of |g| */
    float step_max_um;           /* > 0 … 1e6: movement of y by one probe */
    float drift_um_per_sqrt_h;   /* 0 … 1e3: standard deviation of b's change in one hour */
    float gain_drift_per_sqrt_h; /* 0 … 10: likewise of g */
    float sigma_um;              /* 1e-3 … 1e3: standard deviation of one probe */
    float min_interval_s;        /* 0 … 86 400: earlier probes are not taken */
};

/* Plain data that may be saved and restored (cb_adapt_resume). P = U D U', U = [1 u; 0 1], D =
 * diag(bias_d, gain_d): the variance of b is bias_d + u² gain_d, that of g gain_d. */
struct cb_adapt {
    float bias_um, gain;  /* b, g */
    float bias_d, gain_d; /* > 0; µm², 1 */
    float u;              /* µm */
    float since_h;        /* since the last probe that was taken; FLT_MAX: there was none */
    float innovation_um;  /* of the last probe that was judged: z - (b + (1 + g) m) … */
    float expected_um;    /* … and the root of its variance S; 0: no probe was judged */
    float pending_um[2];  /* innovations outside of the gate, not yet resolved, the oldest first */
    float pending_h;      /* age of the newest one */
    float place[CB_SIGMA_DIRECTIONS]; /* of the model at the last probe that was taken … */
    uint32_t model;     /* … and which model (struct cb_sigma); 0: none was, or it states none */
    float above, below; /* CUSUM of the normalised innovations of taken probes, >= 0 */
    uint8_t pending;    /* their number, 0 … 2 */
    uint8_t asked;      /* 1: a repetition was asked for */
};

#ifdef __cplusplus
#define CB_ADAPT_ASSERT static_assert
#else
#define CB_ADAPT_ASSERT _Static_assert
#endif
CB_ADAPT_ASSERT(sizeof(struct cb_adapt) == 76, "stored as it is");

/* Result of one probe. */
enum cb_adapt_outcome {
    CB_ADAPT_TAKEN,       /* inside the gate: b, g and P have changed */
    CB_ADAPT_CONFIRMED,   /* outside, but it agrees with the probe before: taken */
    CB_ADAPT_MEDIAN,      /* the third outside that disagree: the median of the three is taken */
    CB_ADAPT_ASK,         /* outside: please probe again; nothing has changed */
    CB_ADAPT_EARLY,       /* within min_interval_s of the last one: not taken */
    CB_ADAPT_IMPLAUSIBLE, /* not a number, or beyond CB_ADAPT_MOST_UM: not taken */
};

/* out: true if the probe has changed b, g and P */
static inline bool cb_adapt_was_taken(enum cb_adapt_outcome outcome) {
    return outcome <= CB_ADAPT_MEDIAN;
}

/* out: b = g = 0 with standard deviations of 1 µm and 0.5, no probe before */
void cb_adapt_start(struct cb_adapt *state);

/* After a restart, or under new settings.
 * in : *state from a stored copy, any bits
 * out: b and g inside the bounds; as cb_adapt_start() if a field is not valid */
void cb_adapt_resume(const struct cb_adapt_settings *settings, struct cb_adapt *state);

/* Time passes: the covariance grows.
 * in : hours since the last call, at most 10 000 count; not positive or NaN: no change */
void cb_adapt_wait(const struct cb_adapt_settings *settings, struct cb_adapt *state, float hours);

/* One probe, after cb_adapt_wait() for the time until it.
 * in : probed_um, any float: the whole error that the model has to explain; model_um, any float: m
 *      at the probe; own: the model's own sigma there, |place| <= CB_SIGMA_MOST_PLACE; NULL: it
 *      states none
 * out: the outcome. S is the variance of the innovation. Inside of 3 sqrt(S) the probe is taken
 * alone, and pending ones are dropped. Two outside agree if they differ by no more than three
 * standard deviations of their noise and of the drift between them; then the newer one is taken.
 * Two that the bounds of b and g do not reach contradict what the settings state of the machine: a
 * third is asked for, and the median taken, although they agree. */
enum cb_adapt_outcome cb_adapt_probe(const struct cb_adapt_settings *settings,
                                     struct cb_adapt *state, float probed_um, float model_um,
                                     const struct cb_sigma *own);

/* The probes that are taken differ from the prediction to one side for longer than chance and the
 * stated drifts allow: the model no longer fits the machine, or a bound holds it back. Each taken
 * innovation, in its standard deviations and within ±3, adds to `above` or `below` what exceeds
 * 0.5. Unbiased ones reach the limit once in about 10 000 probes; one standard deviation to one
 * side reaches it in about 20.
 * out: the larger sum; beyond CB_ADAPT_DRIFTED it is an alarm */
#define CB_ADAPT_DRIFTED 10.0f
static inline float cb_adapt_cusum(const struct cb_adapt *state) {
    return state->above > state->below ? state->above : state->below;
}

/* out: y at the model value m; m itself at b = g = 0; invariant (1) for |model_um| <= 1e30, any
 *      float bias_um and gain */
float cb_adapt_value(const struct cb_adapt_settings *settings, float bias_um, float gain,
                     float model_um);

/* in : own as in cb_adapt_probe()
 * out: standard deviation of y at this m and place, µm, >= 0, without the probe's noise */
float cb_adapt_sigma(const struct cb_adapt *state, float model_um, const struct cb_sigma *own);

#endif
