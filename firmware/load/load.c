/* SPDX-License-Identifier: MIT
 * The loader's entry, and the small sections. The first pass checks that the text is JSON. The
 * second pass loads each section after those that it needs, whatever their order in the file. */
#include "firmware/load/load.h"

#include <string.h>

#include "firmware/config/config.h"
#include "firmware/config/derive.h"
#include "firmware/load/sections.h"
#include "firmware/terms/load.h"
#include "firmware/terms/terms.h"

#define AT(member) .offset = offsetof(struct cb_config, member)

enum {
    FORMAT,
    REVISION,
    MACHINE,
    CYCLE,
    PLC,
    BUSES,
    CAN,
    SIGNALS,
    SENSORS,
    TERMS,
    CHANNELS,
    PAIRS,
    SAFETY,
    PROVENANCE,
    TOP_KEYS
};

static const struct cb_field TOP_FIELDS[TOP_KEYS] = {
    [FORMAT] = {"format", CB_FIELD_STRING, true, CB_NOT_STORED},
    [REVISION] = {"revision", CB_FIELD_UINT32, true, AT(revision), .least = "0",
                  .most = "4294967295"},
    [MACHINE] = {"machine", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [CYCLE] = {"cycle", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [PLC] = {"plc", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [BUSES] = {"buses", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [CAN] = {"can", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [SIGNALS] = {"signals", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [SENSORS] = {"sensors", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [TERMS] = {"terms", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CHANNELS] = {"channels", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [PAIRS] = {"pairs", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [SAFETY] = {"safety", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [PROVENANCE] = {"provenance", CB_FIELD_ANY, false, CB_NOT_STORED},
};
const struct cb_object cb_top_object = {TOP_FIELDS, TOP_KEYS};

enum { MACHINE_NAME, MACHINE_AXES, MACHINE_KEYS };
static const struct cb_field MACHINE_FIELDS[MACHINE_KEYS] = {
    [MACHINE_NAME] = {"name", CB_FIELD_TEXT, true, AT(machine),
                      .size = sizeof(((struct cb_config *)0)->machine)},
    [MACHINE_AXES] = {"axes", CB_FIELD_ARRAY, false, CB_NOT_STORED},
};
const struct cb_object cb_machine_object = {MACHINE_FIELDS, MACHINE_KEYS};

enum { PERIOD, LEAD, CYCLE_KEYS };
static const struct cb_field CYCLE_FIELDS[CYCLE_KEYS] = {
    [PERIOD] = {"period_ms", CB_FIELD_MS, true, AT(period_us), .least = "1", .most = "1000"},
    [LEAD] = {"lead_ms", CB_FIELD_ANY, false, CB_NOT_STORED},
};
const struct cb_object cb_cycle_object = {CYCLE_FIELDS, CYCLE_KEYS};

enum { HOLD, RAMP, SAFETY_KEYS };
static const struct cb_field SAFETY_FIELDS[SAFETY_KEYS] = {
    [HOLD] = {"hold_ms", CB_FIELD_MS, true, AT(hold_us), .least = "0", .most = "60000"},
    [RAMP] = {"ramp_um_per_s", CB_FIELD_FLOAT, true, AT(ramp_um_per_s), .least = "0.001",
              .most = "1000000"},
};
const struct cb_object cb_safety_object = {SAFETY_FIELDS, SAFETY_KEYS};

/* First pass. out: true if the whole text is one JSON value */
static bool check_syntax(struct cb_loader *loader) {
    struct cb_json json;
    struct cb_json_token token;
    cb_json_start(&json, loader->text, loader->length, 0);
    do {
        token = cb_json_next(&json);
    } while (token.kind != CB_JSON_END && token.kind != CB_JSON_BAD);
    if (token.kind == CB_JSON_END) return true;
    return cb_fail(loader, CB_ERROR_SYNTAX, token.at, "%s", json.mistake);
}

/* Called before any other key is read: a newer format may have keys that this version does not
 * know. */
static bool check_format(struct cb_loader *loader, uint32_t root) {
    char format[CB_KEY_SIZE];
    const uint32_t at = cb_find_key(loader, root, "format");
    if (at == CB_ABSENT) return true; /* not an object, or the key is missing: reported later */
    const struct cb_json_token token = cb_token_at(loader, at);
    if (token.kind == CB_JSON_STRING) {
        cb_short_text(loader->text, token, format);
        if (cb_same_text(format, "compbox/1")) return true;
    }
    return cb_fail(loader, CB_ERROR_FORMAT, at, "this box reads \"compbox/1\", not %o", at);
}

/* The box does not use axis names. out: true if they are different names */
static bool check_axes(struct cb_loader *loader, uint32_t at) {
    char(*const names)[CB_NAME_SIZE] = loader->scratch->axes;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_CHANNELS, "axes")) return false;
        if (!cb_read_name(loader, list.at, names[list.index])) return false;
        if (cb_find_name(names, CB_NAME_SIZE, list.index, names[list.index]) != CB_NONE)
            return cb_fail(loader, CB_ERROR_NAME, list.at, "another axis is called %o", list.at);
    }
    return true;
}

/* in : at, milliseconds or "measured"; CB_ABSENT: 0 */
static bool read_lead(struct cb_loader *loader, uint32_t at) {
    static const struct cb_word words[] = {{"measured", true}, {0, 0}};
    struct cb_config *config = loader->config;
    float lead_ms = 0.0f;
    uint8_t measured = false;
    if (at == CB_ABSENT) return true;
    if (cb_token_at(loader, at).kind == CB_JSON_STRING) {
        if (!cb_read_word(loader, at, words, &measured)) return false;
        config->lead_measured = true;
        return true;
    }
    if (!cb_read_float(loader, at, "0", "500", &lead_ms)) return false;
    config->lead_us = (uint32_t)(lead_ms * 1000.0f + 0.5f);
    return true;
}

static bool load_small_sections(struct cb_loader *loader, const uint32_t *top) {
    struct cb_config *config = loader->config;
    uint32_t slots[CB_MAX_FIELDS];
    if (!cb_read_object(loader, top[MACHINE], &cb_machine_object, config, slots)) return false;
    if (slots[MACHINE_AXES] != CB_ABSENT && !check_axes(loader, slots[MACHINE_AXES])) return false;
    return cb_read_object(loader, top[CYCLE], &cb_cycle_object, config, slots) &&
           read_lead(loader, slots[LEAD]) &&
           cb_read_object(loader, top[SAFETY], &cb_safety_object, config, slots);
}

/* Second pass: loads each section after those that it needs. */
static bool load_sections(struct cb_loader *loader) {
    struct cb_json json;
    uint32_t top[TOP_KEYS];
    cb_json_start(&json, loader->text, loader->length, 0);
    const uint32_t root = cb_json_next(&json).at;
    if (!check_format(loader, root)) return false;
    if (!cb_read_object(loader, root, &cb_top_object, loader->config, top)) return false;
    return load_small_sections(loader, top) && cb_load_plc(loader, top[PLC]) &&
           cb_load_can(loader, top[CAN]) &&
           (top[BUSES] == CB_ABSENT || cb_load_buses(loader, top[BUSES])) &&
           cb_load_signals(loader, top[SIGNALS]) &&
           (top[SENSORS] == CB_ABSENT || cb_load_sensors(loader, top[SENSORS])) &&
           cb_load_terms(loader, top[TERMS]) && cb_load_channels(loader, top[CHANNELS]) &&
           cb_resolve_probes(loader, top[TERMS], top[CHANNELS]) &&
           (top[PAIRS] == CB_ABSENT || cb_load_pairs(loader, top[PAIRS]));
}

/* out: true if there is only white space */
static bool is_blank(const char *text, size_t length) {
    for (size_t i = 0; i < length; ++i) {
        if (text[i] != ' ' && text[i] != '\t' && text[i] != '\r' && text[i] != '\n') return false;
    }
    return true;
}

enum cb_error cb_config_load(struct cb_config *config, const char *text, size_t length,
                             const struct cb_target *target, struct cb_load_scratch *scratch,
                             struct cb_message *message) {
    struct cb_loader loader = {text, (uint32_t)length, config, target, scratch, message, CB_OK};
    memset(config, 0, sizeof *config);
    memset(scratch, 0, sizeof *scratch);
    memset(message, 0, sizeof *message);
    if (length > CB_MAX_TEXT_BYTES) {
        cb_fail(&loader, CB_ERROR_TOO_LARGE, CB_ABSENT,
                "the file has %u bytes, more than the %u that the box holds", (uint32_t)length,
                (uint32_t)CB_MAX_TEXT_BYTES);
    } else if (is_blank(text, length)) {
        cb_fail(&loader, CB_ERROR_EMPTY, CB_ABSENT, "the file is empty");
    } else if (check_syntax(&loader)) {
        if (load_sections(&loader)) {
            cb_config_derive(config);
            cb_terms_derive(config);
        }
    }
    return loader.error;
}
