/* SPDX-License-Identifier: MIT
 * tanh and 1 - exp(-x) in float32, without libm and without tables.
 *
 * Every operation is one IEEE 754 rounding in a fixed order, so the bits are the same on every
 * target (round to nearest, subnormals on, no contraction). The bounds below are of all 2^32
 * arguments (transcendental_test.cpp, exhaustive with COMPBOX_LONG_TESTS=1); an
 * ulp is the spacing of float32 at the exact result. A NaN argument gives a NaN of unspecified sign
 * and payload, which the caller makes canonical (cb_canonical in num.h). */
#ifndef COMPBOX_MODELS_TRANSCENDENTAL_H
#define COMPBOX_MODELS_TRANSCENDENTAL_H

#include "models/num.h"

/* 2^(n + f) for m = 1.5 * 2^23 + n as float and |f| <= 1/2; relative error below 2.6 * 2^-24.
 * Monotone in n + f, also across the seam between two n. */
static inline float cb_exp2_split(float m, float f) {
    float p = 0.00132647273f;
    p = p * f + 0.00967151295f;
    p = p * f + 0.0555073372f;
    p = p * f + 0.240222424f;
    p = p * f + 0.693146977f;
    p = p * f + 1.0f;
    return cb_float_of(cb_bits_of(p) + (cb_bits_of(m) << 23)); /* the low bits of m are n */
}

/* in : any float
 * out: tanh(x) within 2.3 ulp; odd, monotone, +-1 from 9.011 on and at the infinities, -0 at -0
 *
 * Small arguments: x + x^3 P(x^2). Others: 1 - 2 / (1 + e^2a). Each step is monotone by itself, so
 * rounding cannot break monotonicity. Inline, because a network calls it in its loop. */
static inline float cb_tanh(float x) {
    const float from = 0.549306154f, one = 9.25f, round = 12582912.0f; /* atanh(1/2); 1.5 * 2^23 */
    const uint32_t sign = cb_bits_of(x) & 0x80000000u;
    const float a = cb_float_of(cb_bits_of(x) ^ sign);
    float y = 1.0f;
    if (!(a >= from)) {
        const float u = a * a;
        float p = 0.0164444223f;
        p = p * u - 0.0526752979f;
        p = p * u + 0.133207783f;
        p = p * u - 0.333329499f;
        y = a + p * u * a;
    } else if (a <= one) {
        const float z = a * 2.88539004f; /* 2 / ln 2 */
        const float m = z + round;
        y = 1.0f - 2.0f / (1.0f + cb_exp2_split(m, z - (m - round)));
    }
    return cb_float_of(sign | cb_bits_of(y));
}

/* in : any float
 * out: 1 - e^-x for x > 0 within 1.1 ulp, small x included; monotone, 1 at +infinity; 0 for
 *      x <= 0 and NaN, because it is the gain of a lag over an elapsed time */
float cb_one_minus_exp(float x);

#endif
