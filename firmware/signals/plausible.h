/* SPDX-License-Identifier: MIT
 * Which values a signal can have: the one rule of range and rate, for the box and for the tools. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_PLAUSIBLE_H
#define COMPBOX_FIRMWARE_SIGNALS_PLAUSIBLE_H

#include <stdbool.h>

#include "firmware/config/signal.h"
#include "models/num.h"

/* Within min … max. The roundings of raw, scale, their product and the sum with zero, 2^-24 each,
 * may carry a value past the end: a machine that rests there is not implausible. */
static inline bool cb_signal_in_range(const struct cb_signal_config *signal, float value) {
    const float largest = cb_max(cb_abs(signal->min), cb_abs(signal->max)) + cb_abs(signal->zero);
    const float slack = 2.5e-7f * largest;
    return value >= signal->min - slack && value <= signal->max + slack; /* false for NaN */
}

/* in : a configuration that is derived (config/derive.h); change finite; elapsed_s >= 0 since the
 *      last accepted value
 * out: true when the value moved faster than anything of its kind can; without a limit the right
 *      side is infinity, or at elapsed_s = 0 NaN: false */
CB_INLINE bool cb_signal_too_fast(const struct cb_signal_config *signal, float change,
                                  float elapsed_s) {
    return cb_abs(change) > signal->rate_per_s * elapsed_s + signal->change_unit;
}

#endif
