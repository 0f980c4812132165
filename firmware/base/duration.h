/* SPDX-License-Identifier: MIT
 * Durations as float32 seconds. */
#ifndef COMPBOX_FIRMWARE_BASE_DURATION_H
#define COMPBOX_FIRMWARE_BASE_DURATION_H

#include <stdint.h>

#include "models/num.h"

/* in : us > INT32_MAX
 * out: as cb_seconds() */
CB_COLD float cb_long_seconds(int64_t us);

/* in : us >= 0
 * out: seconds, relative error 1e-6; monotone, saturates at 71 years */
CB_INLINE float cb_seconds(int64_t us) {
    return us <= INT32_MAX ? (float)(int32_t)us * 1e-6f : cb_long_seconds(us);
}

/* out: a + b, saturated at UINT32_MAX, so that a growing time does not wrap. */
static inline uint32_t cb_add_us(uint32_t a_us, uint32_t b_us) {
    return b_us > UINT32_MAX - a_us ? UINT32_MAX : a_us + b_us;
}

#endif
