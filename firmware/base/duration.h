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
 * out: seconds, to 1e-6 of them; grows with us up to 71 years, and stays at that */
CB_INLINE float cb_seconds(int64_t us) {
    return us <= INT32_MAX ? (float)(int32_t)us * 1e-6f : cb_long_seconds(us);
}

/* out: a + b, at most UINT32_MAX: a time that is counted up for ever does not wrap. */
static inline uint32_t cb_add_us(uint32_t a_us, uint32_t b_us) {
    return b_us > UINT32_MAX - a_us ? UINT32_MAX : a_us + b_us;
}

#endif
