/* SPDX-License-Identifier: MIT */
#include "firmware/config/derive.h"

#include "firmware/config/config.h"
#include "firmware/config/grid.h"
#include "firmware/config/profile.h"
#include "firmware/wire/number.h"
#include "models/num.h"

static void derive_signals(struct cb_config *config) {
    for (unsigned i = 0; i < config->signals_count; ++i) {
        struct cb_signal_config *signal = &config->signals[i];
        const bool limited = signal->max_rate_per_s > 0.0f;
        signal->rate_per_s = limited ? signal->max_rate_per_s : cb_float_of(0x7F800000u);
        signal->change_unit = cb_number_is_integer(signal->type) ? cb_abs(signal->scale) : 0.0f;
        signal->plain = signal->source == CB_SOURCE_PLC && !signal->leads;
    }
}

static void derive_measured(struct cb_config *config) {
    uint32_t age_ms = UINT32_MAX / 1000u;
    unsigned first = 0, end = (unsigned)config->signals_count - config->lags_count;
    config->plain_count = 0;
    for (unsigned i = 0; i < config->signals_count; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (signal->source == CB_SOURCE_LAG) continue;
        config->measured[signal->plain ? --end : first++] = (uint8_t)i;
        if (!signal->plain) continue;
        ++config->plain_count;
        if (signal->max_age_ms < age_ms) age_ms = signal->max_age_ms;
    }
    config->plain_age_us = age_ms * 1000u;
}

static void derive_lags(struct cb_config *config) {
    float tau_s = 0.0f; /* of no lag */
    uint8_t more = 0;
    for (unsigned i = config->lags_count; i-- > 0;) {
        const struct cb_signal_config *lag = &config->signals[config->lags[i]];
        more = (uint8_t)(lag->tau_s == tau_s ? more + 1u : 0u);
        config->lag_links[i] = (struct cb_lag_link){.lag = config->lags[i],
                                                    .of = lag->lag_of,
                                                    .squares = lag->power == 2,
                                                    .more = more,
                                                    .tau_s = lag->tau_s};
        tau_s = lag->tau_s;
    }
}

void cb_config_derive(struct cb_config *config) {
    derive_signals(config);
    derive_measured(config);
    derive_lags(config);
    config->applied_quarter_us = cb_profile_quarter_us(config);
    for (unsigned i = 0; i < cb_all_channels(config); ++i) cb_channel_derive(&config->channels[i]);
}
