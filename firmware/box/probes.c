/* SPDX-License-Identifier: MIT */
#include "firmware/box/probes.h"

#include "firmware/base/assert.h"
#include "firmware/base/duration.h"
#include "firmware/config/config.h"
#include "models/num.h"

void cb_probes_start(struct cb_probe_state *probes) {
    for (unsigned i = 0; i < CB_MAX_ADAPTS; ++i) {
        probes[i] = (struct cb_probe_state){.timed = false};
        cb_adapt_start(&probes[i].filter);
    }
}

bool cb_probes_ask(const struct cb_config *config, const struct cb_probe_state *probes) {
    for (unsigned i = 0; i < config->adapts_count; ++i) {
        if (probes[i].filter.asked) return true;
    }
    return false;
}

unsigned cb_probes_drifted(const struct cb_config *config, const struct cb_probe_state *probes) {
    for (unsigned i = 0; i < config->adapts_count; ++i) {
        if (cb_adapt_cusum(&probes[i].filter) > CB_ADAPT_DRIFTED) return i;
    }
    return CB_NONE;
}

void cb_probe_resume(const struct cb_config *config, unsigned index,
                     const struct cb_probe_state *state, struct cb_probe_state *probe) {
    CB_ASSERT(index < config->adapts_count);
    *probe = *state;
    probe->counted = false;
    cb_adapt_resume(&config->terms[config->adapts[index]].as.adapt.settings, &probe->filter);
}

/* Lets the covariance grow until now. A clock that went back lets no time pass. */
static void pass_time(const struct cb_adapt_settings *settings, struct cb_probe_state *probe,
                      int64_t now_us) {
    const int64_t us = now_us - probe->grown_us;
    if (probe->timed && us > 0) cb_adapt_wait(settings, &probe->filter, cb_seconds(us) / 3600.0f);
    probe->grown_us = now_us;
    probe->timed = true;
}

float cb_probe_sigma(const struct cb_config *config, unsigned index,
                     const struct cb_probe_state *probe, const struct cb_sigma_state *sigma,
                     const float *outputs, int64_t now_us) {
    CB_ASSERT(index < config->adapts_count);
    const struct cb_adapt_config *adapt = &config->terms[config->adapts[index]].as.adapt;
    const struct cb_sigma model = cb_sigma_of(config, sigma, adapt->output);
    struct cb_probe_state now = *probe;
    pass_time(&adapt->settings, &now, now_us);
    return cb_adapt_sigma(&now.filter, outputs[adapt->output], &model);
}

/* Reads the count. One that fell began anew with its PLC: it is a reference, as the first one is.
 * out: true if there is a new measurement */
static bool is_new(const struct cb_signal_state *count, struct cb_probe_state *probe) {
    if (!count->fresh || count->refusal != CB_CAUSE_NONE) {
        probe->counted = false;
        return false;
    }
    const uint16_t was = probe->count, now = (uint16_t)(int32_t)count->value;
    const bool counted = probe->counted;
    probe->count = now;
    probe->counted = true;
    const uint16_t rise = (uint16_t)(now - was);
    if (!counted || rise == 0 || rise > INT16_MAX) return false;
    probe->skipped += rise - 1u;
    return true;
}

/* The value of a probe without what the box knows of it; or that it is not comparable. */
struct comparison {
    float um;
    bool good;
};

/* in : channel, whose sum has the output `own`
 * out: value_um less the other terms of the sum; good if all of them are live */
static struct comparison without_others(const struct cb_config *config,
                                        const struct cb_channel_config *channel, uint8_t own,
                                        const float *terms, const struct cb_term_state *states,
                                        float value_um) {
    struct comparison rest = {value_um, true};
    for (unsigned k = 0; k < channel->sum_count; ++k) {
        const uint8_t output = channel->sum[k];
        if (output == own) continue;
        rest.um -= terms[output];
        rest.good = rest.good && states[config->output_terms[output]].live;
    }
    return rest;
}

/* in : a measurement of the channel with that index
 * out: value_um less the displacement that the PLC applies; good if it is known within sigma_um */
static struct comparison without_output(const struct cb_config *config, unsigned index,
                                        const struct cb_probe_outputs *outputs, float sigma_um,
                                        float value_um) {
    const struct cb_channel_config *channel = &config->channels[index];
    const struct cb_channel_state *state = &outputs->channels[index];
    if (channel->has_applied && !channel->tangent)
        return (struct comparison){value_um - state->applied_um,
                                   outputs->reported && outputs->applied[index].beyond == 0};
    const float um = state->output_um;
    const float off_um = cb_max(state->possible_max_um - um, um - state->possible_min_um);
    return (struct comparison){value_um - um, outputs->known && off_um <= sigma_um};
}

/* in : a measurement of the term `adapt`, whose output is `own`
 * out: the value that the model has to explain */
static struct comparison compare(const struct cb_config *config,
                                 const struct cb_adapt_config *adapt, uint8_t own,
                                 const struct cb_signal_state *signals,
                                 const struct cb_probe_outputs *outputs,
                                 const struct cb_term_state *states) {
    const struct cb_signal_state *value = &signals[adapt->signals[0]];
    struct comparison all = {value->value, value->fresh && value->refusal == CB_CAUSE_NONE};
    all.good = all.good && states[config->output_terms[adapt->output]].live;
    const uint8_t index = cb_adapt_channel(adapt);
    if (index == CB_NONE || !all.good) return all;
    const struct comparison own_error =
        cb_adapt_is_whole(adapt)
            ? all
            : without_output(config, index, outputs, adapt->settings.sigma_um, all.um);
    if (!own_error.good) return own_error;
    return without_others(config, &config->channels[index], own, outputs->terms, states,
                          own_error.um);
}

/* Counts what became of a measurement. */
static void note(struct cb_probe_state *probe, struct cb_counters *counters, bool taken,
                 bool asked) {
    probe->taken += taken;
    probe->asked += asked;
    probe->refused += !taken && !asked;
    counters->probes_taken += taken;
    counters->probes_asked += asked;
    counters->probes_refused += !taken && !asked;
}

/* One measurement of the term with index `term`. */
static void take(const struct cb_config *config, unsigned term,
                 const struct cb_signal_state *signals, const struct cb_probe_outputs *outputs,
                 struct cb_term_state *states, struct cb_probe_state *probe,
                 struct cb_counters *counters) {
    const struct cb_adapt_config *adapt = &config->terms[term].as.adapt;
    const uint8_t own = config->terms[term].first_output;
    const struct comparison error = compare(config, adapt, own, signals, outputs, states);
    if (!error.good) {
        note(probe, counters, false, false);
        return;
    }
    const struct cb_sigma model = cb_sigma_of(config, outputs->sigma, adapt->output);
    const enum cb_adapt_outcome outcome = cb_adapt_probe(&adapt->settings, &probe->filter, error.um,
                                                         outputs->terms[adapt->output], &model);
    note(probe, counters, cb_adapt_was_taken(outcome), outcome == CB_ADAPT_ASK);
    states[term].adapted.to_bias_um = probe->filter.bias_um;
    states[term].adapted.to_gain = probe->filter.gain;
}

void cb_probes_step(const struct cb_config *config, const struct cb_signal_state *signals,
                    const struct cb_probe_outputs *outputs, struct cb_term_state *states,
                    struct cb_probe_state *probes, struct cb_counters *counters, int64_t now_us) {
    for (unsigned i = 0; i < config->adapts_count; ++i) {
        const unsigned term = config->adapts[i];
        const struct cb_adapt_config *adapt = &config->terms[term].as.adapt;
        struct cb_probe_state *probe = &probes[i];
        const bool first = !probe->timed;
        const bool measured = is_new(&signals[adapt->signals[1]], probe);
        if (first || measured) pass_time(&adapt->settings, probe, now_us);
        if (measured) take(config, term, signals, outputs, states, probe, counters);
    }
}
