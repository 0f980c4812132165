/* SPDX-License-Identifier: MIT */
#include "firmware/terms/curves.h"

#include "firmware/terms/kinds.h"
#include "firmware/terms/load.h"
#include "models/num.h"

/* ---- branches ---- */

/* in : a curve with at least one of the keys backward and reversal_mm
 * out: true if it has both, and its signal is a position in mm that float32 resolves to a fraction
 *      of reversal_mm */
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
                   "%o is less than a millionth of the furthest position of %s, which is about "
                   "what float32 resolves",
                   slots[CB_CURVE_REVERSAL], signal->name);
}

/* Loads the branch for a falling position, if there is one. Its keys are the curve's own keys.
 * out: curve->backward, index of the branch; or false and a message */
static bool load_backward(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                          const struct cb_term_kind *kind, struct cb_curve_config *curve) {
    const struct cb_object keys = {kind->object.fields + CB_CURVE_KEYS,
                                   (uint8_t)(kind->object.count - CB_CURVE_KEYS)};
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
    if (!cb_read_object(loader, slots[CB_CURVE_BACKWARD], &keys, branch, own + CB_CURVE_KEYS))
        return false;
    curve->backward = config->branches_count++;
    return kind->curve->load(loader, slots[CB_CURVE_BACKWARD], own, branch);
}

bool cb_term_has_branches(const struct cb_term_config *term) {
    return cb_term_kinds[term->type]->curve && term->as.curve.reversal_mm > 0.0f;
}

/* ---- as terms ---- */

bool cb_curve_load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   struct cb_term_config *term) {
    const struct cb_term_kind *kind = cb_term_kinds[term->type];
    struct cb_curve_config *curve = &term->as.curve;
    return cb_read_signal(loader, slots[CB_CURVE_SIGNAL], &curve->signal) &&
           kind->curve->load(loader, at, slots, curve) &&
           load_backward(loader, at, slots, kind, curve);
}

/* ---- pieces ---- */

/* in : span of the last x, or NULL to compute the slope too */
static struct cb_curve_value value_at(const struct cb_config *config,
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

uint8_t cb_piecewise_value(const struct cb_evaluation *e, const struct cb_term_config *term,
                           struct cb_term_state *state, float *value) {
    return cb_curve_value(e, term, state, value, value_at);
}

void cb_piecewise_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                        float *slope) {
    cb_curve_slope(pass, term, slope, value_at);
}

bool cb_keep_ppoly(struct cb_loader *loader, uint32_t at, const struct cb_ppoly *ppoly,
                   struct cb_curve_config *curve) {
    curve->degree = ppoly->degree;
    curve->spans = ppoly->spans;
    curve->spans_per_unit = ppoly->spans_per_unit;
    if (cb_ppoly_is_finite(ppoly)) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "some are too close together for values of this size: the curve overflows");
}
