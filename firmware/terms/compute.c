/* SPDX-License-Identifier: MIT */
#include "firmware/terms/curves.h"
#include "firmware/terms/kinds.h"
#include "models/bpnet.h"
#include "models/num.h"
#include "models/training_range.h"
#include "models/volumetric.h"

/* ---- terms of several inputs ---- */

/* Rounding: (inputs + 1) 2^-24 of the sum of the sizes of what is added. */
static uint8_t linear(const struct cb_evaluation *e, const struct cb_linear_config *linear,
                      float *value) {
    const float *weights = e->config->pool + linear->pool;
    const uint8_t *links = e->config->links + linear->link;
    float sum = weights[linear->inputs];
    for (unsigned i = 0; i < linear->inputs; ++i) {
        const struct cb_signal_state *signal = &e->signals[links[i]];
        if (!signal->fresh) return CB_TERM_MISSING;
        sum += weights[i] * signal->used;
    }
    value[0] = sum;
    return 0;
}

_Static_assert(sizeof(struct cb_training_range) == 4 * sizeof(float), "lies in the pool as floats");

/* Seldom: mostly the temperatures are those that were trained. */
CB_COLD CB_OUTLINE float outside(const struct cb_training_range *range, unsigned input, float x,
                                 struct cb_training_verdict *verdict) {
    return cb_training_range_outside(range, (uint8_t)input, x, verdict);
}

/* out: x[inputs] as the network sees them: held in the training range and its margin; false when a
 *      signal is not fresh */
static bool gather(const struct cb_evaluation *e, const struct cb_bpnet_config *config, float *x,
                   struct cb_training_verdict *verdict) {
    const uint8_t *const links = e->config->links + config->link;
    const void *const ranges = e->config->pool + config->ranges;
    const struct cb_training_range *range = ranges;
    const struct cb_signal_state *const signals = e->signals;
    const unsigned inputs = config->inputs;
    bool fresh = true;
    for (unsigned i = 0; i < inputs; ++i) {
        const struct cb_signal_state *signal = &signals[links[i]];
        fresh &= signal->fresh;
        const float used = signal->used;
        x[i] = cb_training_range_holds(range, used) ? used : outside(range, i, used, verdict);
        ++range;
    }
    return fresh;
}

/* Outputs weakened beyond the margin. */
static uint8_t network(const struct cb_evaluation *e, const struct cb_term_config *term,
                       float *value) {
    const struct cb_bpnet_config *config = &term->as.bpnet;
    const struct cb_bpnet net = {e->config->pool + config->weights, config->inputs, config->hidden,
                                 term->outputs, config->linear};
    struct cb_training_verdict verdict = {1.0f, 0.0f, 0, 0, 0};
    float x[CB_BPNET_MAX_INPUTS];
    if (!gather(e, config, x, &verdict)) return CB_TERM_MISSING;
    cb_bpnet_evaluate(&net, x, value);
    for (unsigned k = 0; k < term->outputs; ++k) value[k] *= verdict.weight;
    if (verdict.weight < 1.0f) return CB_TERM_EXTRAPOLATED | CB_TERM_WEAKENED;
    return verdict.extrapolated > 0 ? CB_TERM_EXTRAPOLATED : 0;
}

static bool all_live(const struct cb_evaluation *e, const struct cb_volumetric_config *config) {
    bool live = true;
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k)
        live &= config->error[k] == CB_NONE || cb_output_is_live(e, config->error[k]);
    return live;
}

_Static_assert(sizeof(struct cb_volumetric) % sizeof(float) == 0, "lies in the pool as floats");
enum { VOLUMETRIC_FLOATS = sizeof(struct cb_volumetric) / sizeof(float) };

/* out: the machine at this moment; false when a position, an error or the tool is missing */
static bool machine(const struct cb_evaluation *e, const struct cb_volumetric_config *config,
                    struct cb_volumetric_state *state) {
    bool there = e->all_live || all_live(e, config);
    state->tool_mm = e->config->pool[config->pool + VOLUMETRIC_FLOATS];
    for (unsigned a = 0; a < CB_AXES; ++a) {
        const struct cb_signal_state *position = &e->signals[config->position[a]];
        state->position_mm[a] = position->used;
        there &= position->fresh;
    }
    for (unsigned k = 0; config->complete && k < CB_CURVE_ERRORS; ++k)
        state->error[k] = e->outputs[config->error[k]];
    for (unsigned k = 0; !config->complete && k < CB_CURVE_ERRORS; ++k)
        state->error[k] = config->error[k] == CB_NONE ? 0.0f : e->outputs[config->error[k]];
    if (config->tool_length == CB_NONE) return there;
    state->tool_mm = e->signals[config->tool_length].used;
    return there && e->signals[config->tool_length].fresh;
}

static uint8_t volumetric(const struct cb_evaluation *e, const struct cb_volumetric_config *config,
                          float *value) {
    const void *model = e->config->pool + config->pool;
    struct cb_volumetric_state state;
    if (!machine(e, config, &state)) return CB_TERM_MISSING;
    cb_volumetric_evaluate((const struct cb_volumetric *)model, &state, value);
    return 0;
}

uint8_t cb_term_compute(const struct cb_evaluation *e, const struct cb_term_config *term,
                        struct cb_term_state *state, float *value) {
    const struct cb_term_kind *kind = cb_term_kinds[term->type];
    if (kind) return kind->value(e, term, state, value);
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            return cb_curve_evaluate(e, term, state, value);
        case CB_TERM_LINEAR:
            return linear(e, &term->as.linear, value);
        case CB_TERM_PRODUCT:
            break;
        case CB_TERM_BPNET:
            return network(e, term, value);
        case CB_TERM_VOLUMETRIC:
            return volumetric(e, &term->as.volumetric, value);
    }
    return CB_TERM_MISSING;
}
