/* SPDX-License-Identifier: MIT
 * Terms of type bpnet: neural networks. The loader reads one as it was trained, checks it, and
 * folds centers and scales into its weights (models/bpnet.h). */
#include "models/bpnet.h"

#include <string.h>

#include "firmware/terms/kind.h"
#include "firmware/terms/load.h"
#include "firmware/terms/ranges.h"

enum {
    OUTPUTS = CB_TERM_COMMON_KEYS,
    INPUTS,
    ACTIVATION,
    HIDDEN_WEIGHTS,
    HIDDEN_BIAS,
    OUTPUT_WEIGHTS,
    OUTPUT_BIAS,
    LINEAR_WEIGHTS,
    INPUT_CENTER,
    INPUT_SCALE,
    OUTPUT_CENTER,
    OUTPUT_SCALE,
    RANGE,
    KEYS = RANGE + CB_RANGE_KEYS
};

static const struct cb_field FIELDS[KEYS] = {
    CB_TERM_COMMON_FIELDS,
    [OUTPUTS] = {"outputs", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [INPUTS] = {"inputs", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [ACTIVATION] = {"activation", CB_FIELD_STRING, true, CB_NOT_STORED},
    [HIDDEN_WEIGHTS] = {"hidden_weights", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [HIDDEN_BIAS] = {"hidden_bias", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [OUTPUT_WEIGHTS] = {"output_weights", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [OUTPUT_BIAS] = {"output_bias", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [LINEAR_WEIGHTS] = {"linear_weights", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [INPUT_CENTER] = {"input_center", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [INPUT_SCALE] = {"input_scale", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [OUTPUT_CENTER] = {"output_center", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [OUTPUT_SCALE] = {"output_scale", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    CB_RANGE_FIELDS(RANGE, true),
};

static const struct cb_word ACTIVATION_WORDS[] = {
    {"tansig", CB_BPNET_TANSIG}, {"logsig", CB_BPNET_LOGSIG}, {0, 0}};

/* Each maximum is compared by itself, not their product: 128 x 32 weights are as many as 64 x 64,
 * but overrun the arrays with one entry per input. */
_Static_assert((int)CB_BPNET_MAX_INPUTS == (int)CB_MAX_NET_INPUTS, "inputs of one network");
_Static_assert((int)CB_BPNET_MAX_HIDDEN == (int)CB_MAX_NET_HIDDEN, "hidden units of one network");
_Static_assert((int)CB_BPNET_MAX_OUTPUTS == (int)CB_MAX_TERM_OUTPUTS, "outputs of one term");

/* ---- layers ---- */

/* out: number of hidden units, and the weights and biases of the hidden layer */
static bool read_hidden(struct cb_loader *loader, const uint32_t *slots,
                        struct cb_bpnet_source *source) {
    struct cb_load_scratch *scratch = loader->scratch;
    uint32_t hidden = 0;
    if (!cb_read_numbers(loader, slots[HIDDEN_BIAS], scratch->net.hidden_bias, CB_BPNET_MAX_HIDDEN,
                         &hidden))
        return false;
    if (hidden == 0)
        return cb_fail(loader, CB_ERROR_RANGE, slots[HIDDEN_BIAS],
                       "at least one hidden unit is needed");
    source->hidden = (uint8_t)hidden;
    return cb_read_rows(loader, slots[HIDDEN_WEIGHTS], hidden, "hidden units", source->inputs,
                        "inputs", scratch->net.hidden_weights);
}

/* out: weights and biases of the outputs; linear_weights only if the file has them, else NULL */
static bool read_outputs(struct cb_loader *loader, const uint32_t *slots,
                         struct cb_bpnet_source *source) {
    struct cb_load_scratch *scratch = loader->scratch;
    const uint32_t outputs = source->outputs;
    if (!cb_read_rows(loader, slots[OUTPUT_WEIGHTS], outputs, "outputs", source->hidden,
                      "hidden units", scratch->net.output_weights))
        return false;
    if (!cb_read_vector(loader, slots[OUTPUT_BIAS], outputs, "outputs", scratch->net.output_bias))
        return false;
    if (slots[LINEAR_WEIGHTS] == CB_ABSENT) return true;
    source->linear_weights = scratch->net.linear_weights;
    return cb_read_rows(loader, slots[LINEAR_WEIGHTS], outputs, "outputs", source->inputs, "inputs",
                        scratch->net.linear_weights);
}

/* In the file value = center + scale * (number of the network), for inputs and outputs alike.
 * out: centers and scales; the scale of an input as its reciprocal */
static bool read_scaling(struct cb_loader *loader, const uint32_t *slots,
                         const struct cb_bpnet_source *source) {
    struct cb_load_scratch *scratch = loader->scratch;
    const uint32_t inputs = source->inputs, outputs = source->outputs;
    float *scale = scratch->net.input_scale;
    if (!cb_read_vector_or(loader, slots[INPUT_CENTER], inputs, "inputs", 0.0f,
                           scratch->net.input_center) ||
        !cb_read_vector_or(loader, slots[INPUT_SCALE], inputs, "inputs", 1.0f, scale) ||
        !cb_read_vector_or(loader, slots[OUTPUT_CENTER], outputs, "outputs", 0.0f,
                           scratch->net.output_center) ||
        !cb_read_vector_or(loader, slots[OUTPUT_SCALE], outputs, "outputs", 1.0f,
                           scratch->net.output_scale))
        return false;
    if (!cb_check_least(loader, slots[INPUT_SCALE], CB_LEAST_SCALE, inputs, scale) ||
        !cb_check_least(loader, slots[OUTPUT_SCALE], CB_LEAST_SCALE, outputs,
                        scratch->net.output_scale))
        return false;
    for (uint32_t i = 0; i < inputs; ++i) scale[i] = 1.0f / scale[i];
    return true;
}

/* out: *source complete but for its counts of inputs and outputs; its arrays are in the scratch */
static bool read_network(struct cb_loader *loader, const uint32_t *slots,
                         struct cb_bpnet_source *source) {
    struct cb_load_scratch *scratch = loader->scratch;
    source->hidden_weights = scratch->net.hidden_weights;
    source->hidden_bias = scratch->net.hidden_bias;
    source->output_weights = scratch->net.output_weights;
    source->output_bias = scratch->net.output_bias;
    source->input_offset = scratch->net.input_center;
    source->input_scale = scratch->net.input_scale;
    source->output_offset = scratch->net.output_center;
    source->output_scale = scratch->net.output_scale;
    return cb_read_word(loader, slots[ACTIVATION], ACTIVATION_WORDS, &source->activation) &&
           read_hidden(loader, slots, source) && read_outputs(loader, slots, source) &&
           read_scaling(loader, slots, source);
}

/* in : as `load` of struct cb_term_kind
 * out: weights and ranges in the pool. The folded network is checked: a product of weights, centers
 *      and scales can overflow although each number is in its range. */
static bool load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term) {
    struct cb_bpnet_config *config = &term->as.bpnet;
    struct cb_bpnet_source source = {.outputs = term->outputs};
    struct cb_bpnet net;
    if (!cb_read_inputs(loader, slots[INPUTS], CB_BPNET_MAX_INPUTS, &config->inputs)) return false;
    source.inputs = config->inputs.count;
    if (!read_network(loader, slots, &source)) return false;
    config->hidden = source.hidden;
    config->linear = source.linear_weights != 0;
    const uint32_t floats =
        cb_bpnet_floats(source.inputs, source.hidden, source.outputs, config->linear);
    if (!cb_take_pool(loader, at, floats, &config->weights)) return false;
    if (!cb_bpnet_fold(&source, loader->config->pool + config->weights, &net))
        return cb_fail(loader, CB_ERROR_RANGE, at,
                       "a product of weights, centers and scales of this network overflows");
    return cb_read_ranges(loader, at, slots + RANGE, source.inputs, &config->ranges);
}

/* ---- value and slope ---- */

/* out: x[inputs], clamped to the training range and its margin; the verdict of all inputs; false if
 *      a signal is not fresh */
static bool gather(const struct cb_evaluation *e, const struct cb_bpnet_config *config, float *x,
                   struct cb_training_verdict *verdict) {
    const uint8_t *const links = e->config->links + config->inputs.link;
    const struct cb_training_range *range = cb_ranges_at(e->config, config->ranges);
    const struct cb_signal_state *const signals = e->signals;
    const unsigned inputs = config->inputs.count;
    bool fresh = true;
    for (unsigned i = 0; i < inputs; ++i) {
        const struct cb_signal_state *signal = &signals[links[i]];
        fresh &= signal->fresh;
        x[i] = cb_range_hold(range++, i, signal->used, verdict);
    }
    return fresh;
}

static struct cb_bpnet net_of(const struct cb_config *config, const struct cb_term_config *term) {
    const struct cb_bpnet_config *net = &term->as.bpnet;
    return (struct cb_bpnet){config->pool + net->weights, net->inputs.count, net->hidden,
                             term->outputs, net->linear};
}

/* Beyond the margin the verdict's weight scales the outputs down. */
static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    const struct cb_bpnet net = net_of(e->config, term);
    struct cb_training_verdict verdict = CB_NO_VERDICT;
    float x[CB_BPNET_MAX_INPUTS];
    (void)state;
    if (!gather(e, &term->as.bpnet, x, &verdict)) return CB_TERM_MISSING;
    cb_bpnet_evaluate(&net, x, value);
    return cb_range_judge(&verdict, value, term->outputs);
}

/* Product rule: y = w m(x) has the slope w' m + w m', with m the network at the clamped inputs. An
 * input that is clamped has m' = 0. */
static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    const struct cb_bpnet_config *config = &term->as.bpnet;
    const struct cb_bpnet net = net_of(pass->e.config, term);
    const unsigned input = cb_input_of(pass, &config->inputs);
    struct cb_training_verdict verdict = CB_NO_VERDICT;
    float x[CB_BPNET_MAX_INPUTS];
    if (input == config->inputs.count) return;
    gather(&pass->e, config, x, &verdict);
    if (!(verdict.weight > 0.0f)) return;
    if (x[input] == pass->e.signals[pass->signal].used)
        cb_bpnet_slope(&net, x, (uint8_t)input, slope);
    cb_range_fade_slope(&verdict, input, pass->e.outputs + term->first_output, slope,
                        term->outputs);
}

const struct cb_term_kind cb_term_bpnet = {
    .object = {FIELDS, KEYS},
    .signals = {offsetof(struct cb_term_config, as.bpnet.inputs), 0},
    .outputs = OUTPUTS,
    .load = load,
    .value = value,
    .slope = slope,
};
