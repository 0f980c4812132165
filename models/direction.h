/* SPDX-License-Identifier: MIT
 * Direction of travel for curves with a forward and a backward branch (backlash, lost motion).
 *
 * A play operator: after a reversal the blend moves from one branch to the other over a distance,
 * as the mechanism takes up its play. It is a function of the path only, not of time or velocity. A
 * standing or trembling axis therefore cannot move it, and it never steps. */
#ifndef COMPBOX_MODELS_DIRECTION_H
#define COMPBOX_MODELS_DIRECTION_H

#include <stdint.h>

#include "models/ppoly.h"

/* Plain data. `extreme` is the furthest position reached in the last direction of travel. It is
 * exactly an input position, so nothing accumulates and the same path gives the same blend. */
struct cb_direction {
    float extreme; /* unit of the position */
    float blend;   /* -1 backward … +1 forward */
    int8_t sense;  /* +1, -1 */
};

/* Starts with the direction unknown: blend 0, the mean of both branches. in: x finite, width >
 * 0. */
void cb_direction_start(struct cb_direction *direction, float x, float width);

/* in : x, the position; width > 0, the distance over which a reversal is blended (wider than a few
 *      ulp of x: at 14 m float32 resolves 1 µm). A NaN changes nothing.
 * out: the blend; +1 once x has moved forward by width, -1 once backward; |change| <= 2 |change of
 *      x| / width. */
float cb_direction_step(struct cb_direction *direction, float x, float width);

/* in : both branches at x
 * out: (1+b)/2 forward + (1-b)/2 backward, exactly one branch at b = +-1; its slope includes the
 *      blending while |b| < 1: + (forward - backward) / width */
struct cb_curve_value cb_direction_blend(const struct cb_direction *direction, float width,
                                         struct cb_curve_value forward,
                                         struct cb_curve_value backward);

#endif
