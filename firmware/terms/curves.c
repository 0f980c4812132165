/* SPDX-License-Identifier: MIT
 * Terms that are curves of one signal, turned into the form in which they are evaluated. */
#include "firmware/terms/curves.h"

#include "firmware/terms/kinds.h"
#include "models/bspline.h"
#include "models/num.h"
#include "models/polyline.h"

enum { DEGREE = CB_CURVE_KEYS, KNOTS, CONTROL_POINTS, BSPLINE_KEYS };
static const struct cb_field BSPLINE_FIELDS[BSPLINE_KEYS] = {
    [CB_CURVE_NAME] = {"name", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_TYPE] = {"type", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_BACKWARD] = {"backward", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [CB_CURVE_REVERSAL] = CB_CURVE_REVERSAL_FIELD,
    [DEGREE] = {"degree", CB_FIELD_UINT8, true, CB_CURVE_AT(degree), .least = "1", .most = "5"},
    [KNOTS] = {"knots", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CONTROL_POINTS] = {"control_points", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};
const struct cb_object cb_bspline_object = {BSPLINE_FIELDS, BSPLINE_KEYS};
const struct cb_object cb_bspline_backward_object = {BSPLINE_FIELDS + CB_CURVE_KEYS,
                                                     BSPLINE_KEYS - CB_CURVE_KEYS};

enum { POSITIONS = CB_CURVE_KEYS, VALUES, POLYLINE_KEYS };
static const struct cb_field POLYLINE_FIELDS[POLYLINE_KEYS] = {
    [CB_CURVE_NAME] = {"name", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_TYPE] = {"type", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},
    [CB_CURVE_BACKWARD] = {"backward", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [CB_CURVE_REVERSAL] = CB_CURVE_REVERSAL_FIELD,
    [POSITIONS] = {"positions", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [VALUES] = {"values", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};
const struct cb_object cb_polyline_object = {POLYLINE_FIELDS, POLYLINE_KEYS};
const struct cb_object cb_polyline_backward_object = {POLYLINE_FIELDS + CB_CURVE_KEYS,
                                                      POLYLINE_KEYS - CB_CURVE_KEYS};

/* Notes the converted curve, unless it overflows somewhere. */
static bool keep_ppoly(struct cb_loader *loader, uint32_t at, const struct cb_ppoly *ppoly,
                       struct cb_curve_config *curve) {
    curve->degree = ppoly->degree;
    curve->spans = ppoly->spans;
    curve->spans_per_unit = ppoly->spans_per_unit;
    if (cb_ppoly_is_finite(ppoly)) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "some stand too close together for values of this size: the curve overflows");
}

/* ---- B-spline ---- */

/* What cb_bspline_check found, as a sentence. */
static bool bspline_fault(struct cb_loader *loader, const uint32_t *slots,
                          enum cb_bspline_fault fault, uint16_t index) {
    const uint32_t knots = slots[KNOTS], points = slots[CONTROL_POINTS];
    const uint32_t knot = cb_list_at(loader, knots, index);
    const uint32_t before = cb_list_at(loader, knots, index > 0 ? index - 1u : 0u);
    switch (fault) {
        case CB_BSPLINE_OK:
            return true;
        case CB_BSPLINE_DEGREE:
            return cb_fail(loader, CB_ERROR_RANGE, slots[DEGREE], "%v is no degree from 1 to 5",
                           slots[DEGREE]);
        case CB_BSPLINE_COUNT:
            return cb_fail(loader, CB_ERROR_RANGE, points,
                           "a B-spline has at least degree + 1 control points, and degree is %v",
                           slots[DEGREE]);
        case CB_BSPLINE_KNOT:
        case CB_BSPLINE_VALUE:
            return cb_fail(loader, CB_ERROR_RANGE, points, "all numbers must be finite");
        case CB_BSPLINE_ORDER:
            return cb_fail(loader, CB_ERROR_ORDER, knot, "%v is below the knot before it (%v)",
                           knot, before);
        case CB_BSPLINE_MULTIPLICITY:
            return cb_fail(loader, CB_ERROR_ORDER, knot,
                           "%v stands here more than degree + 1 times, and degree is %v", knot,
                           slots[DEGREE]);
        case CB_BSPLINE_EMPTY:
            return cb_fail(loader, CB_ERROR_ORDER, knot,
                           "the curve ends at %v where it begins: the inner knots span nothing",
                           knot);
        case CB_BSPLINE_WIDE:
            return cb_fail(loader, CB_ERROR_RANGE, knot,
                           "%v is more than 16777216 above the knot before it (%v)", knot, before);
    }
    return false;
}

static bool read_bspline(struct cb_loader *loader, const uint32_t *slots, uint8_t degree,
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
    return bspline_fault(loader, slots, fault, index);
}

static bool load_bspline(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                         struct cb_curve_config *curve) {
    struct cb_bspline spline;
    struct cb_ppoly ppoly;
    if (!read_bspline(loader, slots, curve->degree, &spline)) return false;
    const uint32_t spans = cb_bspline_spans(&spline);
    const uint32_t breaks = spans + 1;
    if (!cb_take_pool(loader, at, breaks + spans * (spline.degree + 1u), &curve->pool))
        return false;
    float *pool = loader->config->pool + curve->pool;
    cb_bspline_to_ppoly(&spline, pool, pool + breaks, &ppoly);
    return keep_ppoly(loader, slots[KNOTS], &ppoly, curve);
}

/* ---- polyline ---- */

static bool read_polyline(struct cb_loader *loader, const uint32_t *slots, uint32_t *count) {
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
                       "%v is not above the position before it (%v); the box keeps 24 bits, "
                       "about 7 digits",
                       at, cb_list_at(loader, slots[POSITIONS], i - 1));
    }
    return true;
}

static bool load_polyline(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                          struct cb_curve_config *curve) {
    const struct cb_load_scratch *scratch = loader->scratch;
    struct cb_ppoly ppoly;
    uint32_t count = 0;
    if (!read_polyline(loader, slots, &count)) return false;
    if (!cb_take_pool(loader, at, count + 2 * (count - 1), &curve->pool)) return false;
    float *pool = loader->config->pool + curve->pool;
    cb_polyline_to_ppoly(scratch->knots, scratch->values, (uint16_t)count, pool, pool + count,
                         &ppoly);
    return keep_ppoly(loader, slots[POSITIONS], &ppoly, curve);
}

/* ---- direction ---- */

/* Both keys or none; a position in mm that float32 resolves finely enough. */
static bool check_reversal(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                           const struct cb_curve_config *curve) {
    const struct cb_signal_config *signal = &loader->config->signals[curve->signal];
    const float furthest = cb_max(cb_abs(signal->min), cb_abs(signal->max));
    if (slots[CB_CURVE_REVERSAL] == CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, at, "backward needs the key reversal_mm too");
    if (slots[CB_CURVE_BACKWARD] == CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, slots[CB_CURVE_REVERSAL],
                       "this key is for curves with a branch backward");
    if (!cb_same_text(signal->unit, "mm"))
        return cb_fail(loader, CB_ERROR_NAME, slots[CB_CURVE_BACKWARD],
                       "a direction of travel needs a position in mm, and the unit of %s is %s",
                       signal->name, signal->unit);
    if (curve->reversal_mm >= 1e-6f * furthest) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[CB_CURVE_REVERSAL],
                   "%v is less than a millionth of the furthest position of %s, which is about "
                   "what float32 resolves",
                   slots[CB_CURVE_REVERSAL], signal->name);
}

/* The branch for positions that count down: the same keys as the curve's own, so it is read into
 * their slots. */
static bool load_backward(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                          const struct cb_object *object, cb_load_curve_fn *load,
                          struct cb_curve_config *curve) {
    struct cb_config *config = loader->config;
    uint32_t own[CB_MAX_FIELDS];
    if (slots[CB_CURVE_BACKWARD] == CB_ABSENT && slots[CB_CURVE_REVERSAL] == CB_ABSENT) return true;
    if (!check_reversal(loader, at, slots, curve)) return false;
    if (config->branches_count == CB_MAX_BRANCHES)
        return cb_fail(loader, CB_ERROR_FULL, slots[CB_CURVE_BACKWARD],
                       "the box has room for %u curves with a branch backward",
                       (uint32_t)CB_MAX_BRANCHES);
    struct cb_curve_config *branch = &config->branches[config->branches_count];
    branch->signal = curve->signal;
    if (!cb_read_object(loader, slots[CB_CURVE_BACKWARD], object, branch, own + CB_CURVE_KEYS))
        return false;
    curve->backward = config->branches_count++;
    return load(loader, slots[CB_CURVE_BACKWARD], own, branch);
}

/* ---- as terms ---- */

bool cb_load_curve(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   const struct cb_object *backward, cb_load_curve_fn *load,
                   struct cb_curve_config *curve) {
    return cb_read_signal(loader, slots[CB_CURVE_SIGNAL], &curve->signal) &&
           load(loader, at, slots, curve) &&
           load_backward(loader, at, slots, backward, load, curve);
}

bool cb_load_bspline(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                     struct cb_term_config *term) {
    return cb_load_curve(loader, at, slots, &cb_bspline_backward_object, load_bspline,
                         &term->as.curve);
}

bool cb_load_polyline(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                      struct cb_term_config *term) {
    return cb_load_curve(loader, at, slots, &cb_polyline_backward_object, load_polyline,
                         &term->as.curve);
}
