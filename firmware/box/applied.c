/* SPDX-License-Identifier: MIT */
#include "firmware/box/applied.h"

#include "firmware/base/duration.h"
#include "firmware/box/channels.h"
#include "firmware/config/config.h"
#include "firmware/config/grid.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* A real has no unit, and a PLC that moves it along straight lines rounds it otherwise. */
static const float FINEST_UM = 1e-3f;

/* A new quarter begins with the value that was sent last. */
static void begin_quarter(struct cb_applied_channel *state, float sent_um) {
    for (unsigned k = CB_SENT_SLOTS - 1; k > 0; --k) {
        state->sent_min_um[k] = state->sent_min_um[k - 1];
        state->sent_max_um[k] = state->sent_max_um[k - 1];
    }
    state->sent_min_um[0] = state->sent_max_um[0] = sent_um;
}

static void note(struct cb_applied_channel *state, float um) {
    state->sent_min_um[0] = cb_min(state->sent_min_um[0], um);
    state->sent_max_um[0] = cb_max(state->sent_max_um[0], um);
}

/* The straight line to a new tangent begins at the one before: at the new reference that is not the
 * value that was sent, once the axis has moved. A position that jumps makes no value beyond most_um
 * a sent one. */
static void note_line(struct cb_applied_channel *state, float sent_um, float slope_um_per_m,
                      float reference_mm, float most_um) {
    const float way_m = (reference_mm - state->line_reference_mm) * 1e-3f;
    const float there_um = state->line_um + state->line_slope_um_per_m * way_m;
    note(state, cb_clamp(there_um, -most_um, most_um));
    state->line_um = sent_um;
    state->line_slope_um_per_m = slope_um_per_m;
    state->line_reference_mm = reference_mm;
}

/* out: whether the newest quarter is over; then the next one begins */
static bool age_quarter(struct cb_applied_state *state, uint32_t elapsed_us, uint32_t quarter_us) {
    const uint32_t slot_us = cb_add_us(state->slot_us, elapsed_us);
    state->slot_us = slot_us < quarter_us ? slot_us : 0;
    return slot_us >= quarter_us;
}

/* The values that were sent of late, all slots together. */
struct interval {
    float low_um, high_um;
};

static struct interval sent_of_late(const struct cb_applied_channel *state) {
    struct interval sent = {state->sent_min_um[0], state->sent_max_um[0]};
    for (unsigned k = 1; k < CB_SENT_SLOTS; ++k) {
        sent.low_um = cb_min(sent.low_um, state->sent_min_um[k]);
        sent.high_um = cb_max(sent.high_um, state->sent_max_um[k]);
    }
    return sent;
}

/* in : um: any float; near_um: finite
 * out: false for what is not a number, too */
static bool is_within(float um, struct interval sent, float near_um) {
    return um >= sent.low_um - near_um && um <= sent.high_um + near_um;
}

/* Time outside, less a quarter of the time inside; 0 … most_us. */
static uint32_t outside_us(uint32_t before_us, bool inside, uint32_t elapsed_us, uint32_t most_us) {
    const uint32_t inside_us = elapsed_us / 4, outside_us = cb_add_us(before_us, elapsed_us);
    if (inside) return inside_us < before_us ? before_us - inside_us : 0;
    return outside_us < most_us ? outside_us : most_us;
}

/* Judges one channel by the value um that the PLC reports, any float. */
static void judge(const struct cb_config *config, unsigned index, struct cb_applied_channel *state,
                  struct cb_counters *counters, float um, uint32_t elapsed_us, bool judged) {
    const struct cb_channel_config *channel = &config->channels[index];
    const struct interval sent = sent_of_late(state);
    const float largest_um = cb_max(cb_abs(sent.low_um), cb_abs(sent.high_um));
    const float unit_um = cb_max(cb_channel_raw_unit_um(channel), FINEST_UM);
    const bool inside = is_within(um, sent, config->plc.deadband_um + unit_um + largest_um * 1e-6f);
    const bool bounded = cb_abs(um) <= cb_max(channel->error_um, largest_um) + unit_um;
    counters->applied_foreign += judged && !inside;
    const uint32_t most_us = 2 * config->applied_quarter_us;
    state->outside_us = judged ? outside_us(state->outside_us, inside, elapsed_us, most_us) : 0;
    if (bounded || inside)
        state->beyond = 0;
    else if (state->beyond < CB_BEYOND_READINGS)
        ++state->beyond;
}

/* Adds the verdict about channel i, which reports um. */
static void conclude(struct cb_applied_verdict *verdict, unsigned i,
                     const struct cb_applied_channel *state, float um, uint32_t quarter_us) {
    const bool foreign = state->beyond >= CB_BEYOND_READINGS;
    const bool unapplied = state->outside_us > quarter_us;
    if ((foreign && !verdict->foreign) || (unapplied && verdict->channel == CB_NONE)) {
        verdict->channel = (uint8_t)i;
        verdict->value_um = um;
    }
    verdict->foreign = verdict->foreign || foreign;
    verdict->unapplied = verdict->unapplied || unapplied;
}

void cb_applied_step(const struct cb_config *config, struct cb_applied_state *state,
                     struct cb_channel_state *channels, const float *reference_mm,
                     struct cb_counters *counters, const uint16_t *registers, uint32_t elapsed_us,
                     bool judged) {
    struct cb_applied_verdict verdict = {.channel = CB_NONE};
    const uint32_t quarter_us = config->applied_quarter_us;
    const bool over = age_quarter(state, elapsed_us, quarter_us);
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        struct cb_applied_channel *of = &state->channels[i];
        if (!channel->has_applied) continue;
        if (over) begin_quarter(of, channels[i].sent_um);
        note(of, channels[i].sent_um);
        if (channel->tangent && config->plc.interpolate_us > 0)
            note_line(of, channels[i].sent_um, channels[channel->slope].sent_um, reference_mm[i],
                      channel->error_um);
        if (!registers) continue;
        const float um = cb_channel_decode(channel, registers + channel->applied_reg);
        judge(config, i, of, counters, um, elapsed_us, judged);
        if (cb_is_finite(um)) channels[i].applied_um = um;
        conclude(&verdict, i, of, um, quarter_us);
    }
    if (registers) state->verdict = verdict;
}
