/* SPDX-License-Identifier: MIT */
#include "firmware/config/grid.h"

#include <float.h>

#include "firmware/wire/number.h"
#include "models/num.h"

/* One unit of the channel's register in µm; 0 where it is as fine as float32. */
static float unit_um_of(const struct cb_channel_config *channel) {
    const bool counted =
        cb_number_is_integer(channel->type) && channel->limit_um < CB_FINEST_GRID * channel->scale;
    return counted ? channel->scale : 0.0f;
}

/* The limit, or slightly less where the output is not counted in units: division by the scale,
 * rounding and the PLC's multiplication could together exceed the limit. */
static float reachable_limit_um(const struct cb_channel_config *channel) {
    const bool as_is = channel->scale == 1.0f && !cb_number_is_integer(channel->type);
    const bool exact = channel->unit_um > 0.0f || as_is;
    return exact ? channel->limit_um : channel->limit_um * (1.0f - 1.0f / CB_FINEST_GRID);
}

void cb_channel_derive(struct cb_channel_config *channel) {
    channel->unit_um = unit_um_of(channel);
    channel->most_um = reachable_limit_um(channel);
    channel->top_um = cb_channel_nearest(channel, FLT_MAX);
}
