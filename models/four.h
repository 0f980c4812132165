/* SPDX-License-Identifier: MIT
 * Four float32 in one vector, for processors with such registers (x86-64, arm64): CB_FOUR.
 *
 * Each lane executes the scalar code's operations in the same order, with one IEEE 754 rounding
 * each. The bits are therefore those of the scalar code, which the Cortex-M4 uses;
 * tests/conformance compares all targets. Compiler vectors, no intrinsics. */
#ifndef COMPBOX_MODELS_FOUR_H
#define COMPBOX_MODELS_FOUR_H

#if defined(__SSE2__) || defined(__ARM_NEON)
#define CB_FOUR 1

#include <stdint.h>

typedef float cb_four __attribute__((vector_size(16)));
typedef uint32_t cb_four_bits __attribute__((vector_size(16)));
typedef float cb_four_in_memory __attribute__((vector_size(16), aligned(4), may_alias));

static inline cb_four cb_four_load(const float *from) {
    return *(const cb_four_in_memory *)from;
}

static inline void cb_four_store(float *to, cb_four x) {
    *(cb_four_in_memory *)to = x;
}

static inline cb_four cb_four_all(float x) {
    return (cb_four){x, x, x, x};
}

/* in : choose, in each of the four lanes all bits set or none */
static inline cb_four cb_four_choose(cb_four_bits choose, cb_four yes, cb_four no) {
    return (cb_four)(((cb_four_bits)yes & choose) | ((cb_four_bits)no & ~choose));
}

/* cb_tanh() of transcendental.h; both branches are computed and one is selected. */
static inline cb_four cb_four_tanh(cb_four x) {
    const cb_four_bits sign = (cb_four_bits)x & 0x80000000u;
    const cb_four a = (cb_four)((cb_four_bits)x ^ sign);
    const cb_four u = a * a;
    cb_four p = 0.0164444223f * u - 0.0526752979f;
    p = p * u + 0.133207783f;
    p = p * u - 0.333329499f;
    const cb_four small = a + p * u * a;
    const cb_four z = a * 2.88539004f;
    const cb_four m = z + 12582912.0f, f = z - (m - 12582912.0f);
    cb_four q = 0.00132647273f * f + 0.00967151295f;
    q = q * f + 0.0555073372f;
    q = q * f + 0.240222424f;
    q = q * f + 0.693146977f;
    q = q * f + 1.0f;
    const cb_four e = (cb_four)((cb_four_bits)q + ((cb_four_bits)m << 23));
    const cb_four large = 1.0f - 2.0f / (1.0f + e);
    cb_four y = cb_four_choose((cb_four_bits)(a <= 9.25f), large, cb_four_all(1.0f));
    y = cb_four_choose((cb_four_bits)(a >= 0.549306154f), y, small);
    return (cb_four)(sign | (cb_four_bits)y);
}

#endif
#endif
