/* SPDX-License-Identifier: MIT
 *
 * Rounding. With e = 2^-24, the given center and inverse_half_range taken as exact, x inside:
 *
 *     |value - sum a_k u^k|                 <= 1.001 e sum (4k + 1) |a_k u^k|
 *     |slope - inverse sum k a_k u^(k-1)|   <= 1.001 e inverse sum k (4k + 1) |a_k u^(k-1)|
 *
 * u carries two roundings (difference, product), Horner's scheme at most 2k + 1. */
#include "models/polynomial.h"

#include "models/num.h"

struct cb_curve_value cb_polynomial_evaluate(const struct cb_polynomial *polynomial, float x) {
    const float *a = polynomial->coefficients;
    const float inside = cb_clamp(x, polynomial->from, polynomial->to);
    const float u = (inside - polynomial->center) * polynomial->inverse_half_range;
    float value = a[polynomial->degree];
    float slope = 0.0f;
    for (int k = polynomial->degree - 1; k >= 0; --k) {
        slope = slope * u + value;
        value = value * u + a[k];
    }
    const bool outside = !(inside == x);
    const struct cb_curve_value result = {
        value, outside ? 0.0f : slope * polynomial->inverse_half_range, outside};
    return result;
}

/* As cb_ppoly_is_finite: Horner's scheme over absolute values at the largest |u| bounds every step
 * of every evaluation. */
bool cb_polynomial_is_finite(const struct cb_polynomial *polynomial) {
    const float *a = polynomial->coefficients;
    const float below = cb_abs(polynomial->from - polynomial->center);
    const float above = cb_abs(polynomial->to - polynomial->center);
    const float u = cb_max(below, above) * polynomial->inverse_half_range;
    float value = cb_abs(a[polynomial->degree]);
    float slope = 0.0f;
    for (int k = polynomial->degree - 1; k >= 0; --k) {
        slope = slope * u + value;
        value = value * u + cb_abs(a[k]);
    }
    slope *= polynomial->inverse_half_range;
    return cb_is_finite(value) && cb_is_finite(slope) && cb_is_finite(u);
}
