/* SPDX-License-Identifier: MIT
 * A curve asked as by one who has not been near: its span is searched. In C and C++. */
#ifndef COMPBOX_TESTS_SUPPORT_PPOLY_SEARCH_H
#define COMPBOX_TESTS_SUPPORT_PPOLY_SEARCH_H

#include "models/ppoly.h"

/* in : x inside the breaks */
static inline uint16_t searched_span(const struct cb_ppoly *curve, float x) {
    uint16_t span = UINT16_MAX;
    cb_ppoly_elsewhere(curve, x, &span);
    return span;
}

static inline float searched_value(const struct cb_ppoly *curve, float x) {
    uint16_t span = UINT16_MAX;
    return cb_ppoly_elsewhere(curve, x, &span).value;
}

#endif
