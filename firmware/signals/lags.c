/* SPDX-License-Identifier: MIT */
#include "firmware/signals/lags.h"

#include "firmware/base/duration.h"
#include "firmware/config/config.h"
#include "models/num.h"

/* Gains of the previous lag. Lags with one time constant are adjacent (load/lags.c), and mostly
 * follow signals of one reading. */
struct pace {
    int64_t elapsed_us;
    float tau_s;
    struct cb_lag_gains gains;
};

struct cb_lag_gains cb_lag_gains_over(int64_t elapsed_us, float tau_s) {
    return cb_lag_gains_for(elapsed_us > 0 ? cb_seconds(elapsed_us) : 0.0f, tau_s);
}

/* The first value of a lag is its steady state. */
CB_OUTLINE void start(struct cb_signal_state *state, float u) {
    cb_lag_start(&state->lag, u);
    state->settled = true;
}

/* Moves one lag to its signal's newest value, which is plausible and therefore finite. */
CB_INLINE void follow(const struct cb_lag_link *link, const struct cb_signal_config *lag,
                      const struct cb_signal_state *signal, float value,
                      struct cb_signal_state *state, struct pace *pace) {
    const float tau_s = link->tau_s, min = lag->min, max = lag->max;
    const float u = link->squares ? value * value : value;
    const int64_t elapsed_us = signal->time_us - state->time_us;
    state->time_us = signal->time_us;
    state->known = true;
    if (!state->settled) {
        start(state, u);
    } else if (elapsed_us != 0) {
        if (elapsed_us != pace->elapsed_us || tau_s != pace->tau_s)
            *pace = (struct pace){elapsed_us, tau_s, cb_lag_gains_over(elapsed_us, tau_s)};
        cb_lag_step_to(&state->lag, pace->gains, u);
    }
    state->value = cb_clamp(state->lag.hi, min, max);
}

/* As follow(), for a signal whose newest value is too old, missing or doubted. */
CB_OUTLINE void follow_stale(const struct cb_lag_link *link, const struct cb_signal_config *lag,
                             const struct cb_signal_state *signal, struct cb_signal_state *state,
                             struct cb_counters *counters) {
    struct pace own = {0};
    if (signal->known) follow(link, lag, signal, cb_signal_remembered(signal), state, &own);
    state->used = state->value;
    cb_signal_goes_stale(state, counters);
}

/* The usual case: the signal was accepted in this reading and the previous one, and the lag
 * followed both.
 * in : gains for the time between the two readings, which is at most tau / 64
 * out: as follow(). The lag stays inside min … max because its signal does: with 0 < ramp < gain <=
 *      1/64 the new value is a weighted mean of the old one and the two inputs, and each weight is
 *      far above the rounding of its share. */
CB_INLINE void follow_steady(const struct cb_lag_link *link, const struct cb_signal_state *signal,
                             struct cb_signal_state *state, struct cb_lag_gains gains) {
    const float u = link->squares ? signal->value * signal->value : signal->value;
    state->time_us = signal->time_us;
    state->value = state->used = cb_lag_step_to(&state->lag, gains, u);
}

/* Any lag in any step. out: whether it is fresh */
CB_OUTLINE bool follow_any(const struct cb_lag_link *link, const struct cb_signal_config *lag,
                           const struct cb_signal_state *signal, struct cb_signal_state *state,
                           struct pace *pace, struct cb_counters *counters) {
    state->streak = 0;
    if (!signal->fresh) { /* as old as its signal */
        follow_stale(link, lag, signal, state, counters);
        return false;
    }
    follow(link, lag, signal, signal->value, state, pace);
    state->used = state->value;
    if (signal->streak != 0 && state->value == state->lag.hi) state->streak = CB_STREAK_GOES;
    return state->fresh = true;
}

bool cb_lags_follow(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, int64_t since_us) {
    const struct cb_lag_link *link = config->lag_links, *const end = link + config->lags_count;
    bool essentials_fresh = true;
    struct pace pace = {0};
    while (link < end) {
        const struct cb_lag_link *const end_of_run = link + link->more + 1;
        struct cb_lag_gains gains = {0.0f, 0.0f};
        if (since_us > 0) gains = cb_lag_gains_over(since_us, link->tau_s);
        const unsigned steady = since_us > 0 && gains.gain <= 0.015625f ? CB_STREAK_GOES : 0;
        do {
            const struct cb_signal_state *signal = &states[link->of];
            struct cb_signal_state *state = &states[link->lag];
            if (signal->streak & state->streak & steady) {
                follow_steady(link, signal, state, gains);
            } else {
                const struct cb_signal_config *lag = &config->signals[link->lag];
                const bool fresh = follow_any(link, lag, signal, state, &pace, counters);
                if (!fresh && lag->essential) essentials_fresh = false;
            }
        } while (++link != end_of_run);
    }
    return essentials_fresh;
}
