/* SPDX-License-Identifier: MIT
 * Direction of travel for curves with a forward and a backward branch (backlash, lost motion).
 *
 * A play operator: the blend goes from one branch to the other over a distance after a reversal,
 * as the mechanism itself takes up its play. It is a function of the path only: no time, no
 * velocity, so that standing still or trembling cannot move it, and it never steps. */
#ifndef COMPBOX_MODELS_DIRECTION_H
#define COMPBOX_MODELS_DIRECTION_H

#include <stdint.h>

#include "models/ppoly.h"

/* Plain data. extreme is the furthest position reached in the direction last travelled (exactly a
 * position that was given), so nothing accumulates and the same path gives the same blend. */
struct cb_direction {
    float extreme; /* unit of the position */
    float blend;   /* -1 backward … +1 forward */
    int8_t sense;  /* +1, -1 */
};

/* Direction unknown: blend 0, the mean of both branches. in: x finite, width > 0. */
void cb_direction_start(struct cb_direction *direction, float x, float width);

/* in : x, the position; width > 0, the distance over which a reversal is blended (wider than a few
 *      ulp of x: at 14 m float32 resolves 1 µm). A NaN leaves everything as it is.
 * out: the blend; +1 once x has gone forward by width, -1 once backward;
 *      |change| <= 2 |change of x| / width. */
float cb_direction_step(struct cb_direction *direction, float x, float width);

/* in : both branches at x
 * out: (1+b)/2 forward + (1-b)/2 backward, exactly a branch at b = +-1, and its slope, in which the
 *      blending counts while it lasts: + (forward - backward) / width for |b| < 1 */
struct cb_curve_value cb_direction_blend(const struct cb_direction *direction, float width,
                                         struct cb_curve_value forward,
                                         struct cb_curve_value backward);

#endif
