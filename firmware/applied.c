/* SPDX-License-Identifier: MIT */
#include "firmware/applied.h"

#include "firmware/channels.h"
#include "firmware/profile.h"
#include "models/num.h"

static uint32_t patience_us(const struct cb_config *config) {
    const uint32_t updates_us = CB_STEP_WINDOW_UPDATES * cb_profile_update_us(config);
    return updates_us > CB_UNAPPLIED_US ? updates_us : CB_UNAPPLIED_US;
}

/* out: time for which the channel has stood away from what was written */
static uint32_t standing_us(const struct cb_config *config, unsigned index,
                            const struct cb_channel_state *state, float applied_um,
                            uint32_t elapsed_us) {
    const float unit_um = config->channels[index].unit_um;
    const float near_um = config->plc.deadband_um + unit_um + cb_abs(state->sent_um) * 1e-6f;
    if (applied_um != state->applied_um) return 0;
    if (cb_abs(applied_um - state->sent_um) <= near_um) return 0;
    return elapsed_us > UINT32_MAX - state->standing_us ? UINT32_MAX
                                                        : state->standing_us + elapsed_us;
}

bool cb_applied_take(const struct cb_config *config, struct cb_channel_state *channels,
                     const uint16_t *registers, uint32_t elapsed_us, bool judged) {
    bool unapplied = false;
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        struct cb_channel_state *state = &channels[i];
        if (!channel->has_applied) continue;
        const float um = cb_channel_decode(channel, registers + channel->applied_reg);
        /* of a tangent K0 alone says little: the NC may have it at another reference */
        const bool compared = judged && !channel->tangent;
        state->standing_us = compared ? standing_us(config, i, state, um, elapsed_us) : 0;
        state->applied_um = um;
        unapplied = unapplied || state->standing_us > patience_us(config);
    }
    return unapplied;
}
