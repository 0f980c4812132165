/* SPDX-License-Identifier: MIT */
#include "firmware/box/tangent.h"

#include "firmware/config/config.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* out: -dE/dP of the channel in µm/m; 0 if its output is at the limit */
static float wanted_slope(const struct cb_channel_config *channel, float wanted_um,
                          const float *slopes) {
    float sum = 0.0f; /* µm/mm */
    if (!(cb_abs(wanted_um) <= channel->limit_um)) return 0.0f;
    for (unsigned k = 0; k < channel->sum_count; ++k) sum += slopes[channel->sum[k]];
    const float slope = 0.0f - sum * 1000.0f;
    return cb_is_finite(slope) ? slope : 0.0f;
}

void cb_tangent_want(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *terms, const float *outputs,
                     struct cb_tangent_state *state, struct cb_channel_state *channels,
                     struct cb_counters *counters) {
    uint8_t known = CB_NONE; /* the signal of state->slopes */
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        if (!channel->tangent) continue;
        struct cb_channel_state *slope = &channels[channel->slope];
        const uint8_t signal = channel->tangent_signal;
        slope->wanted_um = 0.0f;
        if (!signals[signal].fresh) continue;
        if (signal != known)
            cb_terms_slopes(config, signals, terms, outputs, signal, state->slopes);
        known = signal;
        state->reference[i] = signals[signal].used;
        slope->wanted_um = wanted_slope(channel, channels[i].wanted_um, state->slopes);
        counters->slopes_limited +=
            cb_abs(slope->wanted_um) > config->channels[channel->slope].limit_um;
    }
}

void cb_tangent_encode(const struct cb_config *config, const struct cb_tangent_state *state,
                       uint16_t *registers) {
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        if (!channel->tangent) continue;
        const struct cb_range range = cb_number_range(channel->reference_type);
        const float number = state->reference[i] / channel->reference_scale + 0.0f;
        cb_number_encode(channel->reference_type, cb_clamp(number, range.min, range.max),
                         registers + channel->reference_reg);
    }
}
