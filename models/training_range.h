/* SPDX-License-Identifier: MIT
 * Guard of a trained model against inputs outside of its training data.
 *
 * Inputs slightly outside the trained range are normal (a warmer summer), and the model
 * extrapolates up to a margin. Beyond the margin the input is held there, and the model's weight
 * fades to zero. */
#ifndef COMPBOX_MODELS_TRAINING_RANGE_H
#define COMPBOX_MODELS_TRAINING_RANGE_H

#include <stdbool.h>
#include <stdint.h>

/* Range of one input, in its unit. */
struct cb_training_range {
    float min, max;     /* of the training data; min <= max */
    float margin;       /* >= 0: extrapolation allowed beyond min and max */
    float inverse_fade; /* > 0: 1 / distance beyond the margin over which the weight falls to 0 */
};

struct cb_training_verdict {
    float weight;       /* 0 … 1, for all outputs of the model */
    float weight_slope; /* d weight / d x[weakest]; 0 where the weight is flat */
    uint8_t weakest;    /* the input that sets the weight; 0 while the weight is 1 */
    uint8_t
        extrapolated; /* number of inputs outside [min, max], including those beyond the margin */
    uint8_t beyond;   /* number of inputs beyond the margin */
};

/* out: true if x lies in [min, max]; such an x is unchanged and affects no verdict */
static inline bool cb_training_range_holds(const struct cb_training_range *range, float x) {
    return x >= range->min && x <= range->max;
}

/* in : x beyond [min, max], or NaN; input, its index; the verdict starts as {1, 0, 0, 0, 0}
 * out: x held, and the verdict updated */
float cb_training_range_outside(const struct cb_training_range *range, uint8_t input, float x,
                                struct cb_training_verdict *verdict);

/* in : x[count]; NaN and the infinities are allowed and count as beyond every margin
 * out: inside[count] (may be x itself): x held within [min - margin, max + margin], finite; weight
 *      = min over the inputs of 1 - clamp(distance beyond the margin / fade, 0, 1). Each input
 *      moves the weight by at most |dx| / fade: it never jumps.
 * No state. */
struct cb_training_verdict cb_training_range_hold(const struct cb_training_range *ranges,
                                                  uint8_t count, const float *x, float *inside);

#endif
