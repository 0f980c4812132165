/* SPDX-License-Identifier: MIT */
#include "firmware/base/counters.h"

const char *cb_counter_name(unsigned index) {
    static const char *const names[CB_COUNTERS_COUNT] = {
#define CB_X(name) #name,
        CB_COUNTERS(CB_X)
#undef CB_X
    };
    return index < CB_COUNTERS_COUNT ? names[index] : "unknown";
}
