/* SPDX-License-Identifier: MIT
 * B-spline (S1: C(t) = sum N_j,p(t) b_j, Cox-de Boor basis with 0/0 = 0) to piecewise polynomial.
 */
#ifndef COMPBOX_MODELS_BSPLINE_H
#define COMPBOX_MODELS_BSPLINE_H

#include <stdint.h>

#include "models/ppoly.h"

enum { CB_BSPLINE_MAX_DEGREE = 5 };

/* A B-spline in the x of its signal (not parametric): control_points[count], knots[count+degree+1]
 * in ascending order (repeated knots allowed, each at most degree+1 times), degree 1 … 5,
 * count >= degree+1. Its domain is [knots[degree], knots[count]], which must not be empty. */
struct cb_bspline {
    const float *knots;
    const float *control_points;
    uint16_t count;
    uint8_t degree;
};

/* Faults of a B-spline; `at` is the index of the knot or control point that the message names. */
enum cb_bspline_fault {
    CB_BSPLINE_OK,
    CB_BSPLINE_DEGREE,       /* degree is not 1 … 5 */
    CB_BSPLINE_COUNT,        /* fewer than degree+1 control points */
    CB_BSPLINE_KNOT,         /* knots[at] is NaN or infinite */
    CB_BSPLINE_VALUE,        /* control_points[at] is NaN or infinite */
    CB_BSPLINE_ORDER,        /* knots[at] is below the knot before it */
    CB_BSPLINE_MULTIPLICITY, /* knots[at] repeats its value more than degree+1 times */
    CB_BSPLINE_EMPTY,        /* knots[at], the end of the domain, equals its start */
    CB_BSPLINE_WIDE,         /* knots[at] is more than CB_PPOLY_MAX_SPAN above the one before it */
};

/* in : knots and control_points as long as count and degree require
 * out: CB_BSPLINE_OK, or the first fault and its *at (0 where it names no element)
 * The functions below require CB_BSPLINE_OK. */
enum cb_bspline_fault cb_bspline_check(const struct cb_bspline *spline, uint16_t *at);

/* Number of non-empty knot spans in the domain, which is the number of spans of the piecewise
 * polynomial. */
uint16_t cb_bspline_spans(const struct cb_bspline *spline);

/* in : breaks[spans+1], coefficients[spans*(degree+1)] from the caller, spans = cb_bspline_spans()
 * out: the same function as a piecewise polynomial, within a few float32 roundings of the control
 *      points' size (bound in bspline.c, tested against exact rationals); at a break it continues
 *      from the right. Call cb_ppoly_is_finite before using it.
 * No state, no libm. */
void cb_bspline_to_ppoly(const struct cb_bspline *spline, float *breaks, float *coefficients,
                         struct cb_ppoly *curve);

#endif
