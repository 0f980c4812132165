/* SPDX-License-Identifier: MIT */
#include "models/lag.h"

#include "models/transcendental.h"

/* in : 0 < h <= 1, gain = 1 - e^-h
 * out: 1 - gain / h = h/2! - h^2/3! + h^3/4! - …, which the subtraction would lose for small h */
static float ramp_series(float h) {
    float sum = 1.0f;
    for (int k = 11; k >= 3; --k) sum = 1.0f - sum * h / (float)k;
    return sum * h * 0.5f;
}

struct cb_lag_gains cb_lag_gains_of_long(float h) {
    struct cb_lag_gains gains = {cb_one_minus_exp(h), 0.0f};
    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;
    return gains;
}
