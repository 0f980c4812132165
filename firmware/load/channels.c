/* SPDX-License-Identifier: MIT
 * The sections "channels" and "pairs". */
#include "firmware/config/config.h"
#include "firmware/config/grid.h"
#include "firmware/load/control.h"
#include "firmware/load/registers.h"
#include "firmware/load/sections.h"
#include "firmware/terms/load.h"
#include "firmware/wire/number.h"

#define AT(member) .offset = offsetof(struct cb_channel_config, member)

enum {
    NAME,
    SUM,
    LIMIT,
    ERROR,
    SLEW,
    DEADBAND,
    SIGN,
    PLC,
    TYPE,
    SCALE,
    APPLIED,
    TANGENT,
    CHANNEL_KEYS
};

static const struct cb_field CHANNEL_FIELDS[CHANNEL_KEYS] = {
    [NAME] = {"name", CB_FIELD_NAME, true, AT(name)},
    [SUM] = {"sum", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [LIMIT] = {"limit_um", CB_FIELD_FLOAT, true, AT(limit_um), .least = "0.001", .most = "1000000"},
    [ERROR] = {"error_um", CB_FIELD_FLOAT, true, AT(error_um), .least = "0.001", .most = "1000000"},
    [SLEW] = {"slew_um_per_s", CB_FIELD_FLOAT, true, AT(slew_um_per_s), .least = "0.001",
              .most = "1000000"},
    [DEADBAND] = {"deadband_um", CB_FIELD_FLOAT, false, AT(deadband_um), .least = "0",
                  .most = "1000000", .otherwise = "0"},
    [SIGN] = {"sign", CB_FIELD_SIGN, false, AT(sign), .least = "-1", .most = "1", .otherwise = "1"},
    [PLC] = {"plc", CB_FIELD_UINT16, true, AT(reg), .least = "0", .most = "65535"},
    [TYPE] = {"type", CB_FIELD_WORD, true, AT(type), .words = CB_REGISTER_WORDS},
    [SCALE] = {"scale", CB_FIELD_FLOAT, true, AT(scale), .least = "0.000001", .most = "1000000"},
    [APPLIED] = {"applied", CB_FIELD_UINT16, false, AT(applied_reg), .least = "0", .most = "65535"},
    [TANGENT] = {"tangent", CB_FIELD_OBJECT, false, CB_NOT_STORED},
};
const struct cb_object cb_channel_object = {CHANNEL_FIELDS, CHANNEL_KEYS};

/* out: true if the register represents ±limit_um, which is at least one unit, and the control
 *      accepts its type and scale; else false and a message */
static bool check_register(struct cb_loader *loader, const uint32_t *slots,
                           const struct cb_channel_config *channel) {
    if (!(cb_number_range(channel->type).min < 0.0f))
        return cb_fail(loader, CB_ERROR_RANGE, slots[TYPE],
                       "%o is unsigned, and a compensation may be negative; use a signed type",
                       slots[TYPE]);
    if (!cb_register_holds(channel->type, channel->limit_um / channel->scale))
        return cb_fail(loader, CB_ERROR_RANGE, slots[LIMIT],
                       "%o µm in units of %o µm (scale) does not fit into %o", slots[LIMIT],
                       slots[SCALE], slots[TYPE]);
    if (!cb_check_value_type(loader, slots[TYPE], channel->type) ||
        !cb_check_increments(loader, slots[LIMIT], slots[SCALE], channel))
        return false;
    if (!cb_number_is_integer(channel->type) || channel->limit_um >= channel->scale) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[LIMIT],
                   "%o µm is less than one unit of the register, %o µm (scale)", slots[LIMIT],
                   slots[SCALE]);
}

static bool check_limits(struct cb_loader *loader, const uint32_t *slots,
                         const struct cb_channel_config *channel) {
    if (channel->error_um < channel->limit_um)
        return cb_fail(loader, CB_ERROR_ORDER, slots[ERROR], "%o is below limit_um (%o)",
                       slots[ERROR], slots[LIMIT]);
    if (channel->deadband_um > channel->limit_um)
        return cb_fail(loader, CB_ERROR_ORDER, slots[DEADBAND], "%o is above limit_um (%o)",
                       slots[DEADBAND], slots[LIMIT]);
    return check_register(loader, slots, channel);
}

static bool read_sum(struct cb_loader *loader, uint32_t at, struct cb_channel_config *channel) {
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        uint8_t output = 0;
        if (!cb_list_has_room(loader, &list, CB_MAX_SUM, "terms in one sum")) return false;
        if (!cb_read_output(loader, list.at, &output)) return false;
        for (uint32_t i = 0; i < channel->sum_count; ++i) {
            if (channel->sum[i] == output)
                return cb_fail(loader, CB_ERROR_NAME, list.at, "%o occurs twice in this sum",
                               list.at);
        }
        channel->sum[channel->sum_count++] = output;
    }
    if (channel->sum_count > 0) return true;
    return cb_fail(loader, CB_ERROR_KEY, at, "a channel sums at least one term");
}

/* Reserves the registers of the value and of `applied`. */
static bool take_registers(struct cb_loader *loader, const uint32_t *slots, uint8_t index) {
    struct cb_channel_config *channel = &loader->config->channels[index];
    const uint8_t user = (uint8_t)(CB_USER_CHANNEL + index);
    if (!cb_take_write(loader, slots[PLC], channel->type, user, &channel->reg)) return false;
    channel->has_applied = slots[APPLIED] != CB_ABSENT;
    return !channel->has_applied ||
           cb_take_read(loader, slots[APPLIED], channel->type, user, &channel->applied_reg);
}

static bool load_channel(struct cb_loader *loader, uint32_t at, uint8_t index) {
    struct cb_config *config = loader->config;
    struct cb_channel_config *channel = &config->channels[index];
    uint32_t slots[CHANNEL_KEYS];
    if (!cb_read_object(loader, at, &cb_channel_object, channel, slots)) return false;
    if (cb_find_name(config->channels, sizeof *channel, index, channel->name) != CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, slots[NAME], "another channel is called %o",
                       slots[NAME]);
    return check_limits(loader, slots, channel) && read_sum(loader, slots[SUM], channel) &&
           take_registers(loader, slots, index);
}

bool cb_load_channels(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_CHANNELS, "channels")) return false;
        if (!load_channel(loader, list.at, config->channels_count)) return false;
        ++config->channels_count;
    }
    if (config->channels_count == 0)
        return cb_fail(loader, CB_ERROR_KEY, at, "at least one channel is needed");
    cb_hold_to_steps(config);
    return cb_load_tangents(loader, at);
}

/* ---- pairs ---- */

enum { PAIR_CHANNELS, MAX_DIFFERENCE, PAIR_KEYS };
static const struct cb_field PAIR_FIELDS[PAIR_KEYS] = {
    [PAIR_CHANNELS] = {"channels", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [MAX_DIFFERENCE] = {"max_difference_um", CB_FIELD_FLOAT, true,
                        .offset = offsetof(struct cb_pair_config, max_difference_um),
                        .least = "0.001", .most = "1000000"},
};
const struct cb_object cb_pair_object = {PAIR_FIELDS, PAIR_KEYS};

/* out: true if the channel is in one of the pairs 0 … pairs_count - 1 */
static bool is_paired(const struct cb_config *config, uint8_t channel) {
    for (uint32_t i = 0; i < config->pairs_count; ++i) {
        if (config->pairs[i].a == channel || config->pairs[i].b == channel) return true;
    }
    return false;
}

/* in : at, the name of a channel
 * out: its index: a channel without tangent that is in no earlier pair; or false and a message */
static bool read_pair_member(struct cb_loader *loader, uint32_t at, uint8_t *channel) {
    const struct cb_config *config = loader->config;
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    *channel =
        cb_find_name(config->channels, sizeof config->channels[0], config->channels_count, name);
    if (*channel == CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, at, "no channel is called %o", at);
    if (config->channels[*channel].tangent)
        return cb_fail(
            loader, CB_ERROR_NAME, at,
            "channel %o has a tangent, which could move the pair apart between two writes", at);
    if (is_paired(config, *channel))
        return cb_fail(loader, CB_ERROR_NAME, at, "channel %o is in another pair", at);
    return true;
}

static bool read_members(struct cb_loader *loader, uint32_t at, struct cb_pair_config *pair) {
    uint8_t members[2] = {0, 0};
    uint32_t count = 0;
    struct cb_list list = cb_list(loader, at);
    for (; cb_list_next(&list); ++count) {
        if (count < 2 && !read_pair_member(loader, list.at, &members[count])) return false;
    }
    if (count != 2)
        return cb_fail(loader, CB_ERROR_RANGE, at, "a pair has two channels, not %u", count);
    if (members[0] == members[1])
        return cb_fail(loader, CB_ERROR_NAME, at, "a pair has two different channels");
    pair->a = members[0];
    pair->b = members[1];
    return true;
}

/* The maximum difference is at least one unit of each register, because outputs move by whole
 * units. */
static bool check_difference(struct cb_loader *loader, uint32_t at,
                             const struct cb_pair_config *pair) {
    const struct cb_channel_config *channels = loader->config->channels;
    const float units =
        cb_channel_raw_unit_um(&channels[pair->a]) + cb_channel_raw_unit_um(&channels[pair->b]);
    if (pair->max_difference_um >= units) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "%o µm is less than a register unit (scale) of both channels together", at);
}

/* Both channels have `applied`, or none: an output starts at its applied value, so with one of them
 * unknown the pair could start apart. */
static bool check_applied(struct cb_loader *loader, uint32_t at,
                          const struct cb_pair_config *pair) {
    const struct cb_channel_config *a = &loader->config->channels[pair->a];
    const struct cb_channel_config *b = &loader->config->channels[pair->b];
    if (a->has_applied == b->has_applied) return true;
    return cb_fail(loader, CB_ERROR_KEY, at,
                   "channel %s has applied and channel %s has not; a pair needs it at both or none",
                   a->has_applied ? a->name : b->name, a->has_applied ? b->name : a->name);
}

bool cb_load_pairs(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        struct cb_pair_config *pair = &config->pairs[config->pairs_count];
        uint32_t slots[PAIR_KEYS];
        if (!cb_list_has_room(loader, &list, CB_MAX_PAIRS, "pairs")) return false;
        if (!cb_read_object(loader, list.at, &cb_pair_object, pair, slots)) return false;
        if (!read_members(loader, slots[PAIR_CHANNELS], pair)) return false;
        if (!check_difference(loader, slots[MAX_DIFFERENCE], pair)) return false;
        if (!check_applied(loader, slots[PAIR_CHANNELS], pair)) return false;
        ++config->pairs_count;
    }
    return true;
}
