/* SPDX-License-Identifier: MIT
 * Shared by the kinds of curves of one signal: a branch for each direction, and pieces. */
#ifndef COMPBOX_FIRMWARE_TERMS_CURVES_H
#define COMPBOX_FIRMWARE_TERMS_CURVES_H

#include <stddef.h>

#include "firmware/terms/kind.h"
#include "models/ppoly.h"

#define CB_CURVE_AT(member) .offset = offsetof(struct cb_curve_config, member)

/* First slots and fields of every curve as a term. The curve's own keys follow; they alone are the
 * keys of its branch backward. */
enum { CB_CURVE_SIGNAL = CB_TERM_COMMON_KEYS, CB_CURVE_BACKWARD, CB_CURVE_REVERSAL, CB_CURVE_KEYS };
#define CB_CURVE_FIELDS                                                                           \
    CB_TERM_COMMON_FIELDS, [CB_CURVE_SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},  \
                           [CB_CURVE_BACKWARD] = {"backward", CB_FIELD_OBJECT, false,             \
                                                  CB_NOT_STORED},                                 \
                           [CB_CURVE_REVERSAL] = {                                                \
                               "reversal_mm",    CB_FIELD_FLOAT, false, CB_CURVE_AT(reversal_mm), \
                               .least = "0.001", .most = "1000"}

/* What a kind of curve has in addition to struct cb_term_kind. */
struct cb_curve_kind {
    bool piecewise; /* a cb_ppoly: curves on the same breaks are evaluated together */
    /* Reads the curve's own keys from their slots into the pool and *curve. */
    bool (*load)(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_curve_config *curve);
};

/* `load` of every term that is a curve. */
bool cb_curve_load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   struct cb_term_config *term);

/* `value` and `slope` of a curve that is a cb_ppoly. */
uint8_t cb_piecewise_value(const struct cb_evaluation *e, const struct cb_term_config *term,
                           struct cb_term_state *state, float *value);
void cb_piecewise_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                        float *slope);

/* in : *ppoly, its numbers already in the pool at curve->pool
 * out: its description in *curve; false and a message at `at` if the curve overflows */
bool cb_keep_ppoly(struct cb_loader *loader, uint32_t at, const struct cb_ppoly *ppoly,
                   struct cb_curve_config *curve);

/* ---- value and slope of any curve, given its value at x ---- */

/* in : span of the last x, or NULL
 * out: value at x, and its slope if span is NULL; *span of this x otherwise */
typedef struct cb_curve_value cb_curve_at(const struct cb_config *config,
                                          const struct cb_curve_config *curve, float x,
                                          uint16_t *span);

/* Direction comes from the raw reading, because the extrapolated position reverses before the axis
 * does. */
CB_INLINE struct cb_curve_value cb_with_branch(const struct cb_evaluation *e,
                                               const struct cb_term_config *term,
                                               struct cb_term_state *state,
                                               struct cb_curve_value forward, cb_curve_at *at) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!state->directed) cb_direction_start(&state->direction, signal->value, curve->reversal_mm);
    state->directed = true;
    cb_direction_step(&state->direction, signal->value, curve->reversal_mm);
    uint16_t span = state->span;
    const struct cb_curve_value backward =
        at(e->config, &e->config->branches[curve->backward], signal->used, &span);
    return cb_direction_blend(&state->direction, curve->reversal_mm, forward, backward);
}

CB_INLINE uint8_t cb_curve_value(const struct cb_evaluation *e, const struct cb_term_config *term,
                                 struct cb_term_state *state, float *value, cb_curve_at *at) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!signal->fresh) return CB_TERM_MISSING;
    struct cb_curve_value result = at(e->config, curve, signal->used, &state->span);
    if (curve->reversal_mm > 0.0f) result = cb_with_branch(e, term, state, result, at);
    value[0] = result.value;
    return result.outside ? CB_TERM_OUTSIDE : 0;
}

CB_INLINE void cb_curve_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                              float *slope, cb_curve_at *at) {
    const struct cb_config *config = pass->e.config;
    const struct cb_curve_config *curve = &term->as.curve;
    const uint8_t index = config->output_terms[term->first_output];
    const float x = pass->e.signals[curve->signal].used;
    if (curve->signal != pass->signal) return;
    struct cb_curve_value result = at(config, curve, x, 0);
    if (curve->reversal_mm > 0.0f)
        result = cb_direction_blend(&pass->e.states[index].direction, curve->reversal_mm, result,
                                    at(config, &config->branches[curve->backward], x, 0));
    slope[0] = result.slope;
}

#endif
