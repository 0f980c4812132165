/* SPDX-License-Identifier: MIT */
#include "models/direction.h"

void cb_direction_start(struct cb_direction *direction, float x, float width) {
    direction->extreme = x + 0.5f * width;
    direction->blend = 0.0f;
    direction->sense = 1;
}

float cb_direction_step(struct cb_direction *direction, float x, float width) {
    const float sense = (float)direction->sense;
    const float back = (direction->extreme - x) * sense; /* distance back from the extreme */
    if (back <= 0.0f) {
        direction->extreme = x;
        direction->blend = sense;
    } else if (back >= width) {
        direction->extreme = x;
        direction->sense = (int8_t)-direction->sense;
        direction->blend = -sense;
    } else if (back == back) {
        direction->blend = sense * (1.0f - 2.0f * (back / width));
    }
    return direction->blend;
}

struct cb_curve_value cb_direction_blend(const struct cb_direction *direction, float width,
                                         struct cb_curve_value forward,
                                         struct cb_curve_value backward) {
    const float b = direction->blend;
    const float f = 0.5f * (1.0f + b), g = 0.5f * (1.0f - b);
    const float blending = b > -1.0f && b < 1.0f ? (forward.value - backward.value) / width : 0.0f;
    const struct cb_curve_value result = {f * forward.value + g * backward.value,
                                          f * forward.slope + g * backward.slope + blending,
                                          forward.outside || backward.outside};
    return result;
}
