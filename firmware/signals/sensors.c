/* SPDX-License-Identifier: MIT */
#include "firmware/signals/sensors.h"

#include "firmware/base/assert.h"
#include "firmware/config/config.h"
#include "models/num.h"

/* One sensor in one comparison. */
struct comparison {
    const struct cb_signal_config *limits;
    struct cb_signal_state *signal;
    struct cb_sensor_state *sensor;
    float center, own; /* own: P_jj > 0 */
    uint32_t elapsed_us;
};

/* out: (P d)_j */
static float residual_of(const struct cb_config *config, const struct cb_sensors_state *state,
                         unsigned j) {
    const unsigned count = config->sensors_count;
    const float *row = config->pool + config->sensors.pool + count + j * count;
    float sum = 0.0f;
    for (unsigned k = 0; k < count; ++k) sum += row[k] * state->sensors[k].away;
    return sum;
}

/* A sensor without a reading of its own takes what the others predict, inside its range. */
static void predict(const struct comparison *at, float residual) {
    at->sensor->away = cb_clamp(at->sensor->away - residual / at->own, at->limits->min - at->center,
                                at->limits->max - at->center);
}

/* Adds to the time, or starts it again. One comparison counts for half of after_us at most,
 * so a single reading decides nothing. */
static void count_time(struct cb_sensor_state *sensor, bool holds, uint32_t elapsed_us,
                       uint32_t after_us) {
    const uint32_t most = after_us / 2u;
    if (!holds) sensor->us = 0;
    if (holds) sensor->us += elapsed_us < most ? elapsed_us : most;
}

/* A doubted sensor that agrees with the others for long enough, within half of the threshold, is
 * trusted again. */
static void try_to_trust(const struct cb_config *config, struct cb_sensors_state *state,
                         const struct comparison *at, bool recent) {
    const float gap = at->signal->value - at->center - at->sensor->away;
    const uint32_t after_us = config->sensors.after_us;
    const bool agrees = recent && gap * gap * at->own < 0.25f * config->sensors.threshold_square;
    count_time(at->sensor, agrees, at->elapsed_us, after_us);
    if (at->sensor->us / CB_SENSORS_TRUST < after_us) return;
    at->signal->doubted = false;
    at->sensor->us = 0;
    --state->doubted;
}

/* Takes the readings of all sensors, so that one pass compares values of one moment. */
static void begin_pass(const struct cb_config *config, const struct cb_signal_state *signals,
                       struct cb_sensors_state *state, int64_t now_us) {
    const float *center = config->pool + config->sensors.pool;
    for (unsigned j = 0; j < config->sensors_count; ++j) {
        const unsigned index = config->sensors.signal[j];
        const struct cb_signal_state *signal = &signals[index];
        struct cb_sensor_state *sensor = &state->sensors[j];
        sensor->reads =
            !signal->doubted && cb_signal_is_recent(&config->signals[index], signal, now_us);
        if (sensor->reads) sensor->away = signal->value - center[j];
        if (state->pass_us == 0 || sensor->at_us > now_us) sensor->at_us = now_us;
    }
    state->pass_us = now_us;
    state->next = 0;
}

/* Compares sensor j with all others, or predicts it if it does not read. */
static void compare(const struct cb_config *config, struct cb_signal_state *signals,
                    struct cb_sensors_state *state, unsigned j, int64_t now_us) {
    const struct cb_sensors_config *sensors = &config->sensors;
    const unsigned index = sensors->signal[j], count = config->sensors_count;
    const float *pool = config->pool + sensors->pool;
    struct cb_sensor_state *const sensor = &state->sensors[j];
    const int64_t elapsed_us = now_us - sensor->at_us;
    const struct comparison at = {
        .limits = &config->signals[index],
        .signal = &signals[index],
        .sensor = sensor,
        .center = pool[j],
        .own = pool[count + j * count + j],
        .elapsed_us = elapsed_us < (int64_t)UINT32_MAX ? (uint32_t)elapsed_us : UINT32_MAX};
    const float residual = residual_of(config, state, j);
    sensor->at_us = now_us;
    sensor->square = sensor->reads ? residual * residual / at.own : 0.0f;
    if (!sensor->reads) predict(&at, residual);
    if (at.signal->doubted)
        try_to_trust(config, state, &at, cb_signal_is_recent(at.limits, at.signal, now_us));
    else
        count_time(sensor, sensor->square > sensors->threshold_square, at.elapsed_us,
                   sensors->after_us);
}

/* Doubts the sensor with the largest residual, if it has disagreed for long enough. Then the others
 * are compared anew, with its prediction in its place. */
static void judge(const struct cb_config *config, struct cb_signal_state *signals,
                  struct cb_sensors_state *state, struct cb_counters *counters) {
    const unsigned count = config->sensors_count;
    unsigned worst = 0;
    for (unsigned j = 1; j < count; ++j) {
        if (state->sensors[j].square > state->sensors[worst].square) worst = j;
    }
    const struct cb_sensor_state *const found = &state->sensors[worst];
    const bool wrong =
        found->square > config->sensors.threshold_square && found->us >= config->sensors.after_us;
    if (!wrong || 3u * (state->doubted + 1u) > count) return;
    for (unsigned j = 0; j < count; ++j) {
        if (!signals[config->sensors.signal[j]].doubted) state->sensors[j].us = 0;
    }
    signals[config->sensors.signal[worst]].doubted = true;
    ++state->doubted;
    ++counters->sensors_doubted;
}

/* A doubted PLC signal takes the full path of accepting and ageing (accept_plc() in signals.c). */
static void leave_the_streak(const struct cb_config *config, struct cb_signal_state *signals) {
    for (unsigned j = 0; j < config->sensors_count; ++j) {
        struct cb_signal_state *signal = &signals[config->sensors.signal[j]];
        if (signal->doubted) signal->streak = 0;
    }
}

void cb_sensors_watch(const struct cb_config *config, struct cb_signal_state *signals,
                      struct cb_sensors_state *state, struct cb_counters *counters,
                      int64_t now_us) {
    const unsigned count = config->sensors_count;
    CB_ASSERT(count <= CB_MAX_SENSORS);
    const bool none = state->pass_us == 0 || now_us < state->pass_us;
    const int64_t since_us = none ? 0 : now_us - state->pass_us;
    const bool begins = none || state->next >= count;
    if (state->doubted > 0) leave_the_streak(config, signals);
    if (begins && !none && since_us < CB_SENSORS_PASS_US) return;
    if (begins) begin_pass(config, signals, state, now_us);
    const bool late = since_us >= (begins ? 2 : 1) * (int64_t)CB_SENSORS_PASS_US;
    do {
        compare(config, signals, state, state->next, now_us);
    } while (++state->next < count && late);
    if (state->next == count) judge(config, signals, state, counters);
}

float cb_sensors_expected(const struct cb_config *config, const struct cb_sensors_state *state,
                          uint8_t signal) {
    for (unsigned j = 0; j < config->sensors_count; ++j) {
        if (config->sensors.signal[j] == signal)
            return config->pool[config->sensors.pool + j] + state->sensors[j].away;
    }
    return 0.0f;
}
