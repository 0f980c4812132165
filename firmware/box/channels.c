/* SPDX-License-Identifier: MIT */
#include "firmware/box/channels.h"

#include "firmware/config/config.h"
#include "firmware/config/grid.h"
#include "firmware/wire/number.h"
#include "models/num.h"

struct cb_demand cb_channels_want(const struct cb_config *config, const float *outputs,
                                  struct cb_channel_state *channels, struct cb_counters *counters) {
    struct cb_demand demand = {false, false};
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        float sum_um = 0.0f;
        for (unsigned k = 0; k < channel->sum_count; ++k) sum_um += outputs[channel->sum[k]];
        const bool limited = !(cb_abs(sum_um) <= channel->limit_um);
        channels[i].wanted_um = 0.0f - sum_um;
        if (!limited) continue;
        const bool excessive = !(cb_abs(sum_um) <= channel->error_um);
        ++counters->outputs_limited;
        ++channels[i].limited;
        channels[i].excessive += excessive;
        demand.limited = true;
        demand.excessive = demand.excessive || excessive;
    }
    return demand;
}

/* out: target of one channel in ACTIVE, before the limiter rounds and limits it */
static float wanted_target_um(const struct cb_channel_config *channel,
                              const struct cb_channel_state *state) {
    const float wanted_um = state->wanted_um;
    const bool near = cb_abs(wanted_um - state->output_um) <= channel->deadband_um;
    if (!near || cb_abs(wanted_um) >= channel->limit_um) return wanted_um;
    return cb_channel_nearest(channel, wanted_um) == 0.0f ? wanted_um : state->output_um;
}

void cb_channels_target(const struct cb_config *config, const struct cb_channel_state *channels,
                        enum cb_aim aim, float *target_um) {
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        switch (aim) {
            case CB_AIM_WANTED:
                target_um[i] = wanted_target_um(&config->channels[i], &channels[i]);
                break;
            case CB_AIM_STAY:
                target_um[i] = config->channels[i].is_slope ? 0.0f : channels[i].output_um;
                break;
            case CB_AIM_ZERO:
                target_um[i] = 0.0f;
                break;
        }
    }
}

bool cb_channels_all_zero(const struct cb_config *config, const struct cb_channel_state *channels) {
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        if (channels[i].output_um != 0.0f) return false;
    }
    return true;
}

bool cb_channels_hold_zero(const struct cb_config *config,
                           const struct cb_channel_state *channels) {
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        if (channels[i].possible_min_um != 0.0f || channels[i].possible_max_um != 0.0f)
            return false;
    }
    return true;
}

void cb_channels_encode(const struct cb_config *config, const struct cb_channel_state *channels,
                        uint16_t *registers) {
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        const float units = channels[i].output_um / channel->scale;
        const float number = (channel->sign < 0 ? -units : units) + 0.0f; /* never -0 */
        uint16_t *const place = registers + channel->reg;
        /* the quotient of a limit that takes the whole register may round to just above it */
        if (cb_number_encode(channel->type, number, place)) continue;
        const struct cb_range range = cb_number_range(channel->type);
        cb_number_encode(channel->type, cb_clamp(number, range.min, range.max), place);
    }
}

float cb_channel_decode(const struct cb_channel_config *channel, const uint16_t *registers) {
    const float um = cb_number_decode(channel->type, registers) * channel->scale;
    return channel->sign < 0 ? -um : um;
}
