/* SPDX-License-Identifier: MIT
 * The object "tangent" of a channel: slope and reference position, written with its value. */
#include <string.h>

#include "firmware/config/config.h"
#include "firmware/config/profile.h"
#include "firmware/load/control.h"
#include "firmware/load/registers.h"
#include "firmware/load/sections.h"
#include "firmware/terms/load.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Numbers of the object, before conversion to struct cb_channel_config. */
struct tangent {
    float slope_limit, slope_slew_per_s, slope_scale, reference_scale;
    uint16_t slope_reg, reference_reg;
    uint8_t slope_type, reference_type;
};
#define AT(member) .offset = offsetof(struct tangent, member)

enum {
    SIGNAL,
    SLOPE_PLC,
    SLOPE_TYPE,
    SLOPE_SCALE,
    SLOPE_LIMIT,
    SLOPE_SLEW,
    REFERENCE_PLC,
    REFERENCE_TYPE,
    REFERENCE_SCALE,
    TANGENT_KEYS
};
static const struct cb_field TANGENT_FIELDS[TANGENT_KEYS] = {
    [SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},
    [SLOPE_PLC] = {"slope_plc", CB_FIELD_UINT16, true, AT(slope_reg), .least = "0",
                   .most = "65535"},
    [SLOPE_TYPE] = {"slope_type", CB_FIELD_WORD, true, AT(slope_type), .words = CB_REGISTER_WORDS},
    [SLOPE_SCALE] = {"slope_scale", CB_FIELD_FLOAT, true, AT(slope_scale), .least = "1e-9",
                     .most = "1"},
    [SLOPE_LIMIT] = {"slope_limit", CB_FIELD_FLOAT, true, AT(slope_limit), .least = "1e-6",
                     .most = "0.1"},
    [SLOPE_SLEW] = {"slope_slew_per_s", CB_FIELD_FLOAT, true, AT(slope_slew_per_s), .least = "1e-6",
                    .most = "10"},
    [REFERENCE_PLC] = {"reference_plc", CB_FIELD_UINT16, true, AT(reference_reg), .least = "0",
                       .most = "65535"},
    [REFERENCE_TYPE] = {"reference_type", CB_FIELD_WORD, true, AT(reference_type),
                        .words = CB_REGISTER_WORDS},
    [REFERENCE_SCALE] = {"reference_scale", CB_FIELD_FLOAT, true, AT(reference_scale),
                         .least = "0.000001", .most = "1000"},
};
const struct cb_object cb_tangent_object = {TANGENT_FIELDS, TANGENT_KEYS};

/* out: true if the control has slopes and the write block has counters; else false and a message */
static bool check_control(struct cb_loader *loader, uint32_t at) {
    const struct cb_plc_config *plc = &loader->config->plc;
    const struct cb_profile_facts *facts = cb_profile_of(plc->profile);
    if (!facts->tangent)
        return cb_fail(loader, CB_ERROR_PROFILE, at, "profile %s has no slope; omit it",
                       facts->name);
    if (plc->write.counters) return true;
    return cb_fail(loader, CB_ERROR_KEY, at,
                   "the PLC needs plc.write.counters to recognise a torn block: value, slope "
                   "and reference belong together");
}

/* out: true if the register represents ±slope_limit, which is at least one unit, and the slope
 *      reaches zero within a second; else false and a message */
static bool check_slope(struct cb_loader *loader, const uint32_t *slots,
                        const struct tangent *tangent) {
    if (!(cb_number_range(tangent->slope_type).min < 0.0f))
        return cb_fail(loader, CB_ERROR_RANGE, slots[SLOPE_TYPE],
                       "%o is unsigned, and a slope may be negative; use a signed type",
                       slots[SLOPE_TYPE]);
    if (!cb_register_holds(tangent->slope_type, tangent->slope_limit / tangent->slope_scale))
        return cb_fail(loader, CB_ERROR_RANGE, slots[SLOPE_LIMIT],
                       "%o in units of %o (slope_scale) does not fit into %o", slots[SLOPE_LIMIT],
                       slots[SLOPE_SCALE], slots[SLOPE_TYPE]);
    if (cb_number_is_integer(tangent->slope_type) && tangent->slope_limit < tangent->slope_scale)
        return cb_fail(loader, CB_ERROR_RANGE, slots[SLOPE_LIMIT],
                       "%o is less than one unit of the register, %o (slope_scale)",
                       slots[SLOPE_LIMIT], slots[SLOPE_SCALE]);
    if (tangent->slope_slew_per_s >= tangent->slope_limit) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[SLOPE_SLEW],
                   "%o is below slope_limit (%o): the slope must be able to reach zero within a "
                   "second",
                   slots[SLOPE_SLEW], slots[SLOPE_LIMIT]);
}

/* out: true if the signal is a position in mm from the PLC, and its range fits into the register */
static bool check_reference(struct cb_loader *loader, const uint32_t *slots,
                            const struct cb_signal_config *signal, const struct tangent *tangent) {
    const uint8_t type = tangent->reference_type;
    if (!signal->leads || !cb_same_text(signal->unit, "mm"))
        return cb_fail(loader, CB_ERROR_NAME, slots[SIGNAL],
                       "%o is not a position in mm from the PLC, which a tangent needs",
                       slots[SIGNAL]);
    if (cb_register_holds(type, signal->min / tangent->reference_scale) &&
        cb_register_holds(type, signal->max / tangent->reference_scale))
        return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[REFERENCE_TYPE],
                   "positions of %s in units of %o (reference_scale) do not fit into %o",
                   signal->name, slots[REFERENCE_SCALE], slots[REFERENCE_TYPE]);
}

/* out: *slope, a channel behind those of the file, in µm/m: 1e-6 of the file is 1 µm/m */
static void fill_slope(struct cb_channel_config *slope, const struct cb_channel_config *channel,
                       const struct tangent *tangent) {
    memcpy(slope->name, channel->name, sizeof slope->name);
    slope->is_slope = true;
    slope->type = tangent->slope_type;
    slope->sign = channel->sign;
    slope->scale = tangent->slope_scale * 1e6f;
    slope->limit_um = slope->error_um = tangent->slope_limit * 1e6f;
    slope->slew_um_per_s = tangent->slope_slew_per_s * 1e6f;
    slope->reg = tangent->slope_reg;
}

/* in : at, the object; index of its channel, which is loaded
 * out: slope and reference in config->channels, their registers reserved; or false and a message */
static bool load_tangent(struct cb_loader *loader, uint32_t at, uint8_t index) {
    struct cb_config *config = loader->config;
    struct cb_channel_config *channel = &config->channels[index];
    const uint8_t user = (uint8_t)(CB_USER_CHANNEL + index);
    const uint8_t place = (uint8_t)(config->channels_count + config->slopes_count);
    struct tangent tangent;
    uint32_t slots[TANGENT_KEYS];
    if (!cb_read_object(loader, at, &cb_tangent_object, &tangent, slots)) return false;
    if (!cb_read_signal(loader, slots[SIGNAL], &channel->tangent_signal)) return false;
    if (!check_control(loader, at) || !check_slope(loader, slots, &tangent)) return false;
    if (!cb_check_value_type(loader, slots[SLOPE_TYPE], tangent.slope_type) ||
        !cb_check_value_type(loader, slots[REFERENCE_TYPE], tangent.reference_type))
        return false;
    if (!check_reference(loader, slots, &config->signals[channel->tangent_signal], &tangent))
        return false;
    if (!cb_take_write(loader, slots[SLOPE_PLC], tangent.slope_type, user, &tangent.slope_reg) ||
        !cb_take_write(loader, slots[REFERENCE_PLC], tangent.reference_type, user,
                       &tangent.reference_reg))
        return false;
    if (place >= CB_MAX_CHANNELS)
        return cb_fail(loader, CB_ERROR_FULL, at,
                       "the box has room for %u channels, and each tangent takes one more",
                       (uint32_t)CB_MAX_CHANNELS);
    channel->tangent = true;
    channel->slope = place;
    channel->reference_type = tangent.reference_type;
    channel->reference_reg = tangent.reference_reg;
    channel->reference_scale = tangent.reference_scale;
    fill_slope(&config->channels[place], channel, &tangent);
    ++config->slopes_count;
    return true;
}

bool cb_load_tangents(struct cb_loader *loader, uint32_t at) {
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        const uint32_t tangent = cb_find_key(loader, list.at, "tangent");
        if (tangent != CB_ABSENT && !load_tangent(loader, tangent, (uint8_t)list.index))
            return false;
    }
    return true;
}
