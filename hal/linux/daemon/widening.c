/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/widening.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/config/config.h"

/* out: the channel or slope of the same name; NULL: none */
static const struct cb_channel_config *find(const struct cb_config *config,
                                            const struct cb_channel_config *like) {
    for (unsigned i = 0; i < cb_all_channels(config); i++) {
        const struct cb_channel_config *channel = &config->channels[i];
        if (channel->is_slope == like->is_slope && strcmp(channel->name, like->name) == 0)
            return channel;
    }
    return NULL;
}

static bool same_tangent(const struct cb_config *now, const struct cb_channel_config *was,
                         const struct cb_config *fresh, const struct cb_channel_config *is) {
    if (was->tangent != is->tangent) return false;
    return !is->tangent ||
           (was->reference_reg == is->reference_reg && was->reference_type == is->reference_type &&
            was->reference_scale == is->reference_scale &&
            strcmp(now->signals[was->tangent_signal].name,
                   fresh->signals[is->tangent_signal].name) == 0);
}

/* in : both blocks start at the same register (reload.c)
 * out: the key by which the same µm would be other bits or at another place; NULL: none */
static const char *other_register(const struct cb_config *now, const struct cb_channel_config *was,
                                  const struct cb_config *fresh,
                                  const struct cb_channel_config *is) {
    if (was->reg != is->reg) return "plc";
    if (was->type != is->type) return "type";
    if (was->scale != is->scale) return "scale";
    if (was->sign != is->sign) return "sign";
    if (was->has_applied != is->has_applied ||
        (is->has_applied && was->applied_reg != is->applied_reg))
        return "applied";
    return same_tangent(now, was, fresh, is) ? NULL : "tangent";
}

struct bound {
    const char *key;
    float was, is;
};

/* Largest step of the control, infinite if the file has none. */
static float step_um(const struct cb_channel_config *channel) {
    return channel->step_um > 0.0f ? channel->step_um : INFINITY;
}

/* out: the first bound that grew; its key is NULL if none did */
static struct bound grown(const struct cb_channel_config *was, const struct cb_channel_config *is) {
    const struct bound bounds[] = {{"limit_um", was->limit_um, is->limit_um},
                                   {"error_um", was->error_um, is->error_um},
                                   {"slew_um_per_s", was->slew_um_per_s, is->slew_um_per_s},
                                   {"the largest step in µm", step_um(was), step_um(is)}};
    for (unsigned i = 0; i < sizeof bounds / sizeof bounds[0]; i++)
        if (bounds[i].is > bounds[i].was) return bounds[i];
    return (struct bound){NULL, 0, 0};
}

/* in : is: a channel of `fresh`; out: as cb_widening_find() */
static bool channel_widens(const struct cb_config *now, const struct cb_config *fresh,
                           const struct cb_channel_config *is, char *text, size_t size) {
    const char *what = is->is_slope ? "the slope of channel" : "channel";
    const struct cb_channel_config *was = find(now, is);
    if (was == NULL) return snprintf(text, size, "%s %s is new", what, is->name), true;
    const char *key = other_register(now, was, fresh, is);
    if (key != NULL)
        return snprintf(text, size, "%s %s: %s differs from the running file's", what, is->name,
                        key),
               true;
    const struct bound bound = grown(was, is);
    if (bound.key == NULL) return false;
    snprintf(text, size, "%s %s: %s is %.7g, not %.7g", what, is->name, bound.key, (double)bound.is,
             (double)bound.was);
    return true;
}

/* out: the maximum difference of this pair of channels; infinite if it is no pair */
static float difference_um(const struct cb_config *config, const char *a, const char *b) {
    for (unsigned i = 0; i < config->pairs_count; i++) {
        const struct cb_pair_config *pair = &config->pairs[i];
        const char *one = config->channels[pair->a].name, *other = config->channels[pair->b].name;
        if ((strcmp(a, one) == 0 && strcmp(b, other) == 0) ||
            (strcmp(a, other) == 0 && strcmp(b, one) == 0))
            return pair->max_difference_um;
    }
    return INFINITY;
}

static bool pairs_widen(const struct cb_config *now, const struct cb_config *fresh, char *text,
                        size_t size) {
    for (unsigned i = 0; i < now->pairs_count; i++) {
        const struct cb_pair_config *pair = &now->pairs[i];
        const char *a = now->channels[pair->a].name, *b = now->channels[pair->b].name;
        const float is_um = difference_um(fresh, a, b);
        if (!(is_um > pair->max_difference_um)) continue;
        if (isinf(is_um))
            snprintf(text, size, "the pair of channels %s and %s is gone", a, b);
        else
            snprintf(text, size,
                     "the pair of channels %s and %s: max_difference_um is %.7g, not %.7g", a, b,
                     (double)is_um, (double)pair->max_difference_um);
        return true;
    }
    return false;
}

bool cb_widening_find(const struct cb_config *now, const struct cb_config *fresh, char *text,
                      size_t size) {
    for (unsigned i = 0; i < cb_all_channels(fresh); i++)
        if (channel_widens(now, fresh, &fresh->channels[i], text, size)) return true;
    for (unsigned i = 0; i < cb_all_channels(now); i++) {
        const struct cb_channel_config *was = &now->channels[i];
        if (find(fresh, was) != NULL) continue;
        snprintf(text, size, "%s %s is gone", was->is_slope ? "the slope of channel" : "channel",
                 was->name);
        return true;
    }
    return pairs_widen(now, fresh, text, size);
}
