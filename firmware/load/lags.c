/* SPDX-License-Identifier: MIT
 * Lags of the section "signals": the signal that each follows, their order, and their ranges. */
#include "firmware/config/config.h"
#include "firmware/load/sections.h"
#include "models/power.h"

/* out: place of the key lag_of of the lag `index` */
static uint32_t followed_at(const struct cb_loader *loader, uint32_t signals, uint32_t index) {
    return cb_find_key(loader, cb_list_at(loader, signals, index), "lag_of");
}

static bool find_followed(struct cb_loader *loader, uint32_t signals, uint32_t index) {
    struct cb_config *config = loader->config;
    const uint32_t at = followed_at(loader, signals, index);
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    const uint8_t found =
        cb_find_name(config->signals, sizeof config->signals[0], config->signals_count, name);
    config->signals[index].lag_of = found;
    if (found != CB_NONE) return true;
    return cb_fail(loader, CB_ERROR_NAME, at, "no signal is called %o", at);
}

/* Sets range and maximum age of a lag from the signal that it follows. */
static bool take_range(struct cb_loader *loader, uint32_t signals, uint32_t index) {
    struct cb_signal_config *lag = &loader->config->signals[index];
    const struct cb_signal_config *signal = &loader->config->signals[lag->lag_of];
    lag->max_age_ms = signal->max_age_ms;
    lag->min = signal->min;
    lag->max = signal->max;
    if (lag->power == 1) return true;
    const struct cb_interval squares = cb_power_range(signal->min, signal->max, 2);
    lag->min = squares.min;
    lag->max = squares.max;
    if (lag->min < lag->max && lag->max <= cb_number_of(CB_MOST_NUMBER)) return true;
    return cb_fail(loader, CB_ERROR_RANGE, followed_at(loader, signals, index),
                   "the square of %s exceeds 1e9 or is constant; see its min and max",
                   signal->name);
}

/* out: true if the range of the signal is known: it is measured, or a lag in config->lags */
static bool is_placed(const struct cb_config *config, uint8_t signal) {
    if (config->signals[signal].source != CB_SOURCE_LAG) return true;
    for (uint32_t i = 0; i < config->lags_count; ++i) {
        if (config->lags[i] == signal) return true;
    }
    return false;
}

/* Moves the last of config->lags behind one with the same time constant, unless it would precede
 * the lag that it follows. Neighbours share their gains in every step (signals/lags.c). */
static void join_pace(struct cb_config *config) {
    const uint8_t last = (uint8_t)(config->lags_count - 1), lag = config->lags[last];
    const struct cb_signal_config *signals = config->signals;
    uint8_t to = last;
    while (to > 0 && signals[config->lags[to - 1]].tau_s != signals[lag].tau_s) {
        if (config->lags[to - 1] == signals[lag].lag_of) return;
        --to;
    }
    if (to == 0) return;
    for (uint8_t i = last; i > to; --i) config->lags[i] = config->lags[i - 1];
    config->lags[to] = lag;
}

/* Appends each lag whose signal is placed to config->lags.
 * out: true, *placed: at least one was appended; or false and a message */
static bool place_lags(struct cb_loader *loader, uint32_t signals, bool *placed) {
    struct cb_config *config = loader->config;
    *placed = false;
    for (uint8_t i = 0; i < config->signals_count; ++i) {
        if (is_placed(config, i) || !is_placed(config, config->signals[i].lag_of)) continue;
        if (!take_range(loader, signals, i)) return false;
        config->lags[config->lags_count++] = i;
        join_pace(config);
        *placed = true;
    }
    return true;
}

/* in : lag, one that could not be placed, so the chain of followed signals leads to a circle
 * out: false, and a message at a lag of that circle */
static bool refuse_circle(struct cb_loader *loader, uint32_t signals, uint8_t lag) {
    const struct cb_config *config = loader->config;
    for (uint32_t i = 0; i < config->signals_count; ++i) lag = config->signals[lag].lag_of;
    const uint32_t at = followed_at(loader, signals, lag);
    return cb_fail(loader, CB_ERROR_ORDER, at, "%o depends on this lag itself", at);
}

bool cb_resolve_lags(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    bool placed = true;
    for (uint32_t i = 0; i < config->signals_count; ++i) {
        const bool lag = config->signals[i].source == CB_SOURCE_LAG;
        if (lag && !find_followed(loader, at, i)) return false;
    }
    while (placed) {
        if (!place_lags(loader, at, &placed)) return false;
    }
    for (uint8_t i = 0; i < config->signals_count; ++i) {
        if (!is_placed(config, i)) return refuse_circle(loader, at, i);
    }
    return true;
}
