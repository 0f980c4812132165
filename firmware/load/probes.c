/* SPDX-License-Identifier: MIT
 * Terms of type adapt: the channel whose sum has each of them. */
#include "firmware/config/config.h"
#include "firmware/load/sections.h"
#include "firmware/terms/kinds.h"

/* out: place of `output` in the channel's sum; sum_count if it is not there */
static unsigned place_in(const struct cb_channel_config *channel, uint8_t output) {
    unsigned k = 0;
    while (k < channel->sum_count && channel->sum[k] != output) ++k;
    return k;
}

/* out: true if this output is the model of `adapt`, as it is or adapted by another term */
static bool is_its_model(const struct cb_config *config, const struct cb_adapt_config *adapt,
                         uint8_t own, uint8_t output) {
    const struct cb_term_config *term = &config->terms[config->outputs[output].term];
    const bool is_adapted = output != own && term->type == CB_TERM_ADAPT;
    return output == adapt->output || (is_adapted && term->as.adapt.output == adapt->output);
}

/* in : adapt, whose output is `own`; channels, place of their list
 * out: false, and a message, if its channel would add its model a second time */
static bool check_sum(struct cb_loader *loader, const struct cb_adapt_config *adapt, uint8_t own,
                      uint32_t channels) {
    const struct cb_config *config = loader->config;
    const struct cb_channel_config *channel = &config->channels[cb_adapt_channel(adapt)];
    unsigned k = 0;
    while (k < channel->sum_count && !is_its_model(config, adapt, own, channel->sum[k])) ++k;
    if (k == channel->sum_count) return true;
    const uint32_t sum =
        cb_find_key(loader, cb_list_at(loader, channels, cb_adapt_channel(adapt)), "sum");
    const uint32_t at = cb_list_at(loader, sum, k);
    return cb_fail(loader, CB_ERROR_NAME, at,
                   "%o is already in this sum as %s, which is \"%s\" adapted; omit one of them", at,
                   config->outputs[own].name, config->outputs[adapt->output].name);
}

/* in : at, the term in the file; own, its output
 * out: the channel of the term; false and a message if there are several, or none but needed */
static bool resolve(struct cb_loader *loader, uint32_t at, uint8_t own, uint32_t channels) {
    struct cb_config *config = loader->config;
    struct cb_adapt_config *adapt = &config->terms[config->outputs[own].term].as.adapt;
    for (uint8_t i = 0; i < config->channels_count; ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        if (place_in(channel, own) == channel->sum_count) continue;
        if (cb_adapt_channel(adapt) != CB_NONE)
            return cb_fail(loader, CB_ERROR_NAME, cb_find_key(loader, at, "probe"),
                           "the channels %s and %s both add this term, and a probe measures one; "
                           "give each channel an adapt term of its own",
                           config->channels[cb_adapt_channel(adapt)].name, channel->name);
        adapt->measures = (uint8_t)((adapt->measures & CB_ADAPT_WHOLE) | i);
        if (!check_sum(loader, adapt, own, channels)) return false;
    }
    if (cb_adapt_channel(adapt) != CB_NONE || cb_adapt_is_whole(adapt)) return true;
    return cb_fail(loader, CB_ERROR_NAME, cb_find_key(loader, at, "probe"),
                   "no channel adds this term, so the box does not know what its probe still sees; "
                   "name it in a sum, or set measures to \"whole\"");
}

bool cb_resolve_probes(struct cb_loader *loader, uint32_t terms, uint32_t channels) {
    const struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, terms);
    while (cb_list_next(&list)) {
        char name[CB_NAME_SIZE];
        if (cb_find_key(loader, list.at, "probe") == CB_ABSENT) continue; /* of another type */
        if (!cb_read_name(loader, cb_find_key(loader, list.at, "name"), name)) return false;
        const uint8_t own =
            cb_find_name(config->outputs, sizeof config->outputs[0], config->outputs_count, name);
        if (!resolve(loader, list.at, own, channels)) return false;
    }
    return true;
}
