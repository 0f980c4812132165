/* SPDX-License-Identifier: MIT
 * Linear interpolation between support points, the compensation table of every control. */
#ifndef COMPBOX_MODELS_POLYLINE_H
#define COMPBOX_MODELS_POLYLINE_H

#include <stdint.h>

#include "models/ppoly.h"

/* in : x[count] strictly ascending, y[count], count >= 2; coefficients[2*(count-1)] and
 *      breaks[count] from the caller
 * out: the polyline as a piecewise polynomial of degree 1 */
void cb_polyline_to_ppoly(const float *x, const float *y, uint16_t count, float *breaks,
                          float *coefficients, struct cb_ppoly *curve);

#endif
