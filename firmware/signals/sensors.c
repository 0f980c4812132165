/* SPDX-License-Identifier: MIT */
#include "firmware/signals/sensors.h"

#include "firmware/base/assert.h"
#include "firmware/base/duration.h"
#include "firmware/config/config.h"
#include "models/num.h"

/* One sensor in one comparison. */
struct comparison {
    const struct cb_signal_config *limits;
    const struct cb_signal_state *signal;
    unsigned j;
    float center, own; /* own: P_jj > 0 */
};

static bool is_doubted(const struct cb_sensors_state *state, unsigned j) {
    return (state->doubted >> j & 1u) != 0;
}

/* out: number of doubted sensors */
static unsigned doubts(const struct cb_sensors_state *state) {
    unsigned count = 0;
    for (uint32_t rest = state->doubted; rest != 0; rest &= rest - 1u) ++count;
    return count;
}

/* out: (P d)_j */
static float residual_of(const struct cb_config *config, const struct cb_sensors_state *state,
                         unsigned j) {
    const unsigned count = config->sensors_count;
    const float *row = config->pool + config->sensors.pool + count + j * count;
    float sum = 0.0f;
    for (unsigned k = 0; k < count; ++k) sum += row[k] * state->away[k];
    return sum;
}

/* A sensor without a reading of its own takes what the others predict, inside its range. */
static void predict(struct cb_sensors_state *state, const struct comparison *at, float residual) {
    state->away[at->j] = cb_clamp(state->away[at->j] - residual / at->own,
                                  at->limits->min - at->center, at->limits->max - at->center);
}

/* out: time for which this pass counts: half of after_us at most, so that a single reading decides
 *      nothing */
static uint32_t time_of(const struct cb_config *config, const struct cb_sensors_state *state) {
    const uint32_t most_us = config->sensors.after_us / 2u;
    return state->elapsed_us < most_us ? state->elapsed_us : most_us;
}

/* A doubted sensor that agrees with the others for long enough, within half of the threshold, is
 * trusted again. A pass outside of that takes back as much as CB_SENSORS_TRUST inside have given,
 * because noise leaves it now and then; one beyond the threshold takes all. */
static void try_to_trust(const struct cb_config *config, struct cb_sensors_state *state,
                         const struct comparison *at, bool recent) {
    const float gap = at->signal->value - at->center - state->away[at->j];
    const float square = gap * gap * at->own, most = config->sensors.threshold_square;
    const uint32_t pass_us = time_of(config, state);
    uint32_t agreed_us = state->us[at->j];
    if (recent && square < 0.25f * most)
        agreed_us += pass_us / CB_SENSORS_TRUST;
    else if (recent && square < most && agreed_us > pass_us)
        agreed_us -= pass_us;
    else
        agreed_us = 0;
    const bool trusted = agreed_us >= config->sensors.after_us;
    if (trusted) state->doubted &= ~(1u << at->j);
    state->us[at->j] = trusted ? 0 : agreed_us;
}

/* Takes the readings of all sensors, so that one pass compares values of one moment. What a sensor
 * gave last accuses the others until its prediction has taken its place: a pass in which one stops
 * reading counts for no time, and judges nobody. */
static void begin_pass(const struct cb_config *config, const struct cb_signal_state *signals,
                       struct cb_sensors_state *state, int64_t since_us, int64_t now_us) {
    const float *center = config->pool + config->sensors.pool;
    const uint32_t read = state->reads;
    state->reads = 0;
    for (unsigned j = 0; j < config->sensors_count; ++j) {
        const unsigned index = config->sensors.signal[j];
        const struct cb_signal_state *signal = &signals[index];
        if (is_doubted(state, j) || !cb_signal_is_recent(&config->signals[index], signal, now_us))
            continue;
        state->reads |= 1u << j;
        state->away[j] = signal->value - center[j];
    }
    state->elapsed_us = since_us < (int64_t)UINT32_MAX ? (uint32_t)since_us : UINT32_MAX;
    if ((read & ~state->reads) != 0) state->elapsed_us = 0;
    state->pass_us = now_us;
    state->next = 0;
    state->worst = 0;
    state->worst_square = 0.0f;
}

/* Compares sensor j with all others, or predicts it if it does not read. */
static void compare(const struct cb_config *config, const struct cb_signal_state *signals,
                    struct cb_sensors_state *state, unsigned j, int64_t now_us) {
    const unsigned index = config->sensors.signal[j], count = config->sensors_count;
    const float *pool = config->pool + config->sensors.pool;
    const struct comparison at = {.limits = &config->signals[index],
                                  .signal = &signals[index],
                                  .j = j,
                                  .center = pool[j],
                                  .own = pool[count + j * count + j]};
    const float residual = residual_of(config, state, j);
    const bool reads = (state->reads >> j & 1u) != 0;
    const float square = reads ? residual * residual / at.own : 0.0f;
    if (!reads) predict(state, &at, residual);
    if (square > state->worst_square) {
        state->worst_square = square;
        state->worst = (uint8_t)j;
    }
    if (is_doubted(state, j))
        try_to_trust(config, state, &at, cb_signal_is_recent(at.limits, at.signal, now_us));
    else
        state->us[j] = square > config->sensors.threshold_square
                           ? cb_add_us(state->us[j], time_of(config, state))
                           : 0;
}

/* Doubts the sensor with the largest residual, if it has disagreed for long enough. Its prediction
 * takes its place at once, and the others are compared anew. */
static void judge(const struct cb_config *config, const struct cb_signal_state *signals,
                  struct cb_sensors_state *state, struct cb_counters *counters, int64_t now_us) {
    const unsigned count = config->sensors_count;
    const bool wrong = state->elapsed_us > 0 &&
                       state->worst_square > config->sensors.threshold_square &&
                       state->us[state->worst] >= config->sensors.after_us;
    if (!wrong || 3u * (doubts(state) + 1u) > count) return;
    for (unsigned j = 0; j < count; ++j) {
        if (!is_doubted(state, j)) state->us[j] = 0;
    }
    state->doubted |= 1u << state->worst;
    state->reads &= ~(1u << state->worst);
    compare(config, signals, state, state->worst, now_us);
    ++counters->sensors_doubted;
}

/* Begins a pass, or goes on with it, as the time asks for. */
static void go_on(const struct cb_config *config, const struct cb_signal_state *signals,
                  struct cb_sensors_state *state, struct cb_counters *counters, int64_t now_us) {
    const unsigned count = config->sensors_count;
    const bool none = state->pass_us == 0 || now_us < state->pass_us;
    const int64_t since_us = none ? 0 : now_us - state->pass_us;
    const bool begins = none || state->next >= count;
    if (begins && !none && since_us < CB_SENSORS_PASS_US) return;
    if (begins) begin_pass(config, signals, state, since_us, now_us);
    const bool late = since_us >= (begins ? 2 : 1) * (int64_t)CB_SENSORS_PASS_US;
    do {
        compare(config, signals, state, state->next, now_us);
    } while (++state->next < count && late);
    if (state->next == count) judge(config, signals, state, counters, now_us);
}

/* Marks the signals of doubted sensors, and no others. Without a streak a PLC signal takes the full
 * path of accepting and ageing (accept_plc() in signals.c), which knows of doubts. */
static void mark(const struct cb_config *config, const struct cb_sensors_state *state,
                 struct cb_signal_state *signals) {
    for (unsigned j = 0; j < config->sensors_count; ++j) {
        struct cb_signal_state *signal = &signals[config->sensors.signal[j]];
        signal->doubted = is_doubted(state, j);
        if (!signal->doubted) continue;
        signal->streak = 0;
        signal->expected = config->pool[config->sensors.pool + j] + state->away[j];
    }
}

void cb_sensors_watch(const struct cb_config *config, struct cb_signal_state *signals,
                      struct cb_sensors_state *state, struct cb_counters *counters,
                      int64_t now_us) {
    CB_ASSERT(config->sensors_count > 0);
    CB_ASSERT(config->sensors_count <= CB_MAX_SENSORS);
    go_on(config, signals, state, counters, now_us);
    mark(config, state, signals);
}
