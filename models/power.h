/* SPDX-License-Identifier: MIT
 * Whole powers of a signal, and their range. */
#ifndef COMPBOX_MODELS_POWER_H
#define COMPBOX_MODELS_POWER_H

#include "models/num.h"

/* in : power >= 1. out: x^power, multiplied from the left; rising x never gives a falling odd
 *      power, because each rounding keeps the order */
static inline float cb_power(float x, unsigned power) {
    float y = x;
    for (; power > 1; --power) y *= x;
    return y;
}

struct cb_interval {
    float min, max;
};

/* in : min <= max. out: smallest and largest x^power for x in [min, max] */
static inline struct cb_interval cb_power_range(float min, float max, unsigned power) {
    const float a = cb_power(min, power), b = cb_power(max, power);
    if (power % 2 != 0) return (struct cb_interval){a, b};
    const bool through_zero = min < 0.0f && max > 0.0f;
    return (struct cb_interval){through_zero ? 0.0f : cb_min(a, b), cb_max(a, b)};
}

#endif
