/* SPDX-License-Identifier: MIT
 * One polynomial over one range: y = sum a_k u^k, u = (x - center) / half_range, from <= x <= to.
 */
#ifndef COMPBOX_MODELS_POLYNOMIAL_H
#define COMPBOX_MODELS_POLYNOMIAL_H

#include <stdint.h>

#include "models/ppoly.h"

enum { CB_POLYNOMIAL_MAX_DEGREE = 15 };

/* coefficients[degree+1], ascending powers, in memory of the caller. The fits of S4 in plain x have
 * center 0 and half_range 1; S1's 7th degree over 14 300 mm needs |u| <= 1 to fit float32. */
struct cb_polynomial {
    const float *coefficients;
    float center;             /* unit of x */
    float inverse_half_range; /* 1 / unit of x; > 0 */
    float from, to;           /* unit of x; from < to */
    uint8_t degree;
};

/* Value, slope, and whether x is outside [from, to]. Outside (and for NaN, at `from`): the value at
 * the end, slope 0. No state, no libm. */
struct cb_curve_value cb_polynomial_evaluate(const struct cb_polynomial *polynomial, float x);

/* out: true if value and slope are finite for every x, NaN and infinity included. For the loader:
 *      false when a coefficient is not finite, or so large that the sum overflows within [from,
 *      to]. */
bool cb_polynomial_is_finite(const struct cb_polynomial *polynomial);

#endif
