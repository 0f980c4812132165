/* SPDX-License-Identifier: MIT
 * Terms of type polynomial: a curve of one signal, evaluated with the file's coefficients. */
#include "models/polynomial.h"

#include <string.h>

#include "firmware/terms/curves.h"
#include "firmware/terms/load.h"
#include "models/num.h"

/* half_range is stored in inverse_half_range; load_curve() inverts it. */
enum { COEFFICIENTS = CB_CURVE_KEYS, CENTER, HALF_RANGE, FROM, TO, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    CB_CURVE_FIELDS,
    [COEFFICIENTS] = {"coefficients", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CENTER] = {"center", CB_FIELD_FLOAT, false, CB_CURVE_AT(center), .least = CB_LEAST_NUMBER,
                .most = CB_MOST_NUMBER, .otherwise = "0"},
    [HALF_RANGE] = {"half_range", CB_FIELD_FLOAT, false, CB_CURVE_AT(inverse_half_range),
                    .least = "0.000001", .most = CB_MOST_NUMBER, .otherwise = "1"},
    [FROM] = {"from", CB_FIELD_FLOAT, false, CB_CURVE_AT(from), .least = CB_LEAST_NUMBER,
              .most = CB_MOST_NUMBER},
    [TO] = {"to", CB_FIELD_FLOAT, false, CB_CURVE_AT(to), .least = CB_LEAST_NUMBER,
            .most = CB_MOST_NUMBER},
};

/* out: sum of |a_k u^k| at the larger |u|, which bounds every step of the evaluation */
static float largest_sum(const struct cb_polynomial *polynomial) {
    const float below = cb_abs(polynomial->from - polynomial->center);
    const float above = cb_abs(polynomial->to - polynomial->center);
    const float u = cb_max(below, above) * polynomial->inverse_half_range;
    float sum = 0.0f;
    for (int k = polynomial->degree; k >= 0; --k)
        sum = sum * u + cb_abs(polynomial->coefficients[k]);
    return sum;
}

static struct cb_polynomial polynomial_of(const struct cb_config *config,
                                          const struct cb_curve_config *curve) {
    return (struct cb_polynomial){.coefficients = config->pool + curve->pool,
                                  .center = curve->center,
                                  .inverse_half_range = curve->inverse_half_range,
                                  .from = curve->from,
                                  .to = curve->to,
                                  .degree = curve->degree};
}

static bool check(struct cb_loader *loader, uint32_t at, const struct cb_curve_config *curve) {
    const struct cb_polynomial polynomial = polynomial_of(loader->config, curve);
    if (cb_polynomial_is_finite(&polynomial) &&
        largest_sum(&polynomial) <= cb_number_of(CB_MOST_NUMBER))
        return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "between from and to its terms exceed 1e9 µm; are center and half_range those "
                   "of the fit?");
}

/* out: curve->from < curve->to: of the file, else min and max of the signal */
static bool set_range(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                      struct cb_curve_config *curve) {
    const struct cb_signal_config *signal = &loader->config->signals[curve->signal];
    if (slots[FROM] == CB_ABSENT) curve->from = signal->min;
    if (slots[TO] == CB_ABSENT) curve->to = signal->max;
    if (curve->from < curve->to) return true;
    return cb_fail(loader, CB_ERROR_ORDER, at,
                   "from is not below to; absent ones are min and max of the signal %s",
                   signal->name);
}

/* in : as `load` of struct cb_curve_kind
 * out: coefficients in the pool, checked against overflow within from … to */
static bool load_curve(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                       struct cb_curve_config *curve) {
    float *coefficients = loader->scratch->values;
    uint32_t count = 0;
    if (!cb_read_numbers(loader, slots[COEFFICIENTS], coefficients, CB_POLYNOMIAL_MAX_DEGREE + 1,
                         &count))
        return false;
    if (count == 0)
        return cb_fail(loader, CB_ERROR_RANGE, slots[COEFFICIENTS],
                       "a polynomial has at least one coefficient");
    if (!set_range(loader, at, slots, curve)) return false;
    if (!cb_take_pool(loader, at, count, &curve->pool)) return false;
    memcpy(loader->config->pool + curve->pool, coefficients, count * sizeof *coefficients);
    curve->degree = (uint8_t)(count - 1);
    curve->spans = 1;
    curve->inverse_half_range = 1.0f / curve->inverse_half_range;
    return check(loader, slots[COEFFICIENTS], curve);
}

/* in : span, not used: a polynomial has one */
static struct cb_curve_value value_at(const struct cb_config *config,
                                      const struct cb_curve_config *curve, float x,
                                      uint16_t *span) {
    const struct cb_polynomial polynomial = polynomial_of(config, curve);
    (void)span;
    return cb_polynomial_evaluate(&polynomial, x);
}

static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    return cb_curve_value(e, term, state, value, value_at);
}

static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    cb_curve_slope(pass, term, slope, value_at);
}

const struct cb_term_kind cb_term_polynomial = {
    .object = {FIELDS, KEYS},
    .curve = &(const struct cb_curve_kind){.load = load_curve},
    .signals = CB_TERM_LIST(as.curve.signal),
    .load = cb_curve_load,
    .value = value,
    .slope = slope,
};
