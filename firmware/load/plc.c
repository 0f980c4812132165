/* SPDX-License-Identifier: MIT
 * The section "plc": the control, its two blocks, and the fixed registers. */
#include "firmware/config/config.h"
#include "firmware/config/profile.h"
#include "firmware/load/control.h"
#include "firmware/load/registers.h"
#include "firmware/load/sections.h"
#include "firmware/wire/number.h"

#define AT(member) .offset = offsetof(struct cb_plc_config, member)
#define BLOCK_AT(member) .offset = offsetof(struct cb_block_config, member)

static const struct cb_word PROFILE_WORDS[] = {
    {"generic", CB_PROFILE_GENERIC},
    {"sinumerik-840d", CB_PROFILE_SINUMERIK_840D},
    {"fanuc", CB_PROFILE_FANUC},
    {0, 0},
};

static const struct cb_word EXCHANGE_WORDS[] = {
    {"fc3+fc16", CB_EXCHANGE_FC3_FC16}, {"fc23", CB_EXCHANGE_FC23}, {0, 0}};

enum {
    PROFILE,
    TRANSPORT,
    EXCHANGE,
    READ,
    WRITE,
    CONTROL,
    PLC_HEARTBEAT,
    STATUS,
    BOX_HEARTBEAT,
    DETAIL,
    REQUEST,
    HEARTBEAT_TIMEOUT,
    REFERENCED_BITS,
    HANDSHAKE,
    SCAN,
    AXES_AT_ONCE,
    MAX_STEP,
    PLC_DEADBAND,
    INTERPOLATE,
    PLC_KEYS
};

static const struct cb_field PLC_FIELDS[PLC_KEYS] = {
    [PROFILE] = {"profile", CB_FIELD_WORD, true, AT(profile), .words = PROFILE_WORDS},
    [TRANSPORT] = {"transport", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [EXCHANGE] = {"exchange", CB_FIELD_WORD, false, AT(exchange), .words = EXCHANGE_WORDS,
                  .otherwise = "fc3+fc16"},
    [READ] = {"read", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [WRITE] = {"write", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [CONTROL] = {"control", CB_FIELD_UINT16, true, AT(control), .least = "0", .most = "65535"},
    [PLC_HEARTBEAT] = {"plc_heartbeat", CB_FIELD_UINT16, true, AT(plc_heartbeat), .least = "0",
                       .most = "65535"},
    [STATUS] = {"status", CB_FIELD_UINT16, true, AT(status), .least = "0", .most = "65535"},
    [BOX_HEARTBEAT] = {"box_heartbeat", CB_FIELD_UINT16, true, AT(box_heartbeat), .least = "0",
                       .most = "65535"},
    [DETAIL] = {"detail", CB_FIELD_UINT16, false, AT(detail), .least = "0", .most = "65535"},
    [REQUEST] = {"request", CB_FIELD_UINT16, false, AT(request), .least = "0", .most = "65535"},
    [HEARTBEAT_TIMEOUT] = {"heartbeat_timeout_ms", CB_FIELD_UINT32, true, AT(heartbeat_timeout_ms),
                           .least = "1", .most = "60000"},
    [REFERENCED_BITS] = {"referenced_bits", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [HANDSHAKE] = {"handshake", CB_FIELD_UINT16, false, AT(handshake), .least = "0",
                   .most = "65535"},
    [SCAN] = {"scan_ms", CB_FIELD_MS, false, AT(scan_us), .least = "0.1", .most = "1000"},
    [AXES_AT_ONCE] = {"axes_at_once", CB_FIELD_BOOL, false, AT(axes_at_once)},
    [MAX_STEP] = {"max_step_units", CB_FIELD_UINT16, false, AT(step_units), .least = "2",
                  .most = "9998"},
    [PLC_DEADBAND] = {"deadband_um", CB_FIELD_FLOAT, false, AT(deadband_um), .least = "0",
                      .most = "1000"},
    [INTERPOLATE] = {"interpolate_ms", CB_FIELD_MS, false, AT(interpolate_us), .least = "0",
                     .most = "1000"},
};
const struct cb_object cb_plc_object = {PLC_FIELDS, PLC_KEYS};

enum { BLOCK_START, BLOCK_COUNT, BLOCK_COUNTERS, BLOCK_KEYS };
static const struct cb_field READ_FIELDS[BLOCK_KEYS] = {
    [BLOCK_START] = {"start", CB_FIELD_UINT16, true, BLOCK_AT(start), .least = "0",
                     .most = "65535"},
    [BLOCK_COUNT] = {"count", CB_FIELD_UINT16, true, BLOCK_AT(count), .least = "2", .most = "125"},
    [BLOCK_COUNTERS] = {"counters", CB_FIELD_BOOL, false, BLOCK_AT(counters), .otherwise = "false"},
};
static const struct cb_field WRITE_FIELDS[BLOCK_KEYS] = {
    [BLOCK_START] = {"start", CB_FIELD_UINT16, true, BLOCK_AT(start), .least = "0",
                     .most = "65535"},
    [BLOCK_COUNT] = {"count", CB_FIELD_UINT16, true, BLOCK_AT(count), .least = "2", .most = "121"},
    [BLOCK_COUNTERS] = {"counters", CB_FIELD_BOOL, false, BLOCK_AT(counters), .otherwise = "false"},
};
const struct cb_object cb_read_block_object = {READ_FIELDS, BLOCK_KEYS};
const struct cb_object cb_write_block_object = {WRITE_FIELDS, BLOCK_KEYS};
_Static_assert(CB_MAX_READ_REGISTERS == 125 && CB_MAX_WRITE_REGISTERS == 121,
               "as in the tables above");

static bool read_block(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                       struct cb_block_config *block) {
    uint32_t slots[BLOCK_KEYS];
    if (!cb_read_object(loader, at, object, block, slots)) return false;
    if (block->start + block->count > 65536)
        return cb_fail(loader, CB_ERROR_RANGE, slots[BLOCK_COUNT],
                       "%o registers from %o on end above 65535", slots[BLOCK_COUNT],
                       slots[BLOCK_START]);
    return true;
}

/* in : at, a list of bits of the control word
 * out: plc.referenced_mask, not 0, without bits of another meaning; or false and a message */
static bool read_referenced_bits(struct cb_loader *loader, uint32_t at) {
    uint16_t *mask = &loader->config->plc.referenced_mask;
    struct cb_list list = cb_list(loader, at);
    *mask = 0;
    while (cb_list_next(&list)) {
        uint32_t bit = 0;
        if (!cb_read_whole(loader, list.at, "0", "15", &bit)) return false;
        if (bit == 0 || bit == 2 || bit == 3)
            return cb_fail(loader, CB_ERROR_RANGE, list.at,
                           "bit %o has another meaning; use 1 or 4 to 15", list.at);
        if (*mask & 1u << bit)
            return cb_fail(loader, CB_ERROR_RANGE, list.at, "bit %o occurs twice", list.at);
        *mask = (uint16_t)(*mask | 1u << bit);
    }
    if (*mask == 0)
        return cb_fail(
            loader, CB_ERROR_RANGE, at,
            "at least one bit is needed: the PLC reports by it that the axes are referenced");
    return true;
}

static bool check_timeout(struct cb_loader *loader, uint32_t at) {
    const struct cb_config *config = loader->config;
    if (config->plc.heartbeat_timeout_ms * 1000u >= config->period_us) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "%o is shorter than one period", at);
}

/* Interpolation ends within one period, before the next value. An NC that receives its axes one by
 * one cannot interpolate. */
static bool check_interpolation(struct cb_loader *loader, uint32_t at) {
    const struct cb_config *config = loader->config;
    const struct cb_profile_facts *facts = cb_profile_of(config->plc.profile);
    if (config->plc.interpolate_us == 0) return true;
    if (facts->handshake_scans > 0)
        return cb_fail(loader, CB_ERROR_PROFILE, at,
                       "profile %s hands values to its NC by handshake, too slowly to interpolate "
                       "between them; omit it",
                       facts->name);
    if (config->plc.interpolate_us <= config->period_us) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "%o is longer than one period: the next value comes before this one is reached",
                   at);
}

/* Reserves the four registers that every file has, and those of detail, request and handshake. */
static bool take_fixed(struct cb_loader *loader, const uint32_t *slots) {
    struct cb_plc_config *plc = &loader->config->plc;
    const uint8_t type = CB_NUMBER_UINT16;
    cb_take_counters(loader);
    return cb_take_read(loader, slots[CONTROL], type, CB_USER_CONTROL, &plc->control) &&
           cb_take_read(loader, slots[PLC_HEARTBEAT], type, CB_USER_PLC_HEARTBEAT,
                        &plc->plc_heartbeat) &&
           cb_take_write(loader, slots[STATUS], type, CB_USER_STATUS, &plc->status) &&
           cb_take_write(loader, slots[BOX_HEARTBEAT], type, CB_USER_BOX_HEARTBEAT,
                         &plc->box_heartbeat) &&
           (slots[DETAIL] == CB_ABSENT ||
            cb_take_write(loader, slots[DETAIL], type, CB_USER_DETAIL, &plc->detail)) &&
           (slots[REQUEST] == CB_ABSENT ||
            cb_take_write(loader, slots[REQUEST], type, CB_USER_REQUEST, &plc->request)) &&
           (slots[HANDSHAKE] == CB_ABSENT ||
            cb_take_read(loader, slots[HANDSHAKE], type, CB_USER_HANDSHAKE, &plc->handshake));
}

/* Keys that only some controls use.
 * out: their values, from the file or the profile; false and a message for a key without effect */
static bool read_control(struct cb_loader *loader, const uint32_t *slots) {
    struct cb_plc_config *plc = &loader->config->plc;
    const struct cb_profile_facts *facts = cb_profile_of(plc->profile);
    static const uint8_t of_handshakes[] = {HANDSHAKE, SCAN, AXES_AT_ONCE};
    for (unsigned i = 0; i < sizeof of_handshakes && facts->handshake_scans == 0; ++i) {
        if (slots[of_handshakes[i]] != CB_ABSENT)
            return cb_fail(loader, CB_ERROR_PROFILE, slots[of_handshakes[i]],
                           "profile %s has no handshake with its NC; omit it", facts->name);
    }
    if (slots[MAX_STEP] != CB_ABSENT && facts->step_most == 0)
        return cb_fail(loader, CB_ERROR_PROFILE, slots[MAX_STEP],
                       "profile %s has no largest step; omit it", facts->name);
    plc->has_detail = slots[DETAIL] != CB_ABSENT;
    plc->has_request = slots[REQUEST] != CB_ABSENT;
    plc->has_handshake = slots[HANDSHAKE] != CB_ABSENT;
    if (slots[MAX_STEP] == CB_ABSENT) plc->step_units = facts->step_most;
    if (slots[PLC_DEADBAND] == CB_ABSENT) plc->deadband_um = facts->deadband_um;
    if (slots[SCAN] == CB_ABSENT && facts->handshake_scans > 0) plc->scan_us = CB_USUAL_SCAN_US;
    return true;
}

bool cb_load_plc(struct cb_loader *loader, uint32_t at) {
    struct cb_plc_config *plc = &loader->config->plc;
    uint32_t slots[PLC_KEYS];
    plc->referenced_mask = 1u << 1;
    if (!cb_read_object(loader, at, &cb_plc_object, plc, slots)) return false;
    if (!cb_load_transport(loader, slots[TRANSPORT])) return false;
    if (!read_block(loader, slots[READ], &cb_read_block_object, &plc->read)) return false;
    if (!read_block(loader, slots[WRITE], &cb_write_block_object, &plc->write)) return false;
    if (slots[REFERENCED_BITS] != CB_ABSENT &&
        !read_referenced_bits(loader, slots[REFERENCED_BITS]))
        return false;
    return read_control(loader, slots) && cb_check_exchange(loader, at) &&
           check_timeout(loader, slots[HEARTBEAT_TIMEOUT]) &&
           check_interpolation(loader, slots[INTERPOLATE]) &&
           cb_check_line(loader, slots[TRANSPORT]) && take_fixed(loader, slots);
}
