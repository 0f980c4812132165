/* SPDX-License-Identifier: MIT */
#include "models/lag.h"

#include "models/transcendental.h"

/* in : 0 < h <= 1, gain = 1 - e^-h
 * out: 1 - gain / h as the series h/2! - h^2/3! + h^3/4! - …, because the subtraction cancels for
 *      small h */
static float ramp_series(float h) {
    float sum = 1.0f;
    for (int k = 11; k >= 3; --k) sum = 1.0f - sum * h / (float)k;
    return sum * h * 0.5f;
}

/* in : 0 < h <= 1/64, which covers the box's steps against the time constants of a machine
 * out: both gains; the first neglected power is 2e-10 of the ramp */
static struct cb_lag_gains small_gains(float h) {
    const float ramp =
        0.5f * h * (1.0f - h * (1.0f / 3.0f) * (1.0f - h * 0.25f * (1.0f - h * 0.2f)));
    const struct cb_lag_gains gains = {h * (1.0f - ramp), ramp};
    return gains;
}

struct cb_lag_gains cb_lag_gains_for(float dt_s, float tau_s) {
    const float h = dt_s / tau_s;
    if (h > 0.0f && h <= 0.015625f) return small_gains(h);
    struct cb_lag_gains gains = {cb_one_minus_exp(h), 0.0f};
    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;
    return gains;
}
