/* SPDX-License-Identifier: MIT
 *
 * Rounding: with u = 2^-24, N inputs and H hidden units, the argument s of a hidden unit is wrong
 * by at most (N + 3) u (|bias| + sum |w_j x_j|) in folded weights, an output by at most
 * (H/4 + 6) u (|bias| + sum |v_h|) + sum |v_h| (2.3 u + error of s_h). Both count the rounding of
 * the folded weights; bpnet_test.cpp holds them against the unfolded network in double. */
#include "models/bpnet.h"

#include "models/bpnet_layers.h"
#include "models/num.h"

static uint32_t padded(uint8_t hidden) {
    return (hidden + 3u) & ~3u;
}

static uint32_t output_row(const struct cb_bpnet *net) {
    return 1u + padded(net->hidden) + (net->linear ? net->inputs : 0u);
}

uint32_t cb_bpnet_floats(uint8_t inputs, uint8_t hidden, uint8_t outputs, bool linear) {
    const struct cb_bpnet net = {0, inputs, hidden, outputs, linear};
    return padded(hidden) * (inputs + 1u) + outputs * output_row(&net);
}

/* out: index of a hidden unit's bias in weights; the weight of its input j is (j + 1) * *width
 *      later */
static uint32_t unit_place(const struct cb_bpnet *net, uint32_t unit, uint32_t *width) {
    const uint32_t in_eights = padded(net->hidden) & ~7u;
    *width = unit < in_eights ? 8 : 4;
    const uint32_t block = unit & ~(*width - 1u);
    return block * (net->inputs + 1u) + (unit - block);
}

/* ---- folding ---- */

/* An unevaluated sum of two floats. */
struct sum {
    float hi, lo;
};

/* out: s + x, with the rounding error of the addition kept in lo (Knuth's two-sum) */
static struct sum add(struct sum s, float x) {
    const float hi = s.hi + x;
    const float part = hi - s.hi;
    const struct sum result = {hi, s.lo + ((s.hi - (hi - part)) + (x - part))};
    return result;
}

/* out: the upper 12 bits of x (Veltkamp), so that products of such halves are exact */
static float upper_half(float x) {
    const float c = x * 4097.0f;
    return c - (c - x);
}

/* out: s + a * b, with the rounding errors of product and addition kept (Dekker's product) */
static struct sum add_product(struct sum s, float a, float b) {
    const float ah = upper_half(a), al = a - ah, bh = upper_half(b), bl = b - bh;
    const float p = a * b;
    const float error = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    return add(add(s, p), error);
}

static float value(struct sum s) {
    return s.hi + s.lo;
}

/* Folds hidden unit i: its weights then apply to x instead of n, and its bias absorbs the input
 * offsets. `half` is 1, or 1/2 for the logistic function expressed as a tanh. */
static void fold_unit(const struct cb_bpnet_source *source, const struct cb_bpnet *net, uint32_t i,
                      float half, float *weights) {
    uint32_t width;
    float *const place = weights + unit_place(net, i, &width);
    struct sum bias = {source->hidden_bias[i] * half, 0.0f};
    for (uint32_t j = 0; j < source->inputs; ++j) {
        const float w = source->hidden_weights[i * source->inputs + j] * half;
        const float folded = w * source->input_scale[j];
        place[(j + 1) * width] = folded;
        bias = add_product(bias, -folded, source->input_offset[j]);
    }
    place[0] = value(bias);
}

/* Folds output k in the same way; row is its place among the weights. */
static void fold_output(const struct cb_bpnet_source *source, uint32_t k, float half, float *row) {
    const bool logistic = source->activation == CB_BPNET_LOGSIG;
    const float scale = source->output_scale[k];
    struct sum bias = {source->output_offset[k], 0.0f};
    bias = add_product(bias, scale, source->output_bias[k]);
    for (uint32_t i = 0; i < source->hidden; ++i) {
        const float folded = source->output_weights[k * source->hidden + i] * half * scale;
        row[1 + i] = folded;
        if (logistic) bias = add(bias, folded);
    }
    float *const linear = row + 1 + padded(source->hidden);
    for (uint32_t j = 0; source->linear_weights && j < source->inputs; ++j) {
        const float n_scale = scale * source->input_scale[j];
        linear[j] = source->linear_weights[k * source->inputs + j] * n_scale;
        bias = add_product(bias, -linear[j], source->input_offset[j]);
    }
    row[0] = value(bias);
}

bool cb_bpnet_fold(const struct cb_bpnet_source *source, float *weights, struct cb_bpnet *net) {
    const struct cb_bpnet folded = {weights, source->inputs, source->hidden, source->outputs,
                                    source->linear_weights != 0};
    const float half = source->activation == CB_BPNET_LOGSIG ? 0.5f : 1.0f;
    const uint32_t count =
        cb_bpnet_floats(folded.inputs, folded.hidden, folded.outputs, folded.linear);
    for (uint32_t i = 0; i < count; ++i) weights[i] = 0.0f;
    for (uint32_t i = 0; i < source->hidden; ++i) fold_unit(source, &folded, i, half, weights);
    float *row = weights + padded(source->hidden) * (source->inputs + 1u);
    for (uint32_t k = 0; k < source->outputs; ++k) {
        fold_output(source, k, half, row);
        row += output_row(&folded);
    }
    for (uint32_t i = 0; i < count; ++i) {
        if (!cb_is_finite(weights[i])) return false;
    }
    *net = folded;
    return true;
}

/* ---- evaluation ---- */

/* in : h[padded hidden] from the caller
 * out: h = tanh of the hidden layer; result: the start of the outputs' rows */
static const float *hidden_layer(const struct cb_bpnet *net, const float *x, float *h) {
    return hidden_units(net->weights, x, net->inputs, padded(net->hidden), h);
}

void cb_bpnet_evaluate(const struct cb_bpnet *net, const float *x, float *y) {
    float h[CB_BPNET_MAX_HIDDEN];
    const uint32_t units = padded(net->hidden), row = output_row(net);
    const float *w = hidden_layer(net, x, h);
    for (uint32_t k = 0; k < net->outputs; ++k, w += row) {
        float sum = w[0];
        if (net->linear) sum += dot(w + 1 + units, x, net->inputs);
        y[k] = cb_canonical(sum + dot(w + 1, h, units));
    }
}

void cb_bpnet_slope(const struct cb_bpnet *net, const float *x, uint8_t input, float *slope) {
    float h[CB_BPNET_MAX_HIDDEN];
    const uint32_t units = padded(net->hidden), row = output_row(net);
    const float *w = hidden_layer(net, x, h);
    for (uint32_t i = 0; i < net->hidden; ++i) {
        uint32_t width;
        const uint32_t place = unit_place(net, i, &width);
        h[i] = (1.0f - h[i] * h[i]) * net->weights[place + (input + 1u) * width];
    }
    for (uint32_t k = 0; k < net->outputs; ++k, w += row) {
        const float linear = net->linear ? w[1 + units + input] : 0.0f;
        slope[k] = cb_canonical(linear + dot(w + 1, h, units));
    }
}
