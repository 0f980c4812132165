/* SPDX-License-Identifier: MIT
 * How far a linear model's prediction may be off at a state, by its own training.
 *
 * Take the error of the model y = w x at the columns x as
 *
 *     e(x) = e0 + a z(x),   z(x) = D x + o,
 *
 * D: a few directions of the columns, along which the trained states lie furthest apart, scaled so
 * that z has a mean of 0 and a mean square of 1 over them. a: what is wrong with the weights along
 * these directions, independent, each with the standard deviation along_um. e0: the rest, with
 * floor_um. So
 *
 *     variance of e(x)             = floor_um^2 + along_um^2 |z(x)|^2               (1)
 *     variance of e(x) - e(x')     = along_um^2 |z(x) - z(x')|^2, without e0        (2)
 *
 * (1) is what is not known before anything was measured. Once e(x') was measured, only (2) is new
 * at x. How e0 changes with time is the drift of models/adapt.h.
 *
 * Rounding: a variance is within 10 * 2^-24 of its value, for the floats that it is given; no
 * summand is negative. cb_sigma_um() is within 10 * 2^-24 too. */
#ifndef COMPBOX_MODELS_SIGMA_H
#define COMPBOX_MODELS_SIGMA_H

#include <stdint.h>

#include "models/num.h"

enum { CB_SIGMA_DIRECTIONS = 4 };
#define CB_SIGMA_MOST_PLACE 1e9f /* of |z| in each direction */

/* One output of a model at one state. */
struct cb_sigma {
    float floor_um, along_um;         /* 0 … 1e6 */
    float place[CB_SIGMA_DIRECTIONS]; /* z; 0 in directions that the model does not have */
    uint32_t model;                   /* names model and directions; 0: nothing is known */
};

/* out: sqrt(x) within 2 ulp for x in 1e-30 … 1e36, 0 for less or NaN. Newton's steps from a guess
 *      that halves the exponent, within 4 %: no libm, the same bits on every target. */
static inline float cb_root(float x) {
    if (!(x > 1e-30f)) return 0.0f;
    float y = cb_float_of(0x1FBD1DF5u + (cb_bits_of(x) >> 1));
    for (int i = 0; i < 3; ++i) y = 0.5f * (y + x / y);
    return y;
}

/* in : from[CB_SIGMA_DIRECTIONS]. out: |z - from|^2 */
static inline float cb_sigma_distance(const struct cb_sigma *at, const float *from) {
    float sum = 0.0f;
    for (unsigned d = 0; d < CB_SIGMA_DIRECTIONS; ++d) {
        const float way = at->place[d] - from[d];
        sum += way * way;
    }
    return sum;
}

/* out: (1), µm² */
static inline float cb_sigma_variance(const struct cb_sigma *at) {
    static const float middle[CB_SIGMA_DIRECTIONS] = {0.0f};
    return at->floor_um * at->floor_um +
           at->along_um * at->along_um * cb_sigma_distance(at, middle);
}

/* in : from[CB_SIGMA_DIRECTIONS], the place of another state. out: (2), µm² */
static inline float cb_sigma_change(const struct cb_sigma *at, const float *from) {
    return at->along_um * at->along_um * cb_sigma_distance(at, from);
}

/* out: the root of (1), µm */
static inline float cb_sigma_um(const struct cb_sigma *at) {
    return cb_root(cb_sigma_variance(at));
}

#endif
