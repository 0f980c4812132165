/* SPDX-License-Identifier: MIT
 * Terms of type bspline. The loader turns one into polynomial pieces (models/bspline.h). */
#include "models/bspline.h"

#include "firmware/terms/curves.h"
#include "firmware/terms/load.h"

enum { DEGREE = CB_CURVE_KEYS, KNOTS, CONTROL_POINTS, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    CB_CURVE_FIELDS,
    [DEGREE] = {"degree", CB_FIELD_UINT8, true, CB_CURVE_AT(degree), .least = "1", .most = "5"},
    [KNOTS] = {"knots", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CONTROL_POINTS] = {"control_points", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};

/* in : result of cb_bspline_check(), with the index of the wrong knot
 * out: true for CB_BSPLINE_OK; else false and a message */
static bool report(struct cb_loader *loader, const uint32_t *slots, enum cb_bspline_fault fault,
                   uint16_t index) {
    const uint32_t knots = slots[KNOTS], points = slots[CONTROL_POINTS];
    const uint32_t knot = cb_list_at(loader, knots, index);
    const uint32_t before = cb_list_at(loader, knots, index > 0 ? index - 1u : 0u);
    switch (fault) {
        case CB_BSPLINE_OK:
            return true;
        case CB_BSPLINE_DEGREE:
            return cb_fail(loader, CB_ERROR_RANGE, slots[DEGREE], "%o is not a degree from 1 to 5",
                           slots[DEGREE]);
        case CB_BSPLINE_COUNT:
            return cb_fail(loader, CB_ERROR_RANGE, points,
                           "a B-spline has at least degree + 1 control points, and degree is %o",
                           slots[DEGREE]);
        case CB_BSPLINE_KNOT:
        case CB_BSPLINE_VALUE:
            return cb_fail(loader, CB_ERROR_RANGE, points, "all numbers must be finite");
        case CB_BSPLINE_ORDER:
            return cb_fail(loader, CB_ERROR_ORDER, knot, "%o is below the knot before it (%o)",
                           knot, before);
        case CB_BSPLINE_MULTIPLICITY:
            return cb_fail(loader, CB_ERROR_ORDER, knot,
                           "%o occurs more than degree + 1 times, and degree is %o", knot,
                           slots[DEGREE]);
        case CB_BSPLINE_EMPTY:
            return cb_fail(loader, CB_ERROR_ORDER, knot,
                           "the curve begins and ends at %o: the inner knots span nothing", knot);
        case CB_BSPLINE_WIDE:
            return cb_fail(loader, CB_ERROR_RANGE, knot,
                           "%o is more than 16777216 above the knot before it (%o)", knot, before);
    }
    return false;
}

/* out: *spline, checked, over numbers of the scratch; or false and a message */
static bool read_spline(struct cb_loader *loader, const uint32_t *slots, uint8_t degree,
                        struct cb_bspline *spline) {
    struct cb_load_scratch *scratch = loader->scratch;
    uint32_t points = 0, knots = 0;
    uint16_t index = 0;
    if (!cb_read_numbers(loader, slots[CONTROL_POINTS], scratch->values, CB_MAX_CURVE_POINTS,
                         &points))
        return false;
    if (!cb_read_numbers(loader, slots[KNOTS], scratch->knots,
                         CB_MAX_CURVE_POINTS + CB_BSPLINE_MAX_DEGREE + 1, &knots))
        return false;
    *spline = (struct cb_bspline){scratch->knots, scratch->values, (uint16_t)points, degree};
    if (points > degree && knots != points + degree + 1u)
        return cb_fail(loader, CB_ERROR_RANGE, slots[KNOTS],
                       "%u knots; %u control points of degree %u need %u (the sum plus 1)", knots,
                       points, (uint32_t)degree, points + degree + 1u);
    const enum cb_bspline_fault fault = cb_bspline_check(spline, &index);
    return report(loader, slots, fault, index);
}

static bool load_curve(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                       struct cb_curve_config *curve) {
    struct cb_bspline spline;
    struct cb_ppoly ppoly;
    if (!read_spline(loader, slots, curve->degree, &spline)) return false;
    const uint32_t spans = cb_bspline_spans(&spline);
    const uint32_t breaks = spans + 1;
    if (!cb_take_pool(loader, at, breaks + spans * (spline.degree + 1u), &curve->pool))
        return false;
    float *pool = loader->config->pool + curve->pool;
    cb_bspline_to_ppoly(&spline, pool, pool + breaks, &ppoly);
    return cb_keep_ppoly(loader, slots[KNOTS], &ppoly, curve);
}

const struct cb_term_kind cb_term_bspline = {
    .object = {FIELDS, KEYS},
    .curve = &(const struct cb_curve_kind){.piecewise = true, .load = load_curve},
    .signals = CB_TERM_LIST(as.curve.signal),
    .load = cb_curve_load,
    .value = cb_piecewise_value,
    .slope = cb_piecewise_slope,
};
