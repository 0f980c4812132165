/* SPDX-License-Identifier: MIT
 * Slopes of the terms by one signal, analytic, for the tangent mode (box/tangent.h). */
#include "firmware/terms/curves.h"
#include "firmware/terms/kinds.h"
#include "models/bpnet.h"
#include "models/num.h"
#include "models/training_range.h"
#include "models/volumetric.h"

static float linear(const struct cb_slope_pass *p, const struct cb_linear_config *config) {
    const unsigned i = cb_input_of(p, config->link, config->inputs);
    return i < config->inputs ? p->e.config->pool[config->pool + i] : 0.0f;
}

/* y = w m(x): w' m + w m', m the network at the inputs as the training range holds them. */
static void network(const struct cb_slope_pass *p, const struct cb_term_config *term,
                    float *slope) {
    const struct cb_bpnet_config *config = &term->as.bpnet;
    const struct cb_bpnet net = {p->e.config->pool + config->weights, config->inputs,
                                 config->hidden, term->outputs, config->linear};
    const unsigned input = cb_input_of(p, config->link, config->inputs);
    float x[CB_BPNET_MAX_INPUTS];
    for (unsigned k = 0; k < term->outputs; ++k) slope[k] = 0.0f;
    if (input == config->inputs) return;
    for (unsigned i = 0; i < config->inputs; ++i)
        x[i] = p->e.signals[p->e.config->links[config->link + i]].used;
    const float given = x[input];
    const struct cb_training_verdict verdict = cb_training_range_hold(
        (const struct cb_training_range *)(const void *)(p->e.config->pool + config->ranges),
        config->inputs, x, x);
    if (!(verdict.weight > 0.0f)) return;
    if (x[input] == given) cb_bpnet_slope(&net, x, (uint8_t)input, slope);
    const bool fades = verdict.weight < 1.0f && verdict.weakest == input;
    const float fading = fades ? verdict.weight_slope / verdict.weight : 0.0f;
    const float *output = p->e.outputs + term->first_output;
    for (unsigned k = 0; k < term->outputs; ++k)
        slope[k] = verdict.weight * slope[k] + fading * output[k];
}

static void volumetric(const struct cb_slope_pass *p, const struct cb_volumetric_config *config,
                       float *slope) {
    const float *pool = p->e.config->pool + config->pool;
    const struct cb_volumetric *model = (const struct cb_volumetric *)(const void *)pool;
    struct cb_volumetric_state state, rate;
    for (unsigned a = 0; a < CB_AXES; ++a) {
        state.position_mm[a] = p->e.signals[config->position[a]].used;
        rate.position_mm[a] = config->position[a] == p->signal ? 1.0f : 0.0f;
    }
    const bool constant = config->tool_length == CB_NONE;
    state.tool_mm =
        constant ? pool[sizeof *model / sizeof *pool] : p->e.signals[config->tool_length].used;
    rate.tool_mm = !constant && config->tool_length == p->signal ? 1.0f : 0.0f;
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k) {
        const uint8_t error = config->error[k];
        state.error[k] = error == CB_NONE ? 0.0f : p->e.outputs[error];
        rate.error[k] = error == CB_NONE ? 0.0f : p->slopes[error];
    }
    cb_volumetric_derivative(model, &state, &rate, slope);
}

static void one_term(const struct cb_slope_pass *p, const struct cb_term_config *term,
                     const struct cb_term_state *state, float *slope) {
    const struct cb_term_kind *kind = cb_term_kinds[term->type];
    if (kind) {
        kind->slope(p, term, state, slope);
        return;
    }
    switch ((enum cb_term_type)term->type) {
        case CB_TERM_BSPLINE:
        case CB_TERM_POLYLINE:
        case CB_TERM_POLYNOMIAL:
            cb_curve_slope(p, term, state, slope);
            break;
        case CB_TERM_LINEAR:
            slope[0] = linear(p, &term->as.linear);
            break;
        case CB_TERM_PRODUCT:
            break;
        case CB_TERM_BPNET:
            network(p, term, slope);
            break;
        case CB_TERM_VOLUMETRIC:
            volumetric(p, &term->as.volumetric, slope);
            break;
    }
}

void cb_terms_slopes(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *states, const float *outputs, uint8_t signal,
                     float *slopes) {
    const struct cb_slope_pass p = {{config, signals, states, outputs, true}, signal, slopes};
    for (unsigned i = 0; i < config->terms_count; ++i) {
        const struct cb_term_config *term = &config->terms[i];
        float slope[CB_MAX_TERM_OUTPUTS] = {0.0f};
        if (states[i].live) one_term(&p, term, &states[i], slope);
        for (unsigned k = 0; k < term->outputs; ++k)
            slopes[term->first_output + k] = cb_is_finite(slope[k]) ? slope[k] : 0.0f;
    }
}
