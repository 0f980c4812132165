/* SPDX-License-Identifier: MIT
 * Reload without a step of the outputs: a freshly loaded box takes over from the running one. */
#include <string.h>

#include "firmware/base/assert.h"
#include "firmware/box/box.h"

/* in : arrays of CB_NAME_SIZE, which need not end with 0 */
static bool same_name(const char *a, const char *b) {
    for (unsigned i = 0; i < CB_NAME_SIZE; ++i) {
        if (a[i] != b[i]) return false;
        if (a[i] == 0) return true;
    }
    return true;
}

static unsigned find_signal(const struct cb_config *config, const char *name) {
    for (unsigned i = 0; i < config->signals_count; ++i) {
        if (same_name(config->signals[i].name, name)) return i;
    }
    return CB_NONE;
}

static unsigned find_output(const struct cb_config *config, const char *name) {
    for (unsigned i = 0; i < config->outputs_count; ++i) {
        if (same_name(config->outputs[i].name, name)) return i;
    }
    return CB_NONE;
}

/* out: index in config of the channel or slope with the same name, or CB_NONE; a slope has the name
 *      of its channel */
static unsigned find_channel(const struct cb_config *config,
                             const struct cb_channel_config *channel) {
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        if (config->channels[i].is_slope == channel->is_slope &&
            same_name(config->channels[i].name, channel->name))
            return i;
    }
    return CB_NONE;
}

/* out: true if neither channel has a tangent, or P0 of both is the same position in the same
 *      register */
static bool same_reference(const struct cb_config *a, const struct cb_channel_config *in_a,
                           const struct cb_config *b, const struct cb_channel_config *in_b) {
    if (in_a->tangent != in_b->tangent) return false;
    return !in_a->tangent ||
           (a->plc.write.start + in_a->reference_reg == b->plc.write.start + in_b->reference_reg &&
            in_a->reference_type == in_b->reference_type &&
            in_a->reference_scale == in_b->reference_scale &&
            same_name(a->signals[in_a->tangent_signal].name,
                      b->signals[in_b->tangent_signal].name));
}

/* out: true if equal µm give equal bits in the same register of the same PLC */
static bool same_register(const struct cb_config *a, const struct cb_channel_config *in_a,
                          const struct cb_config *b, const struct cb_channel_config *in_b) {
    const bool same_plc = a->plc.unit == b->plc.unit && a->plc.port == b->plc.port &&
                          a->plc.transport == b->plc.transport &&
                          memcmp(a->plc.host, b->plc.host, sizeof a->plc.host) == 0;
    return same_plc && a->plc.write.start + in_a->reg == b->plc.write.start + in_b->reg &&
           in_a->type == in_b->type && in_a->sign == in_b->sign && in_a->scale == in_b->scale &&
           same_reference(a, in_a, b, in_b);
}

/* out: true if the PLC certainly holds zero: then the channel may change its register or
 *      disappear. Behind a contact the register may have an old value until a write is confirmed.
 */
static bool is_at_rest(const struct cb_box *box, unsigned index) {
    const struct cb_channel_state *state = &box->channels[index];
    if (box->plc.contact == CB_CONTACT_KNOWN && !box->plc.confirmed) return false;
    return state->output_um == 0.0f && state->sent_um == 0.0f && state->possible_min_um == 0.0f &&
           state->possible_max_um == 0.0f;
}

bool cb_box_at_rest(const struct cb_box *box) {
    if (!box->mode.withheld) return false;
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i)
        if (!is_at_rest(box, i)) return false;
    return true;
}

unsigned cb_box_obstacle(const struct cb_config *fresh, const struct cb_box *old) {
    if (!cb_box_is_sound(old)) return CB_NONE;
    for (unsigned i = 0; i < cb_all_channels(&old->config); ++i) {
        if (is_at_rest(old, i)) continue;
        const struct cb_channel_config *channel = &old->config.channels[i];
        const unsigned k = find_channel(fresh, channel);
        if (k == CB_NONE || !same_register(fresh, &fresh->channels[k], &old->config, channel))
            return i;
    }
    return CB_NONE;
}

/* out: true if the state of the signal stays valid
 * A value is in the signal's unit, so it stays valid after a change of source, scale or range. The
 * state of a lag stays valid after a change of its time constant, but not for another signal. */
static bool same_kind(const struct cb_config *a, const struct cb_signal_config *in_a,
                      const struct cb_config *b, const struct cb_signal_config *in_b) {
    const bool lag = in_a->source == CB_SOURCE_LAG;
    if (memcmp(in_a->unit, in_b->unit, sizeof in_a->unit) != 0) return false;
    if (lag != (in_b->source == CB_SOURCE_LAG)) return false;
    return !lag || (in_a->power == in_b->power &&
                    same_name(a->signals[in_a->lag_of].name, b->signals[in_b->lag_of].name));
}

/* out: index in old of the signal whose state is that of signal i of fresh; or CB_NONE */
static unsigned heir_of(const struct cb_config *fresh, unsigned i, const struct cb_config *old) {
    const unsigned k = find_signal(old, fresh->signals[i].name);
    if (k == CB_NONE) return CB_NONE;
    return same_kind(fresh, &fresh->signals[i], old, &old->signals[k]) ? k : CB_NONE;
}

static void adopt_signals(struct cb_box *fresh, const struct cb_box *old) {
    for (unsigned i = 0; i < fresh->config.signals_count; ++i) {
        const unsigned k = heir_of(&fresh->config, i, &old->config);
        if (k == CB_NONE) continue;
        fresh->signals[i] = old->signals[k];
        fresh->signals[i].streak = 0; /* the source may have changed */
        fresh->signals[i].doubted = false;
        fresh->bank.time_us[i] = old->bank.time_us[k];
        fresh->bank.value[i] = old->bank.value[k];
    }
}

/* Keeps each lag of a bank whose input, power and time constant were in a bank before. Two banks
 * with the same differ by the ranges in which the input acts. */
static void adopt_banks(struct cb_box *fresh, const struct cb_box *old) {
    for (unsigned lag = 0; lag < fresh->config.bank_lags_count; ++lag) {
        struct cb_bank_key key = cb_bank_key_of(&fresh->config, lag);
        const unsigned k = heir_of(&fresh->config, key.signal, &old->config);
        if (k == CB_NONE) continue;
        key.signal = (uint8_t)k;
        const unsigned was = cb_bank_find(&old->config, key);
        if (was == CB_MAX_BANK_LAGS || !cb_bank_is_settled(&old->bank, was)) continue;
        cb_bank_settle(&fresh->bank, lag, old->bank.lags[was]);
    }
}

/* Keeps the direction of travel of a curve with branches, if the new one has the same position. */
static void adopt_direction(struct cb_box *fresh, unsigned index, const struct cb_box *old,
                            unsigned was) {
    const struct cb_curve_config *a = &fresh->config.terms[index].as.curve;
    const struct cb_curve_config *b = &old->config.terms[was].as.curve;
    if (!old->terms[was].directed || !cb_term_has_branches(&fresh->config.terms[index])) return;
    if (!same_name(fresh->config.signals[a->signal].name, old->config.signals[b->signal].name))
        return;
    fresh->terms[index].direction = old->terms[was].direction;
    fresh->terms[index].directed = true;
}

/* out: index in `adapts` of the term with this index; CB_NONE: it is no term of type adapt */
static unsigned find_adapt(const struct cb_config *config, unsigned term) {
    for (unsigned i = 0; i < config->adapts_count; ++i) {
        if (config->adapts[i] == term) return i;
    }
    return CB_NONE;
}

/* Keeps bias and gain of an adapted term with the same model. Those in use move from their present
 * values to the targets, which the new bounds may have changed. */
static void adopt_probe(struct cb_box *fresh, unsigned index, const struct cb_box *old,
                        unsigned was) {
    const unsigned i = find_adapt(&fresh->config, index), k = find_adapt(&old->config, was);
    if (i == CB_NONE || k == CB_NONE) return;
    const struct cb_adapt_config *a = &fresh->config.terms[index].as.adapt;
    const struct cb_adapt_config *b = &old->config.terms[was].as.adapt;
    const struct cb_signal_config *count_a = &fresh->config.signals[a->signals[1]];
    const struct cb_signal_config *count_b = &old->config.signals[b->signals[1]];
    struct cb_probe_state *probe = &fresh->probes[i];
    if (!same_name(fresh->config.outputs[a->output].name, old->config.outputs[b->output].name))
        return;
    cb_probe_resume(&fresh->config, i, &old->probes[k], probe);
    probe->counted = old->probes[k].counted && same_name(count_a->name, count_b->name);
    fresh->terms[index].adapted = old->terms[was].adapted;
    fresh->terms[index].adapted.to_bias_um = probe->filter.bias_um;
    fresh->terms[index].adapted.to_gain = probe->filter.gain;
}

/* Keeps the last outputs, so a term that fades continues to fade; a live term replaces them. */
static void adopt_terms(struct cb_box *fresh, const struct cb_box *old) {
    for (unsigned i = 0; i < fresh->config.terms_count; ++i) {
        const struct cb_term_config *term = &fresh->config.terms[i];
        for (unsigned j = 0; j < term->outputs; ++j) {
            const unsigned index = term->first_output + j;
            const unsigned k = find_output(&old->config, fresh->config.outputs[index].name);
            if (k == CB_NONE) continue;
            const unsigned was = old->config.outputs[k].term;
            fresh->outputs[index] = old->outputs[k];
            fresh->terms[i].live = old->terms[was].live;
            adopt_direction(fresh, i, old, was);
            adopt_probe(fresh, i, old, was);
        }
    }
}

static void adopt_channels(struct cb_box *fresh, const struct cb_box *old) {
    for (unsigned i = 0; i < cb_all_channels(&fresh->config); ++i) {
        const unsigned k = find_channel(&old->config, &fresh->config.channels[i]);
        if (k == CB_NONE) continue;
        fresh->channels[i] = old->channels[k];
        fresh->tangent.reference[i] = old->tangent.reference[k];
        fresh->applied.channels[i] = old->applied.channels[k];
    }
    fresh->applied.slot_us = old->applied.slot_us;
}

/* A latched fault keeps the cause of its first step, which names a channel. */
static void adopt_cause(struct cb_box *fresh, const struct cb_box *old) {
    const struct cb_cause *cause = &old->cause;
    const bool of_channel = cause->kind == CB_CAUSE_DEMAND || cause->kind == CB_CAUSE_UNAPPLIED;
    if (!of_channel || cause->index >= CB_MAX_CHANNELS) return;
    const unsigned k = find_channel(&fresh->config, &old->config.channels[cause->index]);
    if (k == CB_NONE) return;
    fresh->cause = *cause;
    fresh->cause.index = (uint8_t)k;
}

bool cb_box_adopt(struct cb_box *fresh, const struct cb_box *old) {
    CB_ASSERT(fresh != old);
    if (!cb_box_is_sound(old) || cb_box_obstacle(&fresh->config, old) != CB_NONE) return false;
    fresh->mode = old->mode;
    fresh->counters = old->counters;
    fresh->plc = old->plc;
    if (!fresh->config.plc.has_handshake) fresh->plc.nc_alarm = false;
    fresh->life = old->life;
    adopt_signals(fresh, old);
    adopt_banks(fresh, old);
    adopt_terms(fresh, old);
    adopt_channels(fresh, old);
    adopt_cause(fresh, old);
    return true;
}
