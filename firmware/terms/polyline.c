/* SPDX-License-Identifier: MIT
 * Terms of type polyline: straight lines between positions (models/polyline.h). */
#include "models/polyline.h"

#include "firmware/terms/curves.h"
#include "firmware/terms/load.h"

enum { POSITIONS = CB_CURVE_KEYS, VALUES, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    CB_CURVE_FIELDS,
    [POSITIONS] = {"positions", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [VALUES] = {"values", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};

/* out: *count positions in scratch->knots, strictly rising, and as many values in scratch->values;
 *      or false and a message */
static bool read_lines(struct cb_loader *loader, const uint32_t *slots, uint32_t *count) {
    struct cb_load_scratch *scratch = loader->scratch;
    uint32_t values = 0;
    if (!cb_read_numbers(loader, slots[POSITIONS], scratch->knots, CB_MAX_CURVE_POINTS, count))
        return false;
    if (!cb_read_numbers(loader, slots[VALUES], scratch->values, CB_MAX_CURVE_POINTS, &values))
        return false;
    if (*count < 2)
        return cb_fail(loader, CB_ERROR_RANGE, slots[POSITIONS],
                       "a polyline has at least 2 positions");
    if (values != *count)
        return cb_fail(loader, CB_ERROR_RANGE, slots[VALUES],
                       "%u values for %u positions; each position needs one", values, *count);
    for (uint32_t i = 1; i < *count; ++i) {
        if (scratch->knots[i] > scratch->knots[i - 1]) continue;
        const uint32_t at = cb_list_at(loader, slots[POSITIONS], i);
        return cb_fail(loader, CB_ERROR_ORDER, at,
                       "%o is not above the position before it (%o); the box keeps 24 bits, "
                       "about 7 digits",
                       at, cb_list_at(loader, slots[POSITIONS], i - 1));
    }
    return true;
}

static bool load_curve(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                       struct cb_curve_config *curve) {
    const struct cb_load_scratch *scratch = loader->scratch;
    struct cb_ppoly ppoly;
    uint32_t count = 0;
    if (!read_lines(loader, slots, &count)) return false;
    if (!cb_take_pool(loader, at, count + 2 * (count - 1), &curve->pool)) return false;
    float *pool = loader->config->pool + curve->pool;
    cb_polyline_to_ppoly(scratch->knots, scratch->values, (uint16_t)count, pool, pool + count,
                         &ppoly);
    return cb_keep_ppoly(loader, slots[POSITIONS], &ppoly, curve);
}

const struct cb_term_kind cb_term_polyline = {
    .object = {FIELDS, KEYS},
    .curve = &(const struct cb_curve_kind){.piecewise = true, .load = load_curve},
    .signals = CB_TERM_LIST(as.curve.signal),
    .load = cb_curve_load,
    .value = cb_piecewise_value,
    .slope = cb_piecewise_slope,
};
