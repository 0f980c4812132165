/* SPDX-License-Identifier: MIT */
#include "firmware/box/ceiling.h"

#include "firmware/config/config.h"
#include "firmware/config/grid.h"

_Static_assert(CB_MAX_CHANNELS <= 32, "one bit for each channel");

/* in : most > 0, or 0: no bound
 * out: *value <= most; true if it was larger */
static bool lower(float *value, float most) {
    if (!(most > 0.0f) || *value <= most) return false;
    *value = most;
    return true;
}

static bool lower_channel(struct cb_channel_config *channel, const struct cb_ceiling *ceiling) {
    bool lowered = lower(&channel->limit_um, ceiling->um);
    if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;
    /* a slope must reach zero within a second (load/tangent.c) */
    if (channel->is_slope && lower(&channel->limit_um, channel->slew_um_per_s)) lowered = true;
    if (channel->deadband_um > channel->limit_um) channel->deadband_um = channel->limit_um;
    cb_channel_derive(channel);
    return lowered;
}

uint32_t cb_ceiling_apply(struct cb_config *config, const struct cb_ceiling *ceiling) {
    uint32_t lowered = 0;
    config->ceiling_um = ceiling->um;
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        if (lower_channel(&config->channels[i], ceiling)) lowered |= 1u << i;
    return lowered;
}
