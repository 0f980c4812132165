/* SPDX-License-Identifier: MIT */
#include "firmware/terms/curves.h"

#include "firmware/terms/kinds.h"
#include "firmware/terms/load.h"
#include "models/bspline.h"
#include "models/num.h"

enum { DEGREE = CB_CURVE_KEYS, KNOTS, CONTROL_POINTS, BSPLINE_KEYS };
static const struct cb_field BSPLINE_FIELDS[BSPLINE_KEYS] = {
    CB_CURVE_FIELDS,
    [DEGREE] = {"degree", CB_FIELD_UINT8, true, CB_CURVE_AT(degree), .least = "1", .most = "5"},
    [KNOTS] = {"knots", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CONTROL_POINTS] = {"control_points", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};
const struct cb_object cb_bspline_object = {BSPLINE_FIELDS, BSPLINE_KEYS};
const struct cb_object cb_bspline_backward_object = {BSPLINE_FIELDS + CB_CURVE_KEYS,
                                                     BSPLINE_KEYS - CB_CURVE_KEYS};

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
    return cb_keep_ppoly(loader, slots[KNOTS], &ppoly, curve);
}

/* ---- kinds that are no values yet ---- */

static const struct cb_curve_kind BSPLINE = {
    {BSPLINE_FIELDS + CB_CURVE_KEYS, BSPLINE_KEYS - CB_CURVE_KEYS},
    true,
    load_bspline,
    cb_piecewise_at};
extern const struct cb_curve_kind cb_polynomial_curve;

static const struct cb_curve_kind *kind_of(const struct cb_term_config *term) {
    if (cb_term_kinds[term->type]) return cb_term_kinds[term->type]->curve;
    if (term->type == CB_TERM_BSPLINE) return &BSPLINE;
    return term->type == CB_TERM_POLYNOMIAL ? &cb_polynomial_curve : 0;
}

/* ---- branches ---- */

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
                          const struct cb_curve_kind *kind, struct cb_curve_config *curve) {
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
    if (!cb_read_object(loader, slots[CB_CURVE_BACKWARD], &kind->backward, branch,
                        own + CB_CURVE_KEYS))
        return false;
    curve->backward = config->branches_count++;
    return kind->load(loader, slots[CB_CURVE_BACKWARD], own, branch);
}

/* The direction is that of the reading itself: looking ahead turns round before the axis does. */
static struct cb_curve_value with_branch(const struct cb_evaluation *e,
                                         const struct cb_term_config *term,
                                         struct cb_term_state *state,
                                         struct cb_curve_value forward) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!state->directed) cb_direction_start(&state->direction, signal->value, curve->reversal_mm);
    state->directed = true;
    cb_direction_step(&state->direction, signal->value, curve->reversal_mm);
    uint16_t span = state->span;
    const struct cb_curve_value backward =
        kind_of(term)->at(e->config, &e->config->branches[curve->backward], signal->used, &span);
    return cb_direction_blend(&state->direction, curve->reversal_mm, forward, backward);
}

bool cb_term_has_branches(const struct cb_term_config *term) {
    return kind_of(term) && term->as.curve.reversal_mm > 0.0f;
}

/* ---- as terms ---- */

bool cb_curve_load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   struct cb_term_config *term) {
    const struct cb_curve_kind *kind = kind_of(term);
    struct cb_curve_config *curve = &term->as.curve;
    return cb_read_signal(loader, slots[CB_CURVE_SIGNAL], &curve->signal) &&
           kind->load(loader, at, slots, curve) && load_backward(loader, at, slots, kind, curve);
}

uint8_t cb_curve_evaluate(const struct cb_evaluation *e, const struct cb_term_config *term,
                          struct cb_term_state *state, float *value) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!signal->fresh) return CB_TERM_MISSING;
    struct cb_curve_value result = kind_of(term)->at(e->config, curve, signal->used, &state->span);
    if (curve->reversal_mm > 0.0f) result = with_branch(e, term, state, result);
    value[0] = result.value;
    return result.outside ? CB_TERM_OUTSIDE : 0;
}

void cb_curve_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                    const struct cb_term_state *state, float *slope) {
    const struct cb_curve_kind *kind = kind_of(term);
    const struct cb_config *config = pass->e.config;
    const struct cb_curve_config *curve = &term->as.curve;
    const float x = pass->e.signals[curve->signal].used;
    if (curve->signal != pass->signal) return;
    struct cb_curve_value result = kind->at(config, curve, x, 0);
    if (curve->reversal_mm > 0.0f)
        result = cb_direction_blend(&state->direction, curve->reversal_mm, result,
                                    kind->at(config, &config->branches[curve->backward], x, 0));
    slope[0] = result.slope;
}

/* ---- pieces ---- */

/* span: where it was last found; NULL: the slope too */
struct cb_curve_value cb_piecewise_at(const struct cb_config *config,
                                      const struct cb_curve_config *curve, float x,
                                      uint16_t *span) {
    const float *breaks = config->pool + curve->pool;
    const struct cb_ppoly ppoly = {.breaks = breaks,
                                   .coefficients = breaks + curve->spans + 1,
                                   .spans_per_unit = curve->spans_per_unit,
                                   .spans = curve->spans,
                                   .degree = curve->degree};
    return span ? cb_ppoly_near(&ppoly, x, span) : cb_ppoly_evaluate(&ppoly, x);
}

bool cb_keep_ppoly(struct cb_loader *loader, uint32_t at, const struct cb_ppoly *ppoly,
                   struct cb_curve_config *curve) {
    curve->degree = ppoly->degree;
    curve->spans = ppoly->spans;
    curve->spans_per_unit = ppoly->spans_per_unit;
    if (cb_ppoly_is_finite(ppoly)) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "some stand too close together for values of this size: the curve overflows");
}
