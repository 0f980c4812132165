/* SPDX-License-Identifier: MIT
 *
 * Rounding. In a segment with ends y0, y1, M = max(|y0|, |y1|), e = 2^-24, evaluation included:
 *
 *     |value - exact| <= 1.001 e (M + 5 |y1 - y0|)      |slope - exact| <= 3.001 e |exact slope|
 */
#include "models/polyline.h"

void cb_polyline_to_ppoly(const float *x, const float *y, uint16_t count, float *breaks,
                          float *coefficients, struct cb_ppoly *curve) {
    for (uint16_t i = 0; i < count; ++i) breaks[i] = x[i];
    for (uint16_t i = 0; i + 1 < count; ++i) {
        coefficients[2 * i] = y[i];
        coefficients[2 * i + 1] = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    }
    curve->breaks = breaks;
    curve->coefficients = coefficients;
    curve->spans = (uint16_t)(count - 1);
    curve->degree = 1;
    cb_ppoly_index(curve);
}
