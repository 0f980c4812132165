/* SPDX-License-Identifier: MIT
 * The two layers of a folded network (bpnet.h), for bpnet.c alone. In both versions below each
 * running sum takes its numbers in memory order, so the bits are the same. */
#ifndef COMPBOX_MODELS_BPNET_LAYERS_H
#define COMPBOX_MODELS_BPNET_LAYERS_H

#include <stdint.h>

#include "models/four.h"
#include "models/transcendental.h"

#ifdef CB_FOUR

/* Arguments of two blocks of 8 hidden units. Four sums of four hide the latency of the adder.
 * out: the start of the next block */
static inline const float *two_blocks_of_8(const float *w, const float *x, uint32_t inputs,
                                           float *s) {
    const float *v = w + 8 * (inputs + 1u);
    cb_four a = cb_four_load(w), b = cb_four_load(w + 4);
    cb_four c = cb_four_load(v), d = cb_four_load(v + 4);
    for (const float *const end = x + inputs; x != end; ++x) {
        w += 8;
        v += 8;
        a += cb_four_load(w) * *x;
        b += cb_four_load(w + 4) * *x;
        c += cb_four_load(v) * *x;
        d += cb_four_load(v + 4) * *x;
    }
    cb_four_store(s, a);
    cb_four_store(s + 4, b);
    cb_four_store(s + 8, c);
    cb_four_store(s + 12, d);
    return v + 8;
}

static inline const float *block_of_8(const float *w, const float *x, uint32_t inputs, float *s) {
    cb_four a = cb_four_load(w), b = cb_four_load(w + 4);
    for (const float *const end = x + inputs; x != end; ++x) {
        w += 8;
        a += cb_four_load(w) * *x;
        b += cb_four_load(w + 4) * *x;
    }
    cb_four_store(s, a);
    cb_four_store(s + 4, b);
    return w + 8;
}

static inline const float *block_of_4(const float *w, const float *x, uint32_t inputs, float *s) {
    cb_four a = cb_four_load(w);
    for (const float *const end = x + inputs; x != end; ++x) a += cb_four_load(w += 4) * *x;
    cb_four_store(s, a);
    return w + 4;
}

/* in : h[units] from the caller, units a multiple of 4
 * out: h = tanh of the hidden layer; result: the start of the outputs' rows */
static inline const float *hidden_units(const float *w, const float *x, uint32_t inputs,
                                        uint32_t units, float *h) {
    uint32_t i = 0;
    for (; i + 16 <= units; i += 16) w = two_blocks_of_8(w, x, inputs, h + i);
    for (; i + 8 <= units; i += 8) w = block_of_8(w, x, inputs, h + i);
    if (i < units) w = block_of_4(w, x, inputs, h + i);
    for (i = 0; i < units; i += 4) cb_four_store(h + i, cb_four_tanh(cb_four_load(h + i)));
    return w;
}

/* Scalar product in four running sums, added pairwise; a rest of up to three is added one by
 * one. */
static inline float dot(const float *w, const float *v, uint32_t count) {
    cb_four s = {0.0f, 0.0f, 0.0f, 0.0f};
    uint32_t i = 0;
    for (; i + 4 <= count; i += 4) s += cb_four_load(w + i) * cb_four_load(v + i);
    float sum = (s[0] + s[1]) + (s[2] + s[3]);
    for (; i < count; ++i) sum += w[i] * v[i];
    return sum;
}

#else

/* Arguments of 8 hidden units. Eight running sums hide the latency of the adder. Each sum takes the
 * inputs in order, so a compiler may vectorise across the sums without changing the bits.
 * out: the start of the next block */
static inline const float *block_of_8(const float *restrict w, const float *restrict x,
                                      uint32_t inputs, float *restrict s) {
    float s0 = w[0], s1 = w[1], s2 = w[2], s3 = w[3], s4 = w[4], s5 = w[5], s6 = w[6], s7 = w[7];
    for (const float *const end = x + inputs; x != end; ++x) {
        const float v = *x;
        w += 8;
        s0 += w[0] * v;
        s1 += w[1] * v;
        s2 += w[2] * v;
        s3 += w[3] * v;
        s4 += w[4] * v;
        s5 += w[5] * v;
        s6 += w[6] * v;
        s7 += w[7] * v;
    }
    s[0] = s0;
    s[1] = s1;
    s[2] = s2;
    s[3] = s3;
    s[4] = s4;
    s[5] = s5;
    s[6] = s6;
    s[7] = s7;
    return w + 8;
}

/* The same for 4 units. */
static inline const float *block_of_4(const float *restrict w, const float *restrict x,
                                      uint32_t inputs, float *restrict s) {
    float s0 = w[0], s1 = w[1], s2 = w[2], s3 = w[3];
    for (const float *const end = x + inputs; x != end; ++x) {
        const float v = *x;
        w += 4;
        s0 += w[0] * v;
        s1 += w[1] * v;
        s2 += w[2] * v;
        s3 += w[3] * v;
    }
    s[0] = s0;
    s[1] = s1;
    s[2] = s2;
    s[3] = s3;
    return w + 4;
}

/* in : h[units] from the caller, units a multiple of 4
 * out: h = tanh of the hidden layer; result: the start of the outputs' rows */
static inline const float *hidden_units(const float *w, const float *x, uint32_t inputs,
                                        uint32_t units, float *h) {
    uint32_t i = 0;
    for (; i + 8 <= units; i += 8) w = block_of_8(w, x, inputs, h + i);
    if (i < units) w = block_of_4(w, x, inputs, h + i);
    for (i = 0; i < units; ++i) h[i] = cb_tanh(h[i]);
    return w;
}

/* Scalar product in four running sums, added pairwise; a rest of up to three is added one by
 * one. */
static inline float dot(const float *w, const float *v, uint32_t count) {
    float s0 = 0.0f, s1 = 0.0f, s2 = 0.0f, s3 = 0.0f;
    uint32_t i = 0;
    for (; i + 4 <= count; i += 4) {
        s0 += w[i] * v[i];
        s1 += w[i + 1] * v[i + 1];
        s2 += w[i + 2] * v[i + 2];
        s3 += w[i + 3] * v[i + 3];
    }
    float sum = (s0 + s1) + (s2 + s3);
    for (; i < count; ++i) sum += w[i] * v[i];
    return sum;
}

#endif
#endif
