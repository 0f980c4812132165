/* SPDX-License-Identifier: MIT
 * The section "signals". */
#include <string.h>

#include "firmware/config/config.h"
#include "firmware/json/text.h"
#include "firmware/load/control.h"
#include "firmware/load/registers.h"
#include "firmware/load/sections.h"
#include "firmware/wire/number.h"
#include "models/num.h"

#define AT(member) .offset = offsetof(struct cb_signal_config, member)

enum {
    NAME,
    UNIT,
    PLC,
    CAN,
    BUS,
    OFFSET,
    UNIT_ID,
    REGISTER,
    TYPE,
    SCALE,
    ZERO,
    MIN,
    MAX,
    MAX_RATE,
    MAX_AGE,
    ESSENTIAL,
    LAG_OF,
    TAU,
    POWER,
    VELOCITY,
    HAND,
    PART,
    SIGNAL_KEYS
};

static const struct cb_word PART_WORDS[] = {
    {"value", CB_HAND_VALUE}, {"count", CB_HAND_COUNT}, {NULL, 0}};

static const struct cb_field SIGNAL_FIELDS[SIGNAL_KEYS] = {
    [NAME] = {"name", CB_FIELD_NAME, true, AT(name)},
    [UNIT] = {"unit", CB_FIELD_TEXT, true, AT(unit),
              .size = sizeof(((struct cb_signal_config *)0)->unit)},
    [PLC] = {"plc", CB_FIELD_UINT16, false, AT(reg), .least = "0", .most = "65535"},
    [CAN] = {"can", CB_FIELD_STRING, false, CB_NOT_STORED},
    [BUS] = {"bus", CB_FIELD_STRING, false, CB_NOT_STORED},
    [OFFSET] = {"offset", CB_FIELD_UINT16, false, AT(reg), .least = "0", .most = "7"},
    [UNIT_ID] = {"unit_id", CB_FIELD_UINT8, false, AT(bus_unit), .least = "1", .most = "247"},
    [REGISTER] = {"register", CB_FIELD_UINT16, false, AT(reg), .least = "0", .most = "65535"},
    [TYPE] = {"type", CB_FIELD_WORD, false, AT(type), .words = cb_number_words,
              .otherwise = "int16"},
    [SCALE] = {"scale", CB_FIELD_FLOAT, false, AT(scale), .least = "-1000000", .most = "1000000",
               .otherwise = "1"},
    [ZERO] = {"zero", CB_FIELD_FLOAT, false, AT(zero), .least = CB_LEAST_NUMBER,
              .most = CB_MOST_NUMBER, .otherwise = "0"},
    [MIN] = {"min", CB_FIELD_FLOAT, false, AT(min), .least = CB_LEAST_NUMBER,
             .most = CB_MOST_NUMBER},
    [MAX] = {"max", CB_FIELD_FLOAT, false, AT(max), .least = CB_LEAST_NUMBER,
             .most = CB_MOST_NUMBER},
    [MAX_RATE] = {"max_rate_per_s", CB_FIELD_FLOAT, false, AT(max_rate_per_s), .least = "0.000001",
                  .most = CB_MOST_NUMBER},
    [MAX_AGE] = {"max_age_ms", CB_FIELD_UINT32, false, AT(max_age_ms), .least = "1",
                 .most = "86400000"},
    [ESSENTIAL] = {"essential", CB_FIELD_BOOL, false, AT(essential)},
    [LAG_OF] = {"lag_of", CB_FIELD_STRING, false, CB_NOT_STORED},
    [TAU] = {"tau_s", CB_FIELD_FLOAT, false, AT(tau_s), .least = "0.001", .most = "86400"},
    [POWER] = {"power", CB_FIELD_UINT8, false, AT(power), .least = "1", .most = "2",
               .otherwise = "1"},
    [VELOCITY] = {"velocity", CB_FIELD_STRING, false, CB_NOT_STORED},
    [HAND] = {"hand", CB_FIELD_STRING, false, CB_NOT_STORED},
    [PART] = {"part", CB_FIELD_WORD, false, AT(bus), .words = PART_WORDS, .otherwise = "value"},
};
const struct cb_object cb_signal_object = {SIGNAL_FIELDS, SIGNAL_KEYS};

/* Sources by enum cb_signal_source: the key that selects one, and its name in messages about a
 * target without it. */
static const struct source {
    uint8_t key;
    const char *name;
    const char *lacking;
} SOURCES[] = {
    [CB_SOURCE_PLC] = {PLC, "plc", "PLC registers"},
    [CB_SOURCE_CAN] = {CAN, "can", "CAN bus"},
    [CB_SOURCE_BUS] = {BUS, "bus", "sensor bus"},
    [CB_SOURCE_LAG] = {LAG_OF, "lag_of", "lags"},
    [CB_SOURCE_HAND] = {HAND, "hand", "measurements by hand"},
};
enum { SOURCE_COUNT = sizeof SOURCES / sizeof SOURCES[0] };

/* Keys of one source only. */
static const struct {
    uint8_t key, source;
    bool required;
} SOURCE_KEYS[] = {
    {OFFSET, CB_SOURCE_CAN, false}, {UNIT_ID, CB_SOURCE_BUS, true}, {REGISTER, CB_SOURCE_BUS, true},
    {TAU, CB_SOURCE_LAG, true},     {POWER, CB_SOURCE_LAG, false},  {PART, CB_SOURCE_HAND, false},
};

/* in : at, the signal; its slots
 * out: the only source with a key, which the target has; or false and a message */
static bool find_source(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                        uint8_t *source) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < SOURCE_COUNT; ++i) {
        if (slots[SOURCES[i].key] == CB_ABSENT) continue;
        *source = (uint8_t)i;
        ++found;
    }
    if (found != 1)
        return cb_fail(
            loader, CB_ERROR_KEY, at,
            "exactly one of the keys plc, can, bus, hand and lag_of is needed: the source of "
            "a signal");
    if (*source == CB_SOURCE_LAG || loader->target->sources & 1u << *source) return true;
    return cb_fail(loader, CB_ERROR_PROFILE, slots[SOURCES[*source].key],
                   "%s reads no %s in this version", loader->target->name,
                   SOURCES[*source].lacking);
}

/* A lag has no keys of a reading: their values come from the signal that it follows. */
static bool check_lag_keys(struct cb_loader *loader, const uint32_t *slots) {
    static const uint8_t of_readings[] = {TYPE, SCALE,    ZERO,    MIN,
                                          MAX,  MAX_RATE, MAX_AGE, ESSENTIAL};
    for (uint32_t i = 0; i < sizeof of_readings; ++i) {
        if (slots[of_readings[i]] != CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, slots[of_readings[i]],
                           "a lag takes this from the signal that it follows; omit it");
    }
    return true;
}

/* out: true if the keys that every reading needs are present */
static bool check_measured_keys(struct cb_loader *loader, uint32_t at, const uint32_t *slots) {
    static const uint8_t required[] = {MIN, MAX};
    for (uint32_t i = 0; i < sizeof required; ++i) {
        if (slots[required[i]] == CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, at, "the key %s is missing",
                           SIGNAL_FIELDS[required[i]].key);
    }
    return true;
}

/* out: true if all required keys of the source are present and no key of another source is */
static bool check_source_keys(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                              uint8_t source) {
    for (uint32_t i = 0; i < sizeof SOURCE_KEYS / sizeof SOURCE_KEYS[0]; ++i) {
        const uint32_t key = SOURCE_KEYS[i].key;
        const bool present = slots[key] != CB_ABSENT;
        if (present && SOURCE_KEYS[i].source != source)
            return cb_fail(loader, CB_ERROR_KEY, slots[key], "this key is for %s signals only",
                           SOURCES[SOURCE_KEYS[i].source].name);
        if (!present && SOURCE_KEYS[i].source == source && SOURCE_KEYS[i].required)
            return cb_fail(loader, CB_ERROR_KEY, at, "the key %s is missing",
                           SIGNAL_FIELDS[key].key);
    }
    return source == CB_SOURCE_LAG ? check_lag_keys(loader, slots)
                                   : check_measured_keys(loader, at, slots);
}

/* ---- sources ---- */

/* Converts "0x181" to 0x181. An identifier above 0x7ff has 29 bits, and so has one of eight digits
 * ("0x00000181"). The last two of eight digits may be xx ("0x18feeexx"): any source address.
 * out: *id with its flags; false for any other text and beyond 29 bits */
static bool can_id_of(const char *text, uint32_t *id) {
    uint32_t value = 0, digits = 0, flags = 0;
    if (text[0] != '0' || text[1] != 'x' || text[2] == '\0') return false;
    for (const char *c = text + 2; *c; ++c, ++digits) {
        const bool any = digits >= 6 && *c == 'x';
        if (any != (flags != 0) && digits != 6) return false;
        if (any) flags = CB_CAN_ANY_SOURCE;
        if ((!any && cb_hex_digit(*c) > 15) || digits == 8) return false;
        value = value << 4 | (any ? 0 : cb_hex_digit(*c));
    }
    if (value > 0x1FFFFFFFu || (flags != 0 && digits != 8)) return false;
    *id = flags | (value > 0x7FF || digits == 8 ? value | CB_CAN_EXTENDED : value);
    return true;
}

static bool load_can(struct cb_loader *loader, const uint32_t *slots,
                     struct cb_signal_config *signal) {
    char text[16];
    if (!cb_read_text(loader, slots[CAN], text, sizeof text)) return false;
    if (!can_id_of(text, &signal->can_id))
        return cb_fail(loader, CB_ERROR_RANGE, slots[CAN],
                       "%o is not a CAN identifier; write \"0x181\", up to \"0x1fffffff\", or "
                       "\"0x18feeexx\" for any source address",
                       slots[CAN]);
    if (signal->reg + cb_number_bytes(signal->type) <= 8) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[OFFSET],
                   "from byte %o on, its type exceeds the 8 bytes of a frame", slots[OFFSET]);
}

/* Only CAN frames carry single bytes. */
static bool check_register_type(struct cb_loader *loader, const uint32_t *slots, uint8_t type) {
    if (cb_number_bytes(type) > 1) return true;
    return cb_fail(loader, CB_ERROR_PROFILE, slots[TYPE],
                   "%o is for can signals only; a register has 16 bits: use uint16 or int16",
                   slots[TYPE]);
}

static bool load_bus(struct cb_loader *loader, const uint32_t *slots,
                     struct cb_signal_config *signal) {
    const struct cb_config *config = loader->config;
    char name[CB_NAME_SIZE];
    if (!check_register_type(loader, slots, signal->type)) return false;
    if (!cb_read_name(loader, slots[BUS], name)) return false;
    signal->bus = cb_find_name(config->buses, sizeof config->buses[0], config->buses_count, name);
    if (signal->bus == CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, slots[BUS], "the section buses has no bus called %o",
                       slots[BUS]);
    /* by default a value lasts for three readings at least, as one from the PLC does */
    const uint32_t three_readings_ms = (3 * config->buses[signal->bus].every_us + 999) / 1000;
    if (slots[MAX_AGE] == CB_ABSENT && signal->max_age_ms < three_readings_ms)
        signal->max_age_ms = three_readings_ms;
    if (signal->reg + cb_number_registers(signal->type) <= 65536) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[REGISTER], "its second register is above 65535");
}

/* The name that `compbox measured` gives: it is stored as a number (cb_hand_key). */
static bool load_hand(struct cb_loader *loader, const uint32_t *slots,
                      struct cb_signal_config *signal) {
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, slots[HAND], name)) return false;
    if (slots[TYPE] != CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, slots[TYPE],
                       "a measurement by hand has no registers; omit it");
    signal->type = CB_NUMBER_FLOAT32;
    signal->can_id = cb_hand_key(name);
    if (signal->can_id != 0) return true;
    return cb_fail(loader, CB_ERROR_NAME, slots[HAND],
                   "%o is longer than 4 characters; use the name of the axis", slots[HAND]);
}

/* in : the signal's source and slots; index: its own, for messages about shared registers
 * out: the fields of the source, checked; or false and a message */
static bool load_source(struct cb_loader *loader, const uint32_t *slots,
                        struct cb_signal_config *signal, uint8_t index) {
    switch ((enum cb_signal_source)signal->source) {
        case CB_SOURCE_PLC:
            return check_register_type(loader, slots, signal->type) &&
                   cb_check_signal_type(loader, slots[TYPE], signal->type) &&
                   cb_take_read(loader, slots[PLC], signal->type, (uint8_t)(CB_USER_SIGNAL + index),
                                &signal->reg);
        case CB_SOURCE_CAN:
            return load_can(loader, slots, signal);
        case CB_SOURCE_BUS:
            return load_bus(loader, slots, signal);
        case CB_SOURCE_HAND:
            return load_hand(loader, slots, signal);
        case CB_SOURCE_LAG:
            return true; /* resolved when all signals are known */
    }
    return true;
}

/* ---- one signal ---- */

static bool check_numbers(struct cb_loader *loader, const uint32_t *slots,
                          const struct cb_signal_config *signal) {
    if (cb_abs(signal->scale) < 1e-12f)
        return cb_fail(loader, CB_ERROR_RANGE, slots[SCALE],
                       "with a scale of %o all readings are equal", slots[SCALE]);
    if (signal->min < signal->max) return true;
    return cb_fail(loader, CB_ERROR_ORDER, slots[MAX], "%o is not above min (%o)", slots[MAX],
                   slots[MIN]);
}

/* Defaults that depend on other keys: a position is essential, and leads if it comes from the PLC;
 * the maximum age depends on the source. */
static void set_defaults(const struct cb_config *config, const uint32_t *slots,
                         struct cb_signal_config *signal) {
    const bool position = cb_same_text(signal->unit, "mm") || cb_same_text(signal->unit, "deg");
    const uint32_t three_periods_ms = (3 * config->period_us + 999) / 1000;
    if (signal->source == CB_SOURCE_LAG) return;
    if (slots[ESSENTIAL] == CB_ABSENT) signal->essential = position;
    if (slots[MAX_AGE] == CB_ABSENT)
        signal->max_age_ms = signal->source == CB_SOURCE_PLC ? three_periods_ms : 2000;
    signal->leads = position && signal->source == CB_SOURCE_PLC;
}

static bool load_signal(struct cb_loader *loader, uint32_t at, uint8_t index) {
    struct cb_config *config = loader->config;
    struct cb_signal_config *signal = &config->signals[index];
    uint32_t slots[SIGNAL_KEYS];
    if (!cb_read_object(loader, at, &cb_signal_object, signal, slots)) return false;
    if (cb_find_name(config->signals, sizeof *signal, index, signal->name) != CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, slots[NAME], "another signal is called %o",
                       slots[NAME]);
    if (!find_source(loader, at, slots, &signal->source)) return false;
    if (!check_source_keys(loader, at, slots, signal->source)) return false;
    if (signal->source != CB_SOURCE_LAG && !check_numbers(loader, slots, signal)) return false;
    set_defaults(config, slots, signal);
    return load_source(loader, slots, signal, index);
}

bool cb_load_signals(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_SIGNALS, "signals")) return false;
        if (!load_signal(loader, list.at, config->signals_count)) return false;
        ++config->signals_count;
    }
    if (config->signals_count > 0)
        return cb_resolve_lags(loader, at) && cb_resolve_velocities(loader, at);
    return cb_fail(loader, CB_ERROR_KEY, at, "at least one signal is needed");
}
