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
 * out: x held within [min - margin, max + margin], finite; the verdict updated: its weight is the
 *      minimum over the inputs of 1 - clamp(distance beyond the margin / fade, 0, 1); NaN and the
 *      infinities count as beyond every margin. Each input moves the weight by at most |dx| / fade:
 *      it never jumps. */
float cb_training_range_outside(const struct cb_training_range *range, uint8_t input, float x,
                                struct cb_training_verdict *verdict);

#endif
