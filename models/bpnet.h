/* SPDX-License-Identifier: MIT
 * Network with one hidden layer (S3: 19-20-3), and an optional linear path beside it:
 *
 *   n = (x - input_offset) * input_scale
 *   h = f(hidden_weights n + hidden_bias)          f = tanh, or logistic 1 / (1 + e^-s)
 *   m = output_weights h + output_bias + linear_weights n
 *   y = output_offset + output_scale * m
 *
 * The loader folds all of this into one set of weights from x to y, with tanh only (logistic(s) =
 * 1/2 + tanh(s/2)/2). A step is then two layers of multiply-adds and the tanh. */
#ifndef COMPBOX_MODELS_BPNET_H
#define COMPBOX_MODELS_BPNET_H

#include <stdbool.h>
#include <stdint.h>

enum { CB_BPNET_MAX_INPUTS = 64, CB_BPNET_MAX_HIDDEN = 64, CB_BPNET_MAX_OUTPUTS = 8 };

enum cb_bpnet_activation { CB_BPNET_TANSIG, CB_BPNET_LOGSIG };

/* The network as trained, row after row, in memory of the caller. */
struct cb_bpnet_source {
    const float *hidden_weights;     /* [hidden][inputs] */
    const float *hidden_bias;        /* [hidden] */
    const float *output_weights;     /* [outputs][hidden] */
    const float *output_bias;        /* [outputs] */
    const float *linear_weights;     /* [outputs][inputs]; NULL: no linear path */
    const float *input_offset;       /* [inputs], unit of the input */
    const float *input_scale;        /* [inputs], 1 / unit of the input */
    const float *output_offset;      /* [outputs], unit of the output */
    const float *output_scale;       /* [outputs], unit of the output */
    uint8_t inputs, hidden, outputs; /* each 1 … its maximum */
    uint8_t activation;              /* enum cb_bpnet_activation */
};

/* The folded network. weights holds cb_bpnet_floats() floats:
 *   hidden layer in blocks of 8 units, the rest in blocks of 4 (missing units are zeros):
 *     bias of each unit of the block, then for each input the weight of each unit of the block
 *   for each output: bias, weight of each hidden unit (padded to 4), linear weight of each input */
struct cb_bpnet {
    const float *weights;
    uint8_t inputs, hidden, outputs;
    bool linear;
};

/* Number of floats of the folded network: 487 for 19-20-3, at most 5 192 + 512 for the linear
 * path. */
uint32_t cb_bpnet_floats(uint8_t inputs, uint8_t hidden, uint8_t outputs, bool linear);

/* in : every number finite; weights[cb_bpnet_floats()] from the caller
 * out: true and `net` ready; false when a folded number is not finite (offsets or scales far out of
 *      proportion)
 * Biases are summed with compensation from the rounded weights, so that a large input offset adds
 * no error here. Only the rounding of the running sum remains (bound in bpnet.c). */
bool cb_bpnet_fold(const struct cb_bpnet_source *source, float *weights, struct cb_bpnet *net);

/* in : x[inputs] finite, already inside the training range (training_range.h)
 * out: y[outputs]; a sum that overflows gives the canonical NaN, for which the box fades the term
 * No state; the order of all sums is fixed, so the bits are the same on every target. */
void cb_bpnet_evaluate(const struct cb_bpnet *net, const float *x, float *y);

/* in : input < inputs
 * out: slope[k] = d y[k] / d x[input], analytic, for the control's tangent mode */
void cb_bpnet_slope(const struct cb_bpnet *net, const float *x, uint8_t input, float *slope);

#endif
