/* SPDX-License-Identifier: MIT
 * Piecewise polynomial, the one form in which every curve is evaluated.
 *
 * The loader converts B-splines and polylines to it (bspline.h, polyline.h). An evaluation is then
 * a span look-up and a Horner scheme in the span's own coordinate, derivative included. */
#ifndef COMPBOX_MODELS_PPOLY_H
#define COMPBOX_MODELS_PPOLY_H

#include <stdbool.h>
#include <stdint.h>

#include "models/num.h"

enum { CB_PPOLY_MAX_DEGREE = 5 };

/* A curve of `spans` pieces. The caller owns the memory behind both pointers.
 *   breaks[spans + 1]                 strictly ascending, finite
 *   coefficients[spans * (degree+1)]  span after span, ascending powers of x - breaks[i] */
struct cb_ppoly {
    const float *breaks;
    const float *coefficients;
    float spans_per_unit; /* > 0: breaks are nearly uniform, index computed; 0: binary search */
    uint16_t spans;       /* >= 1 */
    uint8_t degree;       /* 0 … CB_PPOLY_MAX_DEGREE */
};

/* Result of every curve of models/ for one x. */
struct cb_curve_value {
    float value;  /* unit of the curve (µm or µrad) */
    float slope;  /* d value / d x; 0 outside the range, where the value is held */
    bool outside; /* x was below or above the range, or NaN */
};

/* in : x, any float
 * out: value, slope, and whether x is outside of the breaks; then the value at that end (for NaN:
 *      at the first break)
 * A break belongs to the span on its right, the last one to the last span. No state, no libm; at
 * most log2(spans) + degree + 1 steps. */
struct cb_curve_value cb_ppoly_evaluate(const struct cb_ppoly *curve, float x);

/* Value and range without the slope, for repeated calls near the same place.
 * in : *span: any number at the first call, then the result of the last call
 * out: *span holds x; if it already did, no clamp and no search was needed */
static inline struct cb_curve_value cb_ppoly_near(const struct cb_ppoly *curve, float x,
                                                  uint16_t *span);

/* in : *span, any number
 * out: true: *span holds x; false, *span unchanged: x is at or beyond an end, or NaN */
bool cb_ppoly_follow(const struct cb_ppoly *curve, float x, uint16_t *span);

/* Second half of cb_ppoly_near: x has left *span, usually for a neighbour; otherwise the span is
 * searched. */
struct cb_curve_value cb_ppoly_elsewhere(const struct cb_ppoly *curve, float x, uint16_t *span);

/* out: true if x lies in this span (any number) and not at the end of the last one */
static inline bool cb_ppoly_holds(const struct cb_ppoly *curve, float x, uint16_t span);

/* Sets spans_per_unit from the breaks: non-zero when the computed index is nowhere off by more than
 * one span, which the evaluation corrects. Called once, when a curve is loaded. */
void cb_ppoly_index(struct cb_ppoly *curve);

/* The widest span for which underflow is harmless: (2^24)^5 times the smallest float32 is 2^-29. */
#define CB_PPOLY_MAX_SPAN 16777216.0f

/* out: true if value and slope are finite for every x, NaN and infinity included. For the loader,
 *      after a conversion: false when breaks are too close together for coefficients of this
 * size. */
bool cb_ppoly_is_finite(const struct cb_ppoly *curve);

/* ---- inline: a box has dozens of curves ---- */

/* Horner's scheme, for other degrees than 3. */
CB_COLD float cb_ppoly_horner_any(const float *a, uint8_t degree, float u);
static inline float cb_ppoly_horner(const float *a, uint8_t degree, float u) {
    if (degree == 3) return ((a[3] * u + a[2]) * u + a[1]) * u + a[0];
    return cb_ppoly_horner_any(a, degree, u);
}

/* Value in one span, which holds `inside`. */
static inline float cb_ppoly_value_in(const struct cb_ppoly *curve, float inside, uint32_t span) {
    const float *a = curve->coefficients + span * (curve->degree + 1u);
    return cb_ppoly_horner(a, curve->degree, inside - curve->breaks[span]);
}

static inline bool cb_ppoly_holds(const struct cb_ppoly *curve, float x, uint16_t span) {
    return span < curve->spans && x >= curve->breaks[span] && x < curve->breaks[span + 1];
}

static inline struct cb_curve_value cb_ppoly_near(const struct cb_ppoly *curve, float x,
                                                  uint16_t *span) {
    if (cb_ppoly_holds(curve, x, *span))
        return (struct cb_curve_value){cb_ppoly_value_in(curve, x, *span), 0.0f, false};
    return cb_ppoly_elsewhere(curve, x, span);
}

#endif
