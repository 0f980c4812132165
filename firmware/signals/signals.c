/* SPDX-License-Identifier: MIT */
#include "firmware/signals/signals.h"

#include "firmware/base/assert.h"
#include "firmware/base/duration.h"
#include "firmware/config/config.h"
#include "firmware/signals/lags.h"
#include "firmware/signals/plausible.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Number of signals up to the last one that is no lag. */
static inline unsigned measured(const struct cb_config *config) {
    return (unsigned)config->signals_count - config->lags_count;
}

void cb_signals_forget(const struct cb_config *config, struct cb_signal_state *states,
                       struct cb_counters *counters) {
    for (struct cb_signal_state *state = states; state != states + config->signals_count; ++state) {
        cb_signal_goes_stale(state, counters);
        state->value = state->velocity = state->used = 0.0f;
        state->known = false;
        state->streak = 0;
        state->refusal = CB_CAUSE_NONE;
    }
}

/* in : elapsed_us >= 0 since the last accepted value; converted only if there is a limit
 * out: false if the value changed faster than its maximum rate */
CB_INLINE bool rate_plausible(const struct cb_signal_config *signal, float change,
                              int64_t elapsed_us) {
    if (change == 0.0f || !(signal->rate_per_s <= FLT_MAX)) return true;
    return !cb_signal_too_fast(signal, change, cb_seconds(elapsed_us));
}

/* out: the velocity filtered over about three readings, because their times jitter. If the
 *      PLC's count gives the times, a change by more than a quarter of the velocity is accepted at
 * once: an axis starts and stops within a few readings */
static float next_velocity(float velocity, float change, float per_s, bool counted) {
    if (!(per_s > 0.0f)) return velocity;
    const float measured = change * per_s, jump = measured - velocity;
    const bool at_once = counted && cb_abs(jump) > 0.25f * cb_abs(measured);
    const float next = at_once ? measured : velocity + jump * (1.0f / 3.0f);
    return cb_is_finite(next) ? next : 0.0f;
}

/* Context of accepting a number: configuration, counters, time between the readings. */
struct acceptance {
    const struct cb_config *config;
    struct cb_counters *counters;
    struct cb_apart apart;
};

/* Velocity of values that are not from two consecutive readings; 0 after a gap. */
CB_OUTLINE float velocity_over(const struct cb_config *config, float velocity, float change,
                               int64_t elapsed_us) {
    if (elapsed_us > (int64_t)CB_LEAD_PERIODS * config->period_us) return 0.0f;
    const float per_s = elapsed_us > 0 ? 1.0f / cb_seconds(elapsed_us) : 0.0f;
    return next_velocity(velocity, change, per_s, false);
}

/* Counts a rejected number. out: false */
CB_COLD CB_OUTLINE bool refuse(const struct acceptance *to, struct cb_signal_state *state,
                               float value, enum cb_cause_kind why) {
    ++to->counters->samples_implausible;
    ++state->implausible;
    state->refusal = (uint8_t)why;
    state->refused = value;
    return false;
}

/* in : value valid at time_us; inside: the same clamped to min … max
 * out: true if accepted; false if its rate is implausible, which is counted */
CB_INLINE bool take(const struct acceptance *to, const struct cb_signal_config *signal,
                    struct cb_signal_state *state, float value, float inside, int64_t time_us) {
    const int64_t elapsed_us = time_us - state->time_us;
    const float change = value - state->value;
    if (state->known) {
        if (elapsed_us < 0 || !rate_plausible(signal, change, elapsed_us))
            return refuse(to, state, value, CB_CAUSE_FAST);
        if (signal->leads && elapsed_us == to->apart.elapsed_us)
            state->velocity =
                next_velocity(state->velocity, change, to->apart.per_s, to->apart.counted);
        else if (signal->leads)
            state->velocity = velocity_over(to->config, state->velocity, change, elapsed_us);
    }
    state->value = inside;
    state->time_us = time_us;
    state->refusal = CB_CAUSE_NONE;
    return state->known = true;
}

/* As take(), for a value outside min … max or at one of the ends. */
CB_OUTLINE bool take_at_end(const struct acceptance *to, const struct cb_signal_config *signal,
                            struct cb_signal_state *state, float value, int64_t time_us) {
    if (cb_signal_in_range(signal, value))
        return take(to, signal, state, value, cb_clamp(value, signal->min, signal->max), time_us);
    if (!(value == value)) return refuse(to, state, value, CB_CAUSE_NO_NUMBER);
    return refuse(to, state, value, value < signal->min ? CB_CAUSE_BELOW : CB_CAUSE_ABOVE);
}

/* Accepts one raw number that was valid at time_us, or counts it as implausible. */
CB_INLINE bool accept(const struct acceptance *to, const struct cb_signal_config *signal,
                      struct cb_signal_state *state, float raw, int64_t time_us) {
    const float value = raw * signal->scale + signal->zero;
    if (value > signal->min && value < signal->max)
        return take(to, signal, state, value, value, time_us);
    return take_at_end(to, signal, state, value, time_us);
}

/* Accepts the number of a PLC signal in any previous state. */
CB_OUTLINE void accept_reading(const struct acceptance *to, const struct cb_signal_config *signal,
                               struct cb_signal_state *state, float raw, int64_t read_us) {
    const uint8_t streak = CB_STREAK_BEGUN | (state->streak != 0 ? CB_STREAK_GOES : 0);
    state->streak = accept(to, signal, state, raw, read_us) ? streak : 0;
}

/* The common case: a plain signal that was accepted in the previous reading.
 * in : the reading is recent enough for every plain signal, and elapsed_s > 0 after the previous
 *      one
 * out: true: accepted and aged. false: nothing changed, use the full path */
CB_INLINE bool goes_on(const struct cb_signal_config *signal, struct cb_signal_state *state,
                       float raw, float elapsed_s, int64_t read_us) {
    const float value = raw * signal->scale + signal->zero;
    const float change = cb_abs(value - state->value);
    if (!(value > signal->min && value < signal->max)) return false;
    if (cb_signal_too_fast(signal, change, elapsed_s)) return false;
    state->value = state->used = value;
    state->time_us = read_us;
    state->fresh = true;
    state->streak = CB_STREAK_BEGUN | CB_STREAK_GOES;
    return true;
}

/* out: time from the previous good reading to that of read_us; 0: no usable previous reading */
static int64_t since_reading(const struct cb_config *config, const struct cb_signal_state *states,
                             int64_t read_us) {
    const uint8_t *const end = config->measured + measured(config);
    for (const uint8_t *index = config->measured; index < end; ++index) {
        if (states[*index].streak != 0) return read_us - states[*index].time_us;
    }
    return 0;
}

/* Accepts the PLC signals of a good reading. */
static struct cb_reading accept_plc(const struct acceptance *to, struct cb_signal_state *states,
                                    const struct cb_inputs *in, int64_t now_us) {
    const struct cb_config *const config = to->config;
    const int64_t since_us = since_reading(config, states, in->read_us);
    const bool smooth = since_us > 0 && now_us - in->read_us <= (int64_t)config->plain_age_us;
    const float elapsed_s = cb_seconds(since_us);
    const uint8_t *const end = config->measured + measured(config);
    unsigned plain = 0;
    for (const uint8_t *index = config->measured; index < end; ++index) {
        const struct cb_signal_config *signal = &config->signals[*index];
        struct cb_signal_state *state = &states[*index];
        if (signal->source != CB_SOURCE_PLC) continue;
        const float raw = cb_number_decode(signal->type, in->registers + signal->reg);
        if (smooth && signal->plain && state->streak != 0 &&
            goes_on(signal, state, raw, elapsed_s, in->read_us))
            ++plain;
        else
            accept_reading(to, signal, state, raw, in->read_us);
    }
    return (struct cb_reading){since_us, plain == config->plain_count};
}

/* out: true if its values are samples of sensors */
static bool is_sampled(const struct cb_signal_config *signal) {
    return signal->source == CB_SOURCE_CAN || signal->source == CB_SOURCE_BUS ||
           signal->source == CB_SOURCE_HAND;
}

struct cb_reading cb_signals_accept(const struct cb_config *config, struct cb_signal_state *states,
                                    struct cb_counters *counters, const struct cb_inputs *in,
                                    bool read, struct cb_apart apart, int64_t now_us) {
    const struct acceptance to = {config, counters, apart};
    const struct cb_reading reading =
        read ? accept_plc(&to, states, in, now_us) : (struct cb_reading){0, false};
    CB_ASSERT(in->sample_count <= CB_MAX_SAMPLES);
    for (unsigned k = 0; k < in->sample_count; ++k) {
        const struct cb_sample *sample = &in->samples[k];
        const unsigned i = sample->signal;
        if (i >= config->signals_count || !is_sampled(&config->signals[i]) ||
            sample->time_us > now_us) {
            ++counters->samples_unknown;
            continue;
        }
        accept(&to, &config->signals[i], &states[i], sample->raw, sample->time_us);
    }
    return reading;
}

/* Inputs of ageing, common to all signals. */
struct ageing {
    const struct cb_config *config;
    const struct cb_signal_state *states;
    int64_t now_us;
    float lead_s;
};

/* out: the PLC's velocity; if it has none, the one from differences of readings */
static inline float velocity(const struct ageing *ageing, const struct cb_signal_config *signal,
                             const struct cb_signal_state *state) {
    const struct cb_signal_config *source = &ageing->config->signals[signal->velocity];
    const struct cb_signal_state *reported = &ageing->states[signal->velocity];
    const bool usable =
        signal->velocity_scale > 0.0f && cb_signal_is_recent(source, reported, ageing->now_us);
    return usable ? reported->value * signal->velocity_scale : state->velocity;
}

/* Position of the signal one lead after its reading, inside its plausible range. */
static float ahead(const struct ageing *ageing, const struct cb_signal_config *signal,
                   const struct cb_signal_state *state) {
    const int64_t age_us = ageing->now_us - state->time_us;
    if (age_us > (int64_t)CB_LEAD_PERIODS * ageing->config->period_us) return state->value;
    const float value = state->value + velocity(ageing, signal, state) * ageing->lead_s;
    return cb_clamp(value, signal->min, signal->max);
}

/* Ages a measured signal and sets its value for the terms. out: true if it is fresh */
CB_INLINE bool age(const struct ageing *ageing, const struct cb_signal_config *signal,
                   struct cb_signal_state *state) {
    if (state->doubted || !cb_signal_is_recent(signal, state, ageing->now_us)) return false;
    state->used = signal->leads ? ahead(ageing, signal, state) : state->value;
    state->fresh = true;
    return true;
}

bool cb_signals_age(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, const struct cb_reading *reading,
                    uint32_t lead_us, int64_t now_us) {
    const struct ageing ageing = {config, states, now_us, cb_seconds(lead_us)};
    const unsigned done = reading->plain ? config->plain_count : 0;
    const uint8_t *const end = config->measured + measured(config) - done;
    bool essentials_fresh = true;
    for (const uint8_t *index = config->measured; index < end; ++index) {
        const struct cb_signal_config *signal = &config->signals[*index];
        struct cb_signal_state *state = &states[*index];
        if (age(&ageing, signal, state)) continue;
        cb_signal_goes_stale(state, counters);
        state->streak = 0; /* its lags are as old */
        essentials_fresh = essentials_fresh && !signal->essential;
    }
    return cb_lags_follow(config, states, counters, reading->since_us) && essentials_fresh;
}
