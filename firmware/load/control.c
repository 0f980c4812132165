/* SPDX-License-Identifier: MIT */
#include "firmware/load/control.h"

#include "firmware/config/config.h"
#include "firmware/config/profile.h"
#include "models/num.h"

static const struct cb_profile_facts *facts_of(const struct cb_loader *loader) {
    return cb_profile_of(loader->config->plc.profile);
}

static bool too_long(struct cb_loader *loader, uint32_t at, const char *block, unsigned most) {
    const uint32_t of_block = cb_find_key(loader, at, block);
    const uint32_t count_at = cb_find_key(loader, of_block, "count");
    return cb_fail(loader, CB_ERROR_PROFILE, count_at,
                   "%o registers are more than the %u of one request of profile %s; bring the "
                   "values closer together",
                   count_at, (uint32_t)most, facts_of(loader)->name);
}

bool cb_check_exchange(struct cb_loader *loader, uint32_t at) {
    const struct cb_plc_config *plc = &loader->config->plc;
    const struct cb_profile_facts *facts = facts_of(loader);
    const enum cb_exchange exchange = (enum cb_exchange)plc->exchange;
    const unsigned read_most = cb_profile_read_most(facts, exchange);
    const unsigned write_most = cb_profile_write_most(facts, exchange);
    const uint32_t exchange_at = cb_find_key(loader, at, "exchange");
    if (!cb_profile_answers(facts, exchange))
        return cb_fail(loader, CB_ERROR_PROFILE, exchange_at,
                       "%o is not supported by %o; use \"fc3+fc16\"", exchange_at,
                       cb_find_key(loader, at, "profile"));
    if (plc->read.count > read_most) return too_long(loader, at, "read", read_most);
    if (plc->write.count > write_most) return too_long(loader, at, "write", write_most);
    return true;
}

static bool check_type(struct cb_loader *loader, uint32_t at, uint8_t type, uint32_t types,
                       const char *remedy) {
    if (types & 1u << type) return true;
    return cb_fail(loader, CB_ERROR_PROFILE, at, "profile %s has no %o: %s; use %s",
                   facts_of(loader)->name, at, facts_of(loader)->order, remedy);
}

bool cb_check_signal_type(struct cb_loader *loader, uint32_t at, uint8_t type) {
    return check_type(loader, at, type, facts_of(loader)->number_types,
                      "uint16, int16, uint32, int32 or float32");
}

bool cb_check_value_type(struct cb_loader *loader, uint32_t at, uint8_t type) {
    return check_type(loader, at, type, facts_of(loader)->value_types,
                      facts_of(loader)->value_most > 0.0f ? "int16" : "int16, int32 or float32");
}

/* out: true if scale is a least increment of the control, to rounding; or the control has none */
static bool is_increment(const struct cb_profile_facts *facts, float scale) {
    if (!(facts->increments_um[0] > 0.0f)) return true;
    for (unsigned i = 0; i < CB_PROFILE_INCREMENTS; ++i) {
        const float increment_um = facts->increments_um[i];
        if (cb_abs(scale - increment_um) <= 1e-6f * increment_um) return true;
    }
    return false;
}

bool cb_check_increments(struct cb_loader *loader, uint32_t limit_at, uint32_t scale_at,
                         const struct cb_channel_config *channel) {
    const struct cb_profile_facts *facts = facts_of(loader);
    if (!is_increment(facts, channel->scale))
        return cb_fail(loader, CB_ERROR_PROFILE, scale_at,
                       "%o µm is not a least increment of profile %s; use %s", scale_at,
                       facts->name, facts->increments);
    const float most_um = facts->value_most * channel->scale * (1.0f + 1e-6f);
    if (!(facts->value_most > 0.0f) || channel->limit_um <= most_um) return true;
    return cb_fail(loader, CB_ERROR_PROFILE, limit_at,
                   "%o µm in increments of %o µm (scale) exceeds the %u that profile %s accepts; "
                   "lower it or use a coarser increment",
                   limit_at, scale_at, (uint32_t)facts->value_most, facts->name);
}

void cb_hold_to_steps(struct cb_config *config) {
    for (unsigned i = 0; i < config->channels_count; ++i) {
        struct cb_channel_config *channel = &config->channels[i];
        const float most = cb_profile_slew_most(config, channel);
        if (channel->has_applied) channel->step_um = (float)config->plc.step_units * channel->scale;
        if (most > 0.0f && channel->slew_um_per_s > most) channel->slew_um_per_s = most;
    }
}
