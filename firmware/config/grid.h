/* SPDX-License-Identifier: MIT
 * The grid of a channel: the values that its register can represent within its limit. */
#ifndef COMPBOX_FIRMWARE_CONFIG_GRID_H
#define COMPBOX_FIRMWARE_CONFIG_GRID_H

#include "firmware/config/channel.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Above this many units float32 is about as coarse as the register, so the output is not counted in
 * units. */
#define CB_FINEST_GRID 1048576.0f /* 2^20 */

/* One unit of the channel's register in µm; 0 for a float32, which has no such unit. */
static inline float cb_channel_raw_unit_um(const struct cb_channel_config *channel) {
    return cb_number_is_integer((enum cb_number_type)channel->type) ? channel->scale : 0.0f;
}

/* in : a channel with its derived fields set; any float, NaN counts as 0
 * out: the value in µm nearest to um that the channel's register can represent and whose size is <=
 *      limit */
static inline float cb_channel_nearest(const struct cb_channel_config *channel, float um) {
    const float unit_um = channel->unit_um;
    const float inside_um = um == um ? cb_clamp(um, -channel->most_um, channel->most_um) : 0.0f;
    if (!(unit_um > 0.0f)) return inside_um;
    const int32_t units = cb_round(inside_um / unit_um);
    const float value_um = (float)units * unit_um;
    if (cb_abs(value_um) <= channel->limit_um) return value_um;
    return (float)(units > 0 ? units - 1 : units + 1) * unit_um;
}

/* Sets the derived fields of a channel from its type, scale and limit. */
void cb_channel_derive(struct cb_channel_config *channel);

#endif
