/* SPDX-License-Identifier: MIT
 * The few float32 helpers that models/ and firmware/ share. No libm: every operation here is exact
 * or one IEEE 754 rounding, so results are the same on every target. */
#ifndef COMPBOX_MODELS_NUM_H
#define COMPBOX_MODELS_NUM_H

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* For the few functions in a step's inner loops that have two callers and that a compiler would not
 * inline. */
#define CB_INLINE static inline __attribute__((always_inline))

/* The opposite: rare code that would take registers from the common path. */
#define CB_OUTLINE static __attribute__((noinline))

/* Code that a usual step never calls; the common path does not prepare its arguments. */
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

/* Compiles to one instruction on every target, not a call. */
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

/* x itself, or the one NaN that all targets share, because native NaNs differ in sign and
 * payload. */
static inline float cb_canonical(float x) {
    return x == x ? x : cb_float_of(0x7FC00000u);
}

#endif
