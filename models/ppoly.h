/* SPDX-License-Identifier: MIT
 * Piecewise polynomial: the one form in which every curve is evaluated.
 *
 * B-splines and polylines are turned into it when the coefficient file is loaded (bspline.h,
 * polyline.h), so that an evaluation is a span look-up and a Horner scheme in the span's own
 * coordinate, derivative included. */
#ifndef COMPBOX_MODELS_PPOLY_H
#define COMPBOX_MODELS_PPOLY_H

#include <stdbool.h>
#include <stdint.h>

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

/* What every curve of models/ gives for one x. */
struct cb_curve_value {
    float value;  /* unit of the curve (µm or µrad) */
    float slope;  /* d value / d x; 0 outside the range, where the value is held */
    bool outside; /* x was below or above the range, or NaN */
};

/* Span that holds x, which lies inside the breaks: a break belongs to the span on its right, the
 * last one to the last span. At most log2(spans) + 1 steps. */
uint16_t cb_ppoly_span(const struct cb_ppoly *curve, float x);

/* Value at x; outside the breaks (and for a NaN x: at the first break) the value at the end.
 * No state, no libm; at most log2(spans) + degree steps. */
float cb_ppoly_value(const struct cb_ppoly *curve, float x);

/* Value, slope and whether x lay outside. */
struct cb_curve_value cb_ppoly_evaluate(const struct cb_ppoly *curve, float x);

/* Sets spans_per_unit from the breaks: non-zero when the computed index is never off by more
 * than one span anywhere (the evaluation corrects one). Called once, when a curve is loaded. */
void cb_ppoly_index(struct cb_ppoly *curve);

/* The widest span for which underflow does no harm: (2^24)^5 times the smallest float32 is 2^-29.
 */
#define CB_PPOLY_MAX_SPAN 16777216.0f

/* true: value and slope are finite for every x, NaN and infinity included. For the loader, after
 * a conversion: false when breaks are too close together for coefficients of this size. */
bool cb_ppoly_is_finite(const struct cb_ppoly *curve);

#endif
