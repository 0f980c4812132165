/* SPDX-License-Identifier: MIT */
#include "firmware/signals/lead.h"

#include "firmware/config/config.h"
#include "firmware/config/profile.h"
#include "models/num.h"

enum {
    WINDOW_US = 1000000, /* window for counting beats: 8 ms are then known to 1 % */
    FILTER = 8,          /* weight of a new measurement: one eighth */
    FASTEST_US = 100     /* no PLC updates faster: a jump of the count is a restart */
};

/* The first measurement unchanged, later ones filtered. */
static uint32_t filtered(uint32_t was_us, uint32_t us) {
    if (was_us == 0) return us;
    const int32_t change_us = (int32_t)us - (int32_t)was_us;
    return (uint32_t)((int32_t)was_us + change_us / FILTER);
}

void cb_lead_take_exchange(struct cb_lead_state *state, uint32_t exchange_us) {
    if (exchange_us == 0 || exchange_us > CB_MAX_LEAD_US) return;
    state->exchange_us = filtered(state->exchange_us, exchange_us);
}

void cb_lead_take_heartbeat(struct cb_lead_state *state, uint16_t beats, int64_t elapsed_us) {
    if (elapsed_us <= 0 || elapsed_us > WINDOW_US) return;
    if ((int64_t)beats * FASTEST_US > elapsed_us) return;
    state->beats += beats;
    state->window_us += (uint32_t)elapsed_us;
    if (state->window_us < WINDOW_US) return;
    if (state->beats > 0) {
        const uint32_t us = state->window_us / state->beats, was_us = state->update_us;
        state->update_us = filtered(was_us, was_us > 0 && us > 2 * was_us ? 2 * was_us : us);
    }
    cb_lead_lose_heartbeat(state);
}

void cb_lead_lose_heartbeat(struct cb_lead_state *state) {
    state->beats = state->window_us = 0;
}

float cb_lead_apart_us(const struct cb_lead_state *state, uint16_t beats, uint32_t elapsed_us) {
    const float update_us = (float)state->update_us, read_us = (float)elapsed_us;
    const float apart_us = (float)beats * update_us;
    const bool counts = state->update_us > 0 && update_us <= 3.0f * read_us &&
                        cb_abs(apart_us - read_us) <= update_us;
    return counts ? apart_us : read_us;
}

uint32_t cb_lead_us(const struct cb_config *config, const struct cb_lead_state *state) {
    if (!config->lead_measured) return config->lead_us;
    const uint32_t line_us = config->plc.interpolate_us;
    const uint32_t waits_us = line_us > 0 ? state->update_us / 2 : state->update_us;
    const uint32_t lead_us = state->exchange_us + waits_us + (config->period_us + line_us) / 2 +
                             cb_profile_lead_us(config);
    return lead_us < CB_MAX_LEAD_US ? lead_us : CB_MAX_LEAD_US;
}
