/* SPDX-License-Identifier: MIT */
#include "models/training_range.h"

#include "models/num.h"

/* in : x outside [min, max], or NaN
 * out: the counts and, beyond the margin, the weight, if this input has the lowest weight so far */
static void judge(struct cb_training_verdict *verdict, const struct cb_training_range *range,
                  uint8_t input, float x) {
    const float above = x - range->max, below = range->min - x;
    const float beyond = cb_max(above, below) - range->margin;
    ++verdict->extrapolated;
    if (beyond <= 0.0f) return;
    ++verdict->beyond;
    const float faded = beyond * range->inverse_fade;
    const float weight = faded < 1.0f ? 1.0f - faded : 0.0f; /* NaN: 0 */
    if (weight >= verdict->weight) return;
    const float slope = above > below ? -range->inverse_fade : range->inverse_fade;
    verdict->weight = weight;
    verdict->weight_slope = weight > 0.0f ? slope : 0.0f;
    verdict->weakest = input;
}

float cb_training_range_outside(const struct cb_training_range *range, uint8_t input, float x,
                                struct cb_training_verdict *verdict) {
    judge(verdict, range, input, x);
    return cb_clamp(x, range->min - range->margin, range->max + range->margin);
}
