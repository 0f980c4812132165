/* SPDX-License-Identifier: MIT */
#include "firmware/config/derive.h"

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

static bool is_plain(const struct cb_term_config *term) {
    return term->type <= CB_TERM_POLYLINE && !(term->as.curve.reversal_mm > 0.0f);
}

static bool on_grid(const struct cb_config *config, const struct cb_grid *grid,
                    const struct cb_curve_config *curve) {
    if (curve->signal != grid->signal || curve->degree != grid->degree ||
        curve->spans != grid->spans)
        return false;
    for (unsigned i = 0; i <= curve->spans; ++i) {
        if (config->pool[curve->pool + i] != config->pool[grid->breaks + i]) return false;
    }
    return true;
}

/* in : term, a plain curve that is on no grid yet; room: where its grid's curves begin
 * Makes a grid of it and of all after it that are on it. out: how many they are */
static unsigned make_grid(struct cb_config *config, unsigned term, bool *placed,
                          struct cb_plain_curve *room) {
    struct cb_grid *grid = &config->grids[config->grids_count++];
    const struct cb_curve_config *first = &config->terms[term].as.curve;
    *grid = (struct cb_grid){.signal = first->signal,
                             .degree = first->degree,
                             .term = (uint8_t)term,
                             .spans_per_unit = first->spans_per_unit,
                             .spans = first->spans,
                             .breaks = first->pool};
    for (unsigned i = term; i < config->terms_count; ++i) {
        const struct cb_term_config *one = &config->terms[i];
        if (placed[i] || !is_plain(one) || !on_grid(config, grid, &one->as.curve)) continue;
        placed[i] = true;
        room[grid->curves++] = (struct cb_plain_curve){
            .coefficients = (uint16_t)(one->as.curve.pool + one->as.curve.spans + 1u),
            .term = (uint8_t)i,
            .output = one->first_output};
    }
    return grid->curves;
}

static void derive_terms(struct cb_config *config) {
    bool placed[CB_MAX_TERMS] = {false};
    unsigned curves = 0;
    config->grids_count = config->other_terms_count = 0;
    for (unsigned i = 0; i < config->terms_count; ++i) {
        if (!is_plain(&config->terms[i]))
            config->other_terms[config->other_terms_count++] = (uint8_t)i;
        else if (!placed[i])
            curves += make_grid(config, i, placed, config->plain_curves + curves);
    }
}

static void derive_outputs(struct cb_config *config) {
    for (unsigned i = 0; i < config->outputs_count; ++i)
        config->output_terms[i] = config->outputs[i].term;
}

static void derive_volumetric(struct cb_volumetric_config *volumetric) {
    volumetric->complete = true;
    for (unsigned k = 0; k < sizeof volumetric->error; ++k)
        volumetric->complete = volumetric->complete && volumetric->error[k] != CB_NONE;
}

void cb_config_derive(struct cb_config *config) {
    derive_signals(config);
    derive_measured(config);
    derive_lags(config);
    derive_terms(config);
    derive_outputs(config);
    config->applied_quarter_us = cb_profile_quarter_us(config);
    for (unsigned i = 0; i < cb_all_channels(config); ++i) cb_channel_derive(&config->channels[i]);
    for (unsigned i = 0; i < config->terms_count; ++i) {
        if (config->terms[i].type == CB_TERM_VOLUMETRIC)
            derive_volumetric(&config->terms[i].as.volumetric);
    }
}
