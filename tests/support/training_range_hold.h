/* SPDX-License-Identifier: MIT
 * Several inputs held one after the other, as a term of the box does it. In C and C++. */
#ifndef COMPBOX_TESTS_SUPPORT_TRAINING_RANGE_HOLD_H
#define COMPBOX_TESTS_SUPPORT_TRAINING_RANGE_HOLD_H

#include "models/training_range.h"

/* in : x[count]; NaN and the infinities are allowed
 * out: inside[count] (may be x itself) */
static inline struct cb_training_verdict hold_in_training_ranges(
    const struct cb_training_range *ranges, uint8_t count, const float *x, float *inside) {
    struct cb_training_verdict verdict = {1.0f, 0.0f, 0, 0, 0};
    for (uint8_t i = 0; i < count; ++i)
        inside[i] = cb_training_range_holds(&ranges[i], x[i])
                        ? x[i]
                        : cb_training_range_outside(&ranges[i], i, x[i], &verdict);
    return verdict;
}

#endif
