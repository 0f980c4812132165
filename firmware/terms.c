/* SPDX-License-Identifier: MIT */
#include "firmware/terms.h"

#include <stddef.h>
#include <string.h>

#include "models/bpnet.h"
#include "models/num.h"
#include "models/polynomial.h"
#include "models/ppoly.h"
#include "models/training_range.h"
#include "models/volumetric.h"

/* What a term says about its inputs; none of it: all is well. */
enum {
    MISSING = 1,      /* a signal or a term that it looks at is not there: nothing was computed */
    OUTSIDE = 2,      /* a curve is held at its end */
    EXTRAPOLATED = 4, /* a model has an input outside its training range */
    WEAKENED = 8,     /* … so far outside that its weight is below 1 */
};

/* What one step of all terms works with. */
struct evaluation {
    const struct cb_config *config;
    const struct cb_signal_state *signals;
    const float *outputs; /* of the terms before this one */
    const bool *live;     /* whether they are those of this step; indexed like outputs */
};

/* ---- curves ---- */

/* A B-spline or polyline, as the loader left it in the pool. */
CB_INLINE struct cb_ppoly ppoly_of(const struct cb_config *config,
                                   const struct cb_curve_config *curve) {
    const float *breaks = config->pool + curve->pool;
    return (struct cb_ppoly){.breaks = breaks,
                             .coefficients = breaks + curve->spans + 1,
                             .spans_per_unit = curve->spans_per_unit,
                             .spans = curve->spans,
                             .degree = curve->degree};
}

/* span: where it was last found. Without branches it is outside: is_plain() has looked. */
static struct cb_curve_value piecewise(const struct cb_config *config,
                                       const struct cb_curve_config *curve, float x,
                                       uint16_t *span) {
    const struct cb_ppoly ppoly = ppoly_of(config, curve);
    return curve->reversal_mm > 0.0f ? cb_ppoly_near(&ppoly, x, span)
                                     : cb_ppoly_elsewhere(&ppoly, x, span);
}

CB_OUTLINE struct cb_curve_value polynomial(const struct cb_config *config,
                                            const struct cb_curve_config *curve, float x) {
    const struct cb_polynomial one = {.coefficients = config->pool + curve->pool,
                                      .center = curve->center,
                                      .inverse_half_range = curve->inverse_half_range,
                                      .from = curve->from,
                                      .to = curve->to,
                                      .degree = curve->degree};
    return cb_polynomial_evaluate(&one, x);
}

/* in : type: that of the term, a curve */
static struct cb_curve_value one_curve(const struct cb_config *config, uint8_t type,
                                       const struct cb_curve_config *curve, float x,
                                       uint16_t *span) {
    return type == CB_TERM_POLYNOMIAL ? polynomial(config, curve, x)
                                      : piecewise(config, curve, x, span);
}

bool cb_term_has_branches(const struct cb_term_config *term) {
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            return term->as.curve.reversal_mm > 0.0f;
        case CB_TERM_LINEAR:
        case CB_TERM_PRODUCT:
        case CB_TERM_BPNET:
        case CB_TERM_VOLUMETRIC:
            break;
    }
    return false;
}

/* The direction is that of the reading itself: looking ahead turns round before the axis does. */
static struct cb_curve_value with_branch(const struct evaluation *e,
                                         const struct cb_term_config *term,
                                         struct cb_term_state *state,
                                         struct cb_curve_value forward) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!state->directed) cb_direction_start(&state->direction, signal->value, curve->reversal_mm);
    state->directed = true;
    cb_direction_step(&state->direction, signal->value, curve->reversal_mm);
    uint16_t span = state->span;
    const struct cb_curve_value backward = one_curve(
        e->config, term->type, &e->config->branches[curve->backward], signal->used, &span);
    return cb_direction_blend(&state->direction, curve->reversal_mm, forward, backward);
}

static uint8_t curve(const struct evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    const struct cb_curve_config *curve = &term->as.curve;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    if (!signal->fresh) return MISSING;
    struct cb_curve_value result = term->type == CB_TERM_POLYNOMIAL
                                       ? polynomial(e->config, curve, signal->used)
                                       : piecewise(e->config, curve, signal->used, &state->span);
    if (curve->reversal_mm > 0.0f) result = with_branch(e, term, state, result);
    value[0] = result.value;
    return result.outside ? OUTSIDE : 0;
}

/* The curve is made once more, so that is_plain() can keep its own in registers. */
CB_OUTLINE bool follow(const struct cb_config *config, const struct cb_curve_config *curve, float x,
                       uint16_t *span) {
    const struct cb_ppoly ppoly = ppoly_of(config, curve);
    return cb_ppoly_follow(&ppoly, x, span);
}

/* What most terms are in most steps: a B-spline or polyline, mostly in the span in which it was.
 * out: true and its value, finite; false: it is another term, or has to be looked at closely */
CB_INLINE bool is_plain(const struct evaluation *e, const struct cb_term_config *term,
                        struct cb_term_state *state, float *value) {
    const struct cb_curve_config *curve = &term->as.curve;
    if (term->type > CB_TERM_POLYLINE || curve->reversal_mm > 0.0f) return false;
    const struct cb_signal_state *signal = &e->signals[curve->signal];
    const struct cb_ppoly ppoly = ppoly_of(e->config, curve);
    if (!signal->fresh) return false;
    const float x = signal->used;
    uint16_t span = state->span;
    if (!cb_ppoly_holds(&ppoly, x, span)) {
        if (!follow(e->config, curve, x, &state->span)) return false;
        span = state->span;
    }
    *value = cb_ppoly_value_in(&ppoly, x, span);
    return cb_is_finite(*value);
}

/* ---- terms of several inputs ---- */

/* in : the signals config->links[link …]
 * out: x[count], as the terms see them; false when one of them is not fresh */
static bool gather(const struct evaluation *e, uint16_t link, unsigned count, float *x) {
    const uint8_t *links = e->config->links + link;
    bool fresh = true;
    for (unsigned i = 0; i < count; ++i) {
        const struct cb_signal_state *signal = &e->signals[links[i]];
        x[i] = signal->used;
        fresh &= signal->fresh;
    }
    return fresh;
}

/* Rounding: (inputs + 1) 2^-24 of the sum of the sizes of what is added. */
static uint8_t linear(const struct evaluation *e, const struct cb_linear_config *linear,
                      float *value) {
    const float *weights = e->config->pool + linear->pool;
    const uint8_t *links = e->config->links + linear->link;
    float sum = weights[linear->inputs];
    for (unsigned i = 0; i < linear->inputs; ++i) {
        const struct cb_signal_state *signal = &e->signals[links[i]];
        if (!signal->fresh) return MISSING;
        sum += weights[i] * signal->used;
    }
    value[0] = sum;
    return 0;
}

/* Rounding: 2^-23 of the product, beside that of the output that it takes. */
static uint8_t product(const struct evaluation *e, const struct cb_product_config *product,
                       float *value) {
    const struct cb_signal_state *signal = &e->signals[product->signal];
    if (!signal->fresh || !e->live[product->output]) return MISSING;
    value[0] = e->outputs[product->output] * (signal->used - product->origin);
    return 0;
}

/* Inputs held in the training range and its margin; outputs weakened beyond that. */
static uint8_t network(const struct evaluation *e, const struct cb_term_config *term,
                       float *value) {
    const struct cb_bpnet_config *config = &term->as.bpnet;
    const struct cb_bpnet net = {e->config->pool + config->weights, config->inputs, config->hidden,
                                 term->outputs, config->linear};
    float x[CB_BPNET_MAX_INPUTS];
    if (!gather(e, config->link, config->inputs, x)) return MISSING;
    const struct cb_training_verdict verdict = cb_training_range_hold(
        (const struct cb_training_range *)(const void *)(e->config->pool + config->ranges),
        config->inputs, x, x);
    cb_bpnet_evaluate(&net, x, value);
    for (unsigned k = 0; k < term->outputs; ++k) value[k] *= verdict.weight;
    if (verdict.weight < 1.0f) return EXTRAPOLATED | WEAKENED;
    return verdict.extrapolated > 0 ? EXTRAPOLATED : 0;
}

_Static_assert(sizeof(struct cb_training_range) == 4 * sizeof(float), "lies in the pool as floats");

/* What a volumetric term keeps in the pool, before its constant tool length. */
enum { FIXED_FLOATS = offsetof(struct cb_volumetric, moves) / sizeof(float) };

/* out: the machine at this moment; false when a position, an error or the tool is missing */
static bool machine(const struct evaluation *e, const struct cb_volumetric_config *config,
                    struct cb_volumetric_state *state) {
    bool there = true;
    state->tool_mm = e->config->pool[config->pool + FIXED_FLOATS];
    for (unsigned a = 0; a < CB_AXES; ++a) {
        const struct cb_signal_state *position = &e->signals[config->position[a]];
        state->position_mm[a] = position->used;
        there &= position->fresh;
    }
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k) {
        const uint8_t error = config->error[k];
        state->error[k] = error == CB_NONE ? 0.0f : e->outputs[error];
        there &= error == CB_NONE || e->live[error];
    }
    if (config->tool_length == CB_NONE) return there;
    state->tool_mm = e->signals[config->tool_length].used;
    return there && e->signals[config->tool_length].fresh;
}

static uint8_t volumetric(const struct evaluation *e, const struct cb_volumetric_config *config,
                          float *value) {
    const float *pool = e->config->pool + config->pool;
    struct cb_volumetric model;
    struct cb_volumetric_state state;
    if (!machine(e, config, &state)) return MISSING;
    memcpy(&model, pool, FIXED_FLOATS * sizeof *pool);
    memcpy(model.moves, config->moves, sizeof model.moves);
    cb_volumetric_evaluate(&model, &state, value);
    return 0;
}

/* out: value[term->outputs], and remarks on it */
static uint8_t compute(const struct evaluation *e, const struct cb_term_config *term,
                       struct cb_term_state *state, float *value) {
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            return curve(e, term, state, value);
        case CB_TERM_LINEAR:
            return linear(e, &term->as.linear, value);
        case CB_TERM_PRODUCT:
            return product(e, &term->as.product, value);
        case CB_TERM_BPNET:
            return network(e, term, value);
        case CB_TERM_VOLUMETRIC:
            return volumetric(e, &term->as.volumetric, value);
    }
    return MISSING;
}

/* ---- all terms ---- */

static inline bool all_finite(const float *value, unsigned count) {
    float nothing = value[0] - value[0]; /* NaN once a value is not finite */
    for (unsigned i = 1; i < count; ++i) nothing += value[i] - value[i];
    return nothing == 0.0f;
}

static void note(uint8_t remarks, struct cb_counters *counters, struct cb_terms_verdict *verdict) {
    counters->outside_curve += (remarks & OUTSIDE) != 0;
    counters->models_extrapolated += (remarks & EXTRAPOLATED) != 0;
    counters->models_weakened += (remarks & WEAKENED) != 0;
    verdict->extrapolated = verdict->extrapolated || (remarks & EXTRAPOLATED);
    verdict->degraded = verdict->degraded || (remarks & WEAKENED);
}

/* out: true and the new outputs in value[], or false: they could not be computed */
static bool refresh(const struct evaluation *e, const struct cb_term_config *term,
                    struct cb_counters *counters, struct cb_terms_verdict *verdict,
                    struct cb_term_state *state, float *value) {
    const uint8_t remarks = compute(e, term, state, value);
    if (remarks != 0) note(remarks, counters, verdict);
    if (remarks & MISSING) return false;
    if (all_finite(value, term->outputs)) return true;
    ++counters->terms_not_finite;
    return false;
}

/* Most terms have one output. */
static inline void copy(const float *from, unsigned count, float *to) {
    if (count == 1)
        *to = *from;
    else
        memcpy(to, from, count * sizeof *to);
}

static void fade(float *held, unsigned count, float fade_um) {
    for (unsigned i = 0; i < count; ++i) held[i] -= cb_clamp(held[i], -fade_um, fade_um);
}

struct cb_terms_verdict cb_terms_evaluate(const struct cb_config *config,
                                          const struct cb_signal_state *signals,
                                          struct cb_term_state *states,
                                          struct cb_counters *counters, float fade_um,
                                          float *outputs) {
    bool live[CB_MAX_OUTPUTS];
    const struct evaluation e = {config, signals, outputs, live};
    struct cb_terms_verdict verdict = {false, false};
    const struct cb_term_config *term = config->terms, *const end = term + config->terms_count;
    for (struct cb_term_state *state = states; term != end; ++term, ++state) {
        float *const value = outputs + term->first_output;
        if (is_plain(&e, term, state, value)) {
            state->held[0] = *value;
            state->live = live[term->first_output] = true;
            continue;
        }
        const bool lives = refresh(&e, term, counters, &verdict, state, value);
        live[term->first_output] = lives;
        for (unsigned k = 1; k < term->outputs; ++k) live[term->first_output + k] = lives;
        if (lives) {
            state->live = true;
            copy(value, term->outputs, state->held);
            continue;
        }
        fade(state->held, term->outputs, fade_um);
        copy(state->held, term->outputs, value);
        counters->terms_faded += state->live;
        state->live = false;
        verdict.degraded = true;
    }
    return verdict;
}
