/* SPDX-License-Identifier: MIT
 *
 * The coefficient of u^k in the span [t_m, t_m+1) is the k-th derivative at t_m over k!. The
 * derivative of a B-spline is a B-spline of one degree less, whose control points are scaled
 * differences; its value at t_m comes from de Boor's scheme.
 *
 * Rounding. For one span of width h and degree p let M be the largest |control point| of its p+1
 * active ones, R half their range, e = 2^-24. Then, evaluation by cb_ppoly_evaluate included,
 *
 *     |value - exact| <= 1.001 e (p M + K_p R)     K_p = 3^(p-1) (25p - 27) + 11 2^p - p - 1
 *     |slope - exact| <= 1.001 e L_p R / h         L_p = 2p 3^(p-2) (25p - 31) + 11 p 2^p
 *
 *     p      1     2     3     4      5
 *     K_p   18   110   516  2142   8284
 *     L_p   18   164  1056  5672  27140
 *
 * Proof. Every knot difference that is divided by covers the span, so it is at least h, and the
 * control points of the k-th derivative are at most p!/(p-k)! 2^k R / h^k. Each level adds four
 * roundings of that size (two subtractions, a product, a quotient); each of the p-k-1 rounds of
 * de Boor at most eleven (quotient 3, difference and product 2, on 2R; the sum 1); k! one. With
 * q = p - k, coefficient k is off by (4k + 11 max(q-1, 0) + 1) e C(p,k) 2^k R / h^k, and Horner
 * adds 3k + 1 (ppoly.c). Sum over k at u = h; k = 0 has p roundings on M and 10 (p-1) on R.
 *
 * R, not M: a smooth curve on a large offset loses nothing, and the 3^p is paid only where
 * neighbouring control points alternate. Underflow adds less than 2^-15 in the unit of the control
 * points for spans up to CB_PPOLY_MAX_SPAN, and nothing that matters for spans below 10^4. */
#include "models/bspline.h"

#include "models/num.h"

static uint32_t knot_count(const struct cb_bspline *spline) {
    return (uint32_t)spline->count + spline->degree + 1u;
}

/* in : index < knot_count; all knots before it are valid
 * out: the fault of knots[index], CB_BSPLINE_OK if none */
static enum cb_bspline_fault check_knot(const struct cb_bspline *spline, uint32_t index) {
    const float *knots = spline->knots;
    const uint32_t p = spline->degree;
    if (!cb_is_finite(knots[index])) return CB_BSPLINE_KNOT;
    if (index == 0) return CB_BSPLINE_OK;
    if (knots[index] < knots[index - 1]) return CB_BSPLINE_ORDER;
    if (index == spline->count && knots[index] == knots[p]) return CB_BSPLINE_EMPTY;
    if (index > p && knots[index] == knots[index - p - 1]) return CB_BSPLINE_MULTIPLICITY;
    if (!(knots[index] - knots[index - 1] <= CB_PPOLY_MAX_SPAN)) return CB_BSPLINE_WIDE;
    return CB_BSPLINE_OK;
}

enum cb_bspline_fault cb_bspline_check(const struct cb_bspline *spline, uint16_t *at) {
    *at = 0;
    if (spline->degree < 1 || spline->degree > CB_BSPLINE_MAX_DEGREE) return CB_BSPLINE_DEGREE;
    if (spline->count < spline->degree + 1) return CB_BSPLINE_COUNT;
    for (uint32_t i = 0; i < knot_count(spline); ++i) {
        const enum cb_bspline_fault fault = check_knot(spline, i);
        *at = (uint16_t)i;
        if (fault != CB_BSPLINE_OK) return fault;
    }
    for (uint16_t i = 0; i < spline->count; ++i) {
        *at = i;
        if (!cb_is_finite(spline->control_points[i])) return CB_BSPLINE_VALUE;
    }
    *at = 0;
    return CB_BSPLINE_OK;
}

uint16_t cb_bspline_spans(const struct cb_bspline *spline) {
    uint16_t spans = 0;
    for (uint32_t m = spline->degree; m < spline->count; ++m) {
        if (spline->knots[m] < spline->knots[m + 1]) ++spans;
    }
    return spans;
}

/* in : t points at the span's left knot (t[1-q] … t[q] are used), points[q+1] active control points
 *      of a spline of degree q
 * out: its value at t[0]; the last point does not contribute */
static float value_at_left_end(const float *t, const float *points, int q) {
    float d[CB_BSPLINE_MAX_DEGREE + 1];
    for (int j = 0; j <= q; ++j) d[j] = points[j];
    for (int r = 1; r < q; ++r) {
        for (int j = q - 1; j >= r; --j) {
            const float alpha = (t[0] - t[j - q]) / (t[j - r + 1] - t[j - q]);
            d[j] = d[j - 1] + alpha * (d[j] - d[j - 1]);
        }
    }
    return q > 0 ? d[q - 1] : d[0];
}

/* in : t as above, points[q+1] of a spline of degree q >= 1
 * out: points[0 … q-1] of its derivative, which has degree q-1 */
static void differentiate(const float *t, float *points, int q) {
    for (int j = 0; j < q; ++j) {
        const float width = t[j + 1] - t[j + 1 - q];
        points[j] = (points[j + 1] - points[j]) * (float)q / width;
    }
}

/* in : t points at the span's left knot, active[p+1] its control points
 * out: a[p+1], ascending powers of x - t[0] */
static void convert_span(const float *t, const float *active, int p, float *a) {
    float points[CB_BSPLINE_MAX_DEGREE + 1];
    float factorial = 1.0f;
    for (int j = 0; j <= p; ++j) points[j] = active[j];
    a[0] = value_at_left_end(t, points, p);
    for (int k = 1; k <= p; ++k) {
        differentiate(t, points, p - k + 1);
        factorial *= (float)k;
        a[k] = value_at_left_end(t, points, p - k) / factorial;
    }
}

void cb_bspline_to_ppoly(const struct cb_bspline *spline, float *breaks, float *coefficients,
                         struct cb_ppoly *curve) {
    const uint32_t p = spline->degree;
    uint16_t spans = 0;
    for (uint32_t m = p; m < spline->count; ++m) {
        const float *t = spline->knots + m;
        if (!(t[0] < t[1])) continue;
        breaks[spans] = t[0];
        convert_span(t, spline->control_points + (m - p), (int)p, coefficients + spans * (p + 1));
        ++spans;
    }
    breaks[spans] = spline->knots[spline->count];
    curve->breaks = breaks;
    curve->coefficients = coefficients;
    curve->spans = spans;
    curve->degree = spline->degree;
    cb_ppoly_index(curve);
}
