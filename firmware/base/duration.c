/* SPDX-License-Identifier: MIT */
#include "firmware/base/duration.h"

/* A conversion from 64 bits would need a library. The result therefore counts units of 2^10 µs up
 * to 25 days, and units of 2^20 µs beyond. */
float cb_long_seconds(int64_t us) {
    const int64_t fine = us >> 10, coarse = us >> 20;
    if (fine <= INT32_MAX) return (float)(int32_t)fine * 1.024e-3f;
    return (float)(int32_t)(coarse < INT32_MAX ? coarse : INT32_MAX) * 1.048576f;
}
