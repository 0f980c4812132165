/* SPDX-License-Identifier: MIT
 * Channels: their demands, their targets, and their values in registers. */
#ifndef COMPBOX_FIRMWARE_BOX_CHANNELS_H
#define COMPBOX_FIRMWARE_BOX_CHANNELS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/box/limiter.h"

struct cb_config;
struct cb_channel_config;

/* Summary of the demands of all channels. */
struct cb_demand {
    bool excessive; /* a demand is beyond its error_um, or not a number */
    bool limited;   /* a demand is beyond its limit_um */
};

/* in : outputs[config->outputs_count] of the terms
 * out: wanted_um of every channel: -sum of its outputs, in the order of the file */
struct cb_demand cb_channels_want(const struct cb_config *config, const float *outputs,
                                  struct cb_channel_state *channels, struct cb_counters *counters);

/* What the outputs aim at, by mode. */
enum cb_aim {
    CB_AIM_WANTED, /* compensate */
    CB_AIM_STAY,   /* keep the last outputs */
    CB_AIM_ZERO,   /* go to zero */
};

/* out: target_um[channels] for the limiter. A demand within the deadband of the last output keeps
 *      that output, except that zero and the limit are always reached exactly. */
void cb_channels_target(const struct cb_config *config, const struct cb_channel_state *channels,
                        enum cb_aim aim, float *target_um);

/* out: true if every output is zero */
bool cb_channels_all_zero(const struct cb_config *config, const struct cb_channel_state *channels);

/* out: true if the PLC can hold nothing but zero: no late write (limiter.c) has another value */
bool cb_channels_hold_zero(const struct cb_config *config, const struct cb_channel_state *channels);

/* Puts all outputs into the write block: register = sign * output / scale. */
void cb_channels_encode(const struct cb_config *config, const struct cb_channel_state *channels,
                        uint16_t *registers);

/* in : registers of this channel's type, anywhere in a block of the PLC
 * out: their value in µm, any float */
float cb_channel_decode(const struct cb_channel_config *channel, const uint16_t *registers);

#endif
