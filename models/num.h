/* SPDX-License-Identifier: MIT
 * The few float32 helpers that models/ and firmware/ share.
 * No libm: every operation here is exact or one IEEE 754 rounding, so results are the same
 * on every target. */
#ifndef COMPBOX_MODELS_NUM_H
#define COMPBOX_MODELS_NUM_H

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* For the few functions of a step's inner loops that a compiler would call rather than inline,
 * because two places use them. */
#define CB_INLINE static inline __attribute__((always_inline))

/* The other way round: what is seldom needed, and would take registers from what always is. */
#define CB_OUTLINE static __attribute__((noinline))

/* And what a usual step does not call at all: not even its arguments are made ready on the way. */
#define CB_COLD __attribute__((cold))

/* true for every float except NaN and the infinities, whose difference from themselves is NaN. */
static inline bool cb_is_finite(float x) {
    return x - x == 0.0f;
}

/* in : lo <= hi, both finite
 * out: x forced into [lo, hi]; lo when x is NaN (the comparison is written to catch it) */
static inline float cb_clamp(float x, float lo, float hi) {
    return !(x > lo) ? lo : (x > hi ? hi : x);
}

/* One instruction of every target, not a call. */
static inline float cb_abs(float x) {
    return __builtin_fabsf(x);
}

static inline float cb_min(float a, float b) {
    return a < b ? a : b;
}

static inline float cb_max(float a, float b) {
    return a > b ? a : b;
}

/* The 32 bits of a float, and back. */
static inline uint32_t cb_bits_of(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float cb_float_of(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* x itself, or the one NaN that all targets share: theirs differ in sign and payload. */
static inline float cb_canonical(float x) {
    return x == x ? x : cb_float_of(0x7FC00000u);
}

#endif
