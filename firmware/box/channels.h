/* SPDX-License-Identifier: MIT
 * Channels: what the box wants of each, and how it stands in the registers. */
#ifndef COMPBOX_FIRMWARE_BOX_CHANNELS_H
#define COMPBOX_FIRMWARE_BOX_CHANNELS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/box/limiter.h"
#include "firmware/config/config.h"

/* What the wishes of all channels amount to. */
struct cb_demand {
    bool excessive; /* one is beyond its error_um, or not a number */
    bool limited;   /* one is beyond its limit_um */
};

/* in : outputs[config->outputs_count] of the terms
 * out: wanted_um of every channel: -sum of its outputs, in the order of the file */
struct cb_demand cb_channels_want(const struct cb_config *config, const float *outputs,
                                  struct cb_channel_state *channels, struct cb_counters *counters);

/* What the mode makes of the wishes. */
enum cb_aim {
    CB_AIM_WANTED, /* compensate */
    CB_AIM_STAY,   /* keep the last outputs */
    CB_AIM_ZERO,   /* go to zero */
};

/* out: target_um[channels] for the limiter. Within the deadband of the last output that output is
 * the target, except that zero and the limit are always gone for exactly. */
void cb_channels_target(const struct cb_config *config, const struct cb_channel_state *channels,
                        enum cb_aim aim, float *target_um);

/* true when every output is zero. */
bool cb_channels_all_zero(const struct cb_config *config, const struct cb_channel_state *channels);

/* Puts all outputs into the write block: register = sign * output / scale. */
void cb_channels_encode(const struct cb_config *config, const struct cb_channel_state *channels,
                        uint16_t *registers);

/* in : registers of this channel's type, anywhere in a block of the PLC
 * out: the value in µm that they stand for; may be any float */
float cb_channel_decode(const struct cb_channel_config *channel, const uint16_t *registers);

#endif
