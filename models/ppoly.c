/* SPDX-License-Identifier: MIT
 *
 * Rounding. With e = 2^-24 and the curve's own coefficients a_k taken as exact, for u in the span
 *
 *     |value - sum a_k u^k|           <= 1.001 e sum (3k + 1) |a_k| u^k
 *     |slope - sum k a_k u^(k-1)|     <= 1.001 e sum k (3k + 1) |a_k| u^(k-1)
 *
 * Horner's scheme touches a_k at most 2k + 1 times, and u = x - break carries one rounding of its
 * own, which enters k times. */
#include "models/ppoly.h"

#include "models/num.h"

/* in : spans_per_unit > 0, x inside the breaks
 * out: the span that holds x
 * The guess is a monotone function of x (one rounded subtraction, one rounded product).
 * cb_ppoly_index has checked that it lies in (i - 1, i + 1) at break i. Between the breaks i and i
 * + 1 it therefore lies in (i - 1, i + 2), and its integer part is off by at most one. */
static inline uint32_t computed_span(const struct cb_ppoly *curve, float x) {
    const uint32_t last = curve->spans - 1u;
    const float guess = (x - curve->breaks[0]) * curve->spans_per_unit;
    const uint32_t span = guess < (float)last ? (uint32_t)guess : last;
    const uint32_t below = x < curve->breaks[span];
    const uint32_t above = (x >= curve->breaks[span + 1]) & (span < last);
    return span - below + above;
}

/* in : x inside the breaks
 * out: the span that holds x, by bisection
 * The loop selects instead of branching, because for random x a processor mispredicts half of such
 * branches. The number of steps depends on the curve alone. */
static inline uint32_t searched_span(const struct cb_ppoly *curve, float x) {
    const float *at = curve->breaks;
    for (uint32_t left = curve->spans; left > 1;) {
        const uint32_t half = left / 2;
        at = x >= at[half] ? at + half : at;
        left -= half;
    }
    return (uint32_t)(at - curve->breaks);
}

static inline uint32_t find_span(const struct cb_ppoly *curve, float x) {
    return curve->spans_per_unit > 0.0f ? computed_span(curve, x) : searched_span(curve, x);
}

float cb_ppoly_horner_any(const float *a, uint8_t degree, float u) {
    const float *at = a + degree;
    float value = *at;
    while (at != a) value = value * u + *--at;
    return value;
}

struct cb_curve_value cb_ppoly_evaluate(const struct cb_ppoly *curve, float x) {
    const float inside = cb_clamp(x, curve->breaks[0], curve->breaks[curve->spans]);
    const uint32_t span = find_span(curve, inside);
    const float u = inside - curve->breaks[span];
    const float *a = curve->coefficients + span * (curve->degree + 1u);
    float value = a[curve->degree];
    float slope = 0.0f;
    for (int k = curve->degree - 1; k >= 0; --k) {
        slope = slope * u + value;
        value = value * u + a[k];
    }
    const bool outside = !(inside == x);
    const struct cb_curve_value result = {value, outside ? 0.0f : slope, outside};
    return result;
}

/* in : x inside the breaks; from: the previous span, any number
 * out: the span that holds x, usually a neighbour of `from` */
static inline uint32_t span_from(const struct cb_ppoly *curve, float x, uint16_t from) {
    const bool up = from < curve->spans && x >= curve->breaks[from + 1];
    const uint16_t beside = (uint16_t)(up ? from + 1u : from - 1u);
    return cb_ppoly_holds(curve, x, beside) ? beside : find_span(curve, x);
}

bool cb_ppoly_follow(const struct cb_ppoly *curve, float x, uint16_t *span) {
    if (!(x > curve->breaks[0] && x < curve->breaks[curve->spans])) return false;
    *span = (uint16_t)span_from(curve, x, *span);
    return true;
}

struct cb_curve_value cb_ppoly_elsewhere(const struct cb_ppoly *curve, float x, uint16_t *span) {
    const float inside = cb_clamp(x, curve->breaks[0], curve->breaks[curve->spans]);
    const uint32_t here = span_from(curve, inside, *span);
    *span = (uint16_t)here;
    return (struct cb_curve_value){cb_ppoly_value_in(curve, inside, here), 0.0f, inside != x};
}

void cb_ppoly_index(struct cb_ppoly *curve) {
    const float length = curve->breaks[curve->spans] - curve->breaks[0];
    const float per_unit = (float)curve->spans / length;
    curve->spans_per_unit = 0.0f;
    for (uint16_t i = 0; i <= curve->spans; ++i) {
        const float off = (curve->breaks[i] - curve->breaks[0]) * per_unit - (float)i;
        if (!(cb_abs(off) < 1.0f)) return;
    }
    curve->spans_per_unit = per_unit;
}

/* Horner's scheme over |a_k| at the span's full width: rounding is monotone, so no step of an
 * evaluation in the span exceeds the same step here. */
bool cb_ppoly_is_finite(const struct cb_ppoly *curve) {
    const float *a = curve->coefficients;
    for (uint16_t span = 0; span < curve->spans; ++span, a += curve->degree + 1) {
        const float width = curve->breaks[span + 1] - curve->breaks[span];
        float value = cb_abs(a[curve->degree]);
        float slope = 0.0f;
        for (int k = curve->degree - 1; k >= 0; --k) {
            slope = slope * width + value;
            value = value * width + cb_abs(a[k]);
        }
        if (!cb_is_finite(value) || !cb_is_finite(slope)) return false;
    }
    return true;
}
