/* SPDX-License-Identifier: MIT
 * A lag for any input: one that is not finite is replaced by the last one. In C and C++. */
#ifndef COMPBOX_TESTS_SUPPORT_LAG_STEP_H
#define COMPBOX_TESTS_SUPPORT_LAG_STEP_H

#include "models/lag.h"
#include "models/num.h"

static inline float lag_step(struct cb_lag *lag, struct cb_lag_gains gains, float u) {
    return cb_lag_step_to(lag, gains, cb_is_finite(u) ? u : lag->input);
}

#endif
