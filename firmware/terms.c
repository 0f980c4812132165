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

/* A B-spline or polyline, as the loader left it in the pool. */
static struct cb_curve_value piecewise(const struct cb_config *config,
                                       const struct cb_curve_config *curve, float x) {
    const float *breaks = config->pool + curve->pool;
    const struct cb_ppoly ppoly = {.breaks = breaks,
                                   .coefficients = breaks + curve->spans + 1,
                                   .spans_per_unit = curve->spans_per_unit,
                                   .spans = curve->spans,
                                   .degree = curve->degree};
    struct cb_curve_value result = {.value = cb_ppoly_value(&ppoly, x)};
    result.outside = x < breaks[0] || x > breaks[curve->spans];
    return result;
}

static struct cb_curve_value polynomial(const struct cb_config *config,
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
                                       const struct cb_curve_config *curve, float x) {
    return type == CB_TERM_POLYNOMIAL ? polynomial(config, curve, x) : piecewise(config, curve, x);
}

/* What one step of all terms works with. */
struct evaluation {
    const struct cb_config *config;
    const struct cb_signal_state *signals;
    const struct cb_term_state *states; /* of the terms before this one: as of this step */
    const float *outputs;               /* likewise */
};

/* What a term says about its inputs. */
struct remark {
    bool outside;      /* a curve is held at its end */
    bool extrapolated; /* a model has an input outside its training range */
    bool weakened;     /* … so far outside that its weight is below 1 */
};

/* ---- which terms can be computed ---- */

static bool all_fresh(const struct evaluation *e, uint16_t link, unsigned count) {
    const uint8_t *links = e->config->links + link;
    for (unsigned i = 0; i < count; ++i) {
        if (!e->signals[links[i]].fresh) return false;
    }
    return true;
}

static bool is_live(const struct evaluation *e, uint8_t output) {
    return output == CB_NONE || e->states[e->config->outputs[output].term].live;
}

static bool volumetric_ready(const struct evaluation *e,
                             const struct cb_volumetric_config *volumetric) {
    for (unsigned a = 0; a < CB_AXES; ++a) {
        if (!e->signals[volumetric->position[a]].fresh) return false;
    }
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k) {
        if (!is_live(e, volumetric->error[k])) return false;
    }
    return volumetric->tool_length == CB_NONE || e->signals[volumetric->tool_length].fresh;
}

/* true when every signal and term that the term looks at is there. */
static bool ready(const struct evaluation *e, const struct cb_term_config *term) {
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            return e->signals[term->as.curve.signal].fresh;
        case CB_TERM_LINEAR:
            return all_fresh(e, term->as.linear.link, term->as.linear.inputs);
        case CB_TERM_PRODUCT:
            return e->signals[term->as.product.signal].fresh && is_live(e, term->as.product.output);
        case CB_TERM_BPNET:
            return all_fresh(e, term->as.bpnet.link, term->as.bpnet.inputs);
        case CB_TERM_VOLUMETRIC:
            return volumetric_ready(e, &term->as.volumetric);
    }
    return false;
}

/* ---- values ---- */

static float linear(const struct evaluation *e, const struct cb_linear_config *linear) {
    const float *weights = e->config->pool + linear->pool;
    const uint8_t *links = e->config->links + linear->link;
    float sum = weights[linear->inputs];
    for (unsigned i = 0; i < linear->inputs; ++i) sum += weights[i] * e->signals[links[i]].used;
    return sum;
}

static float product(const struct evaluation *e, const struct cb_product_config *product) {
    return e->outputs[product->output] * (e->signals[product->signal].used - product->origin);
}

/* Inputs held in the training range and its margin; outputs weakened beyond that. */
static struct remark network(const struct evaluation *e, const struct cb_term_config *term,
                             float *value) {
    const struct cb_bpnet_config *config = &term->as.bpnet;
    const uint8_t *links = e->config->links + config->link;
    const struct cb_bpnet net = {e->config->pool + config->weights, config->inputs, config->hidden,
                                 term->outputs, config->linear};
    float x[CB_BPNET_MAX_INPUTS];
    for (unsigned i = 0; i < config->inputs; ++i) x[i] = e->signals[links[i]].used;
    const struct cb_training_verdict verdict = cb_training_range_hold(
        (const struct cb_training_range *)(const void *)(e->config->pool + config->ranges),
        config->inputs, x, x);
    cb_bpnet_evaluate(&net, x, value);
    for (unsigned k = 0; k < term->outputs; ++k) value[k] *= verdict.weight;
    const struct remark remark = {.extrapolated = verdict.extrapolated > 0,
                                  .weakened = verdict.weight < 1.0f};
    return remark;
}

_Static_assert(sizeof(struct cb_training_range) == 4 * sizeof(float), "lies in the pool as floats");

static void volumetric(const struct evaluation *e, const struct cb_volumetric_config *config,
                       float *value) {
    enum { FLOATS = offsetof(struct cb_volumetric, moves) / sizeof(float) };
    const float *pool = e->config->pool + config->pool;
    struct cb_volumetric model;
    struct cb_volumetric_state state;
    memcpy(&model, pool, FLOATS * sizeof *pool);
    memcpy(model.moves, config->moves, sizeof model.moves);
    for (unsigned a = 0; a < CB_AXES; ++a)
        state.position_mm[a] = e->signals[config->position[a]].used;
    state.tool_mm =
        config->tool_length == CB_NONE ? pool[FLOATS] : e->signals[config->tool_length].used;
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k)
        state.error[k] = config->error[k] == CB_NONE ? 0.0f : e->outputs[config->error[k]];
    cb_volumetric_evaluate(&model, &state, value);
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
    const struct cb_curve_value backward =
        one_curve(e->config, term->type, &e->config->branches[curve->backward], signal->used);
    return cb_direction_blend(&state->direction, curve->reversal_mm, forward, backward);
}

static struct remark curve(const struct evaluation *e, const struct cb_term_config *term,
                           struct cb_term_state *state, float *value) {
    const struct cb_curve_config *curve = &term->as.curve;
    struct cb_curve_value result =
        one_curve(e->config, term->type, curve, e->signals[curve->signal].used);
    if (curve->reversal_mm > 0.0f) result = with_branch(e, term, state, result);
    const struct remark remark = {.outside = result.outside};
    value[0] = result.value;
    return remark;
}

/* out: value[term->outputs] */
static struct remark compute(const struct evaluation *e, const struct cb_term_config *term,
                             struct cb_term_state *state, float *value) {
    const struct remark nothing = {0};
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            return curve(e, term, state, value);
        case CB_TERM_LINEAR:
            value[0] = linear(e, &term->as.linear);
            break;
        case CB_TERM_PRODUCT:
            value[0] = product(e, &term->as.product);
            break;
        case CB_TERM_BPNET:
            return network(e, term, value);
        case CB_TERM_VOLUMETRIC:
            volumetric(e, &term->as.volumetric, value);
            break;
    }
    return nothing;
}

/* ---- all terms ---- */

static bool all_finite(const float *value, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
        if (!cb_is_finite(value[i])) return false;
    }
    return true;
}

static void note(const struct remark *remark, struct cb_counters *counters,
                 struct cb_terms_verdict *verdict) {
    counters->outside_curve += remark->outside;
    counters->models_extrapolated += remark->extrapolated;
    counters->models_weakened += remark->weakened;
    verdict->extrapolated = verdict->extrapolated || remark->extrapolated;
    verdict->degraded = verdict->degraded || remark->weakened;
}

/* out: true and the new outputs in state->held[], or false: they could not be computed */
static bool refresh(const struct evaluation *e, const struct cb_term_config *term,
                    struct cb_counters *counters, struct cb_terms_verdict *verdict,
                    struct cb_term_state *state) {
    float value[CB_MAX_TERM_OUTPUTS];
    if (!ready(e, term)) return false;
    const struct remark remark = compute(e, term, state, value);
    note(&remark, counters, verdict);
    if (!all_finite(value, term->outputs)) {
        ++counters->terms_not_finite;
        return false;
    }
    memcpy(state->held, value, term->outputs * sizeof *value);
    return true;
}

static void fade(float *held, unsigned count, float fade_um) {
    for (unsigned i = 0; i < count; ++i) held[i] -= cb_clamp(held[i], -fade_um, fade_um);
}

struct cb_terms_verdict cb_terms_evaluate(const struct cb_config *config,
                                          const struct cb_signal_state *signals,
                                          struct cb_term_state *states,
                                          struct cb_counters *counters, float fade_um,
                                          float *outputs) {
    const struct evaluation e = {config, signals, states, outputs};
    struct cb_terms_verdict verdict = {false, false};
    for (unsigned i = 0; i < config->terms_count; ++i) {
        const struct cb_term_config *term = &config->terms[i];
        struct cb_term_state *state = &states[i];
        const bool live = refresh(&e, term, counters, &verdict, state);
        if (!live) fade(state->held, term->outputs, fade_um);
        counters->terms_faded += state->live && !live;
        state->live = live;
        verdict.degraded = verdict.degraded || !live;
        memcpy(outputs + term->first_output, state->held, term->outputs * sizeof *outputs);
    }
    return verdict;
}
