/* SPDX-License-Identifier: MIT
 * The cause of a reason: one signal, term or channel, if there is such a one. */
#include "firmware/base/duration.h"
#include "firmware/box/box.h"
#include "models/num.h"

static const struct cb_cause NO_CAUSE = {CB_CAUSE_NONE, 0, 0.0f, 0.0f};

/* in : index, a measured signal that is not fresh */
static struct cb_cause of_signal(const struct cb_box *box, uint8_t index) {
    const struct cb_signal_config *signal = &box->config.signals[index];
    const struct cb_signal_state *state = &box->signals[index];
    const float bounds[] = {[CB_CAUSE_BELOW] = signal->min,
                            [CB_CAUSE_ABOVE] = signal->max,
                            [CB_CAUSE_FAST] = signal->rate_per_s,
                            [CB_CAUSE_NO_NUMBER] = 0.0f};
    if (state->doubted)
        return (struct cb_cause){CB_CAUSE_DOUBTED, index, state->value, state->expected};
    if (state->refusal != CB_CAUSE_NONE)
        return (struct cb_cause){state->refusal, index, state->refused, bounds[state->refusal]};
    const float age_ms = cb_seconds(box->life.now_us - state->time_us) * 1000.0f;
    const uint8_t kind = state->known ? CB_CAUSE_STALE : CB_CAUSE_NEVER;
    return (struct cb_cause){kind, index, state->known ? age_ms : 0.0f, (float)signal->max_age_ms};
}

/* out: index; of a lag that of the signal behind it */
static uint8_t source_of(const struct cb_box *box, uint8_t index) {
    for (unsigned deep = 0; deep < box->config.lags_count; ++deep) {
        if (box->config.signals[index].source != CB_SOURCE_LAG) break;
        index = box->config.signals[index].lag_of % CB_MAX_SIGNALS;
    }
    return index;
}

/* out: the first essential signal that is not fresh; of a lag the signal behind it */
static struct cb_cause of_essentials(const struct cb_box *box) {
    for (unsigned i = 0; i < box->config.signals_count; ++i) {
        const struct cb_signal_config *signal = &box->config.signals[i];
        if (!signal->essential || box->signals[i].fresh) continue;
        return of_signal(box, source_of(box, (uint8_t)i));
    }
    return NO_CAUSE;
}

/* out: the first signal of a term, itself or behind a lag, that the other sensors contradict;
 *      CB_NONE: there is none */
static uint8_t doubted_of(const struct cb_box *box, const struct cb_term_config *term) {
    unsigned count;
    const uint8_t *signals = cb_term_signals(&box->config, term, &count);
    for (unsigned k = 0; k < count; ++k) {
        if (signals[k] == CB_NONE) continue;
        const uint8_t index = source_of(box, signals[k]);
        if (box->signals[index].doubted) return index;
    }
    return CB_NONE;
}

/* out: the first doubted sensor of a faded term; else the first faded term */
static struct cb_cause of_terms(const struct cb_box *box) {
    struct cb_cause first = NO_CAUSE;
    for (unsigned i = 0; i < box->config.terms_count; ++i) {
        if (box->terms[i].live) continue;
        const uint8_t doubted = doubted_of(box, &box->config.terms[i]);
        if (doubted != CB_NONE) return of_signal(box, doubted);
        if (first.kind == CB_CAUSE_NONE)
            first = (struct cb_cause){CB_CAUSE_FADED, (uint8_t)i, 0.0f, 0.0f};
    }
    return first;
}

static struct cb_cause of_probes(const struct cb_box *box) {
    const unsigned i = cb_probes_drifted(&box->config, box->probes);
    if (i == CB_NONE) return NO_CAUSE;
    return (struct cb_cause){CB_CAUSE_DRIFTED, box->config.adapts[i],
                             cb_adapt_cusum(&box->probes[i].filter), CB_ADAPT_DRIFTED};
}

/* in : kind, CB_CAUSE_DEMAND or CB_CAUSE_LIMITED. out: the first channel beyond that bound */
static struct cb_cause of_demand(const struct cb_box *box, uint8_t kind) {
    for (unsigned i = 0; i < box->config.channels_count; ++i) {
        const struct cb_channel_config *channel = &box->config.channels[i];
        const float bound = kind == CB_CAUSE_DEMAND ? channel->error_um : channel->limit_um;
        const float wanted_um = box->channels[i].wanted_um;
        if (!(cb_abs(wanted_um) <= bound))
            return (struct cb_cause){kind, (uint8_t)i, wanted_um, bound};
    }
    return NO_CAUSE;
}

/* out: the channel whose applied value is not the box's, with the value that the PLC reported; its
 *      bound is the value sent last */
static struct cb_cause of_applied(const struct cb_box *box) {
    const struct cb_applied_verdict *found = &box->applied.verdict;
    if (found->channel >= CB_MAX_CHANNELS) return NO_CAUSE;
    return (struct cb_cause){CB_CAUSE_UNAPPLIED, found->channel, found->value_um,
                             box->channels[found->channel].sent_um};
}

struct cb_cause cb_box_find_cause(const struct cb_box *box) {
    switch (box->mode.reason) {
        case CB_REASON_SIGNAL:
            return of_essentials(box);
        case CB_REASON_DEGRADED:
            return of_terms(box);
        case CB_REASON_LIMITED:
            return of_demand(box, CB_CAUSE_LIMITED);
        case CB_REASON_MODEL_DRIFTED:
            return of_probes(box);
        case CB_REASON_UNAPPLIED:
        case CB_REASON_FOREIGN:
            return of_applied(box);
        case CB_REASON_DEMAND:
            return of_demand(box, CB_CAUSE_DEMAND);
        default: /* the other reasons have no single signal, term or channel */
            return NO_CAUSE;
    }
}
