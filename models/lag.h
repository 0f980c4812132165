/* SPDX-License-Identifier: MIT
 * First-order lag tau dy/dt = u - y: the thermal memory of a structure (FACTS in docs/).
 *
 * Exact for an input that is linear between samples (first-order hold), for any step length. A held
 * input (zero-order hold) would lead or trail by half a sample. This matters to a model that was
 * trained on samples of a minute and runs at 30 ms, so training and box both use this lag. */
#ifndef COMPBOX_MODELS_LAG_H
#define COMPBOX_MODELS_LAG_H

#include <stdint.h>

#include "models/num.h"

/* Plain data that may be saved and restored; |u| up to 1e38. y = hi + lo: in 30 ms a lag of two
 * hours moves by 4e-6 of the remaining difference, which float32 alone loses once less than a
 * degree remains. */
struct cb_lag {
    float hi, lo; /* |lo| <= half an ulp of hi */
    float input;  /* u of the last step */
};

/* Gains of one step length: y += gain * (u0 - y) + ramp * (u1 - u0). The caller reuses them while
 * the step length is unchanged. */
struct cb_lag_gains {
    float gain; /* 1 - e^-h, h = dt / tau */
    float ramp; /* 1 - gain / h */
};

/* in : tau_s > 0
 * out: the gains within 4 ulp, however small dt / tau; both 0 (no change) for dt_s <= 0 or NaN,
 *      both 1 for an infinite dt_s */
struct cb_lag_gains cb_lag_gains_for(float dt_s, float tau_s);

/* The rest is inline, because a box has dozens of lags. */

/* Steady state at u (finite), as if u had always been the input. */
static inline void cb_lag_start(struct cb_lag *lag, float u) {
    lag->hi = u;
    lag->lo = 0.0f;
    lag->input = u;
}

/* in : to, finite: the input at the end of the step
 * out: y at the end of the step, within 3e-7 of the largest |u| of the exact lag, for dt / tau down
 *      to 2^-24 (1 ms of four hours), over any number of steps; exactly u once settled. */
static inline float cb_lag_step_to(struct cb_lag *lag, struct cb_lag_gains gains, float to) {
    const float hi = lag->hi, from = lag->input;
    const float missing = (from - hi) - lag->lo;
    const float way = gains.gain * missing + gains.ramp * (to - from);
    /* hi + lo += way with the rounding errors kept: two-sum, then renormalised */
    const float sum = hi + way;
    const float part = sum - hi;
    const float error = lag->lo + ((hi - (sum - part)) + (way - part));
    lag->hi = sum + error;
    lag->lo = error - (lag->hi - sum);
    lag->input = to;
    /* Within 1e-9 ulp the lag is settled, which avoids an endless subnormal tail. In that case hi
     * equals `to`, or both are close to zero; usually neither holds, and one comparison is
     * enough. */
    const float off = to - lag->hi;
    if (cb_abs(off) <= 1e-20f && (off != 0.0f || lag->lo != 0.0f) &&
        cb_abs(off - lag->lo) <= cb_abs(to) * 0x1p-53f + FLT_MIN)
        cb_lag_start(lag, to);
    return lag->hi;
}

#endif
