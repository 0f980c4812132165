/* SPDX-License-Identifier: MIT */
#include "models/transcendental.h"

/* x = n ln 2 + r, |r| <= ln 2 / 2 plus a rounding; q = e^r - 1. */
struct reduced {
    int32_t n;
    float q;
};

/* in : |x| < 128
 * The high part of ln 2 has nine bits, so n * high is exact and r is accurate to 2^-31. */
static struct reduced reduce(float x) {
    const float round = 12582912.0f; /* 1.5 * 2^23: adding it leaves the nearest integer */
    const float m = x * 1.44269502f + round;
    const float n = m - round;
    const float r = (x - n * 0.693359375f) - n * -0.000212194442f;
    float q = 0.00138825172f;
    q = q * r + 0.00836654752f;
    q = q * r + 0.0416672006f;
    q = q * r + 0.166665435f;
    q = q * r + 0.49999997f;
    const struct reduced result = {(int32_t)(cb_bits_of(m) - cb_bits_of(round)), r + q * (r * r)};
    return result;
}

/* in : -126 <= n <= 127
 * out: 2^n, exact */
static float power_of_two(int32_t n) {
    return cb_float_of((uint32_t)(n + 127) << 23);
}

float cb_one_minus_exp(float x) {
    if (!(x > 0.0f)) return 0.0f;
    if (x > 18.0f) return 1.0f;
    const struct reduced e = reduce(-x);
    const float scale = power_of_two(e.n);
    return (1.0f - scale) - scale * e.q;
}
