/* SPDX-License-Identifier: MIT
 * Objects of the coefficient file, read by the table of their keys. */
#include <string.h>

#include "firmware/json/reader.h"

struct cb_members cb_members(const struct cb_loader *loader, uint32_t at) {
    struct cb_members members;
    cb_json_start(&members.json, loader->text, loader->length, at);
    cb_json_next(&members.json);
    return members;
}

bool cb_members_next(struct cb_members *members) {
    cb_json_skip(&members->json, 1);
    members->key = cb_json_next(&members->json);
    if (members->key.kind != CB_JSON_KEY) return false;
    members->at = cb_json_next(&members->json).at;
    return true;
}

uint32_t cb_find_key(const struct cb_loader *loader, uint32_t at, const char *key) {
    char name[CB_KEY_SIZE];
    if (cb_token_at(loader, at).kind != CB_JSON_OBJECT) return CB_ABSENT;
    struct cb_members members = cb_members(loader, at);
    while (cb_members_next(&members)) {
        cb_short_text(loader->text, members.key, name);
        if (cb_same_text(name, key)) return members.at;
    }
    return CB_ABSENT;
}

static uint32_t field_of(const struct cb_object *object, const char *key) {
    uint32_t i = 0;
    while (i < object->count && !cb_same_text(object->fields[i].key, key)) ++i;
    return i;
}

static bool unknown_key(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                        const char *key) {
    const char *likely = cb_likely_key(object, key);
    if (likely) return cb_fail(loader, CB_ERROR_KEY, at, "unknown key; is %s meant?", likely);
    return cb_fail(loader, CB_ERROR_KEY, at, "unknown key");
}

/* Records the offset of each key's value. */
static bool collect(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                    uint32_t *slots) {
    char key[CB_KEY_SIZE];
    for (uint32_t i = 0; i < object->count; ++i) slots[i] = CB_ABSENT;
    struct cb_members members = cb_members(loader, at);
    while (cb_members_next(&members)) {
        cb_short_text(loader->text, members.key, key);
        const uint32_t i = field_of(object, key);
        if (i == object->count) return unknown_key(loader, members.key.at, object, key);
        if (slots[i] != CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, members.key.at, "this key occurs twice");
        slots[i] = members.at;
    }
    return true;
}

static bool nothing_missing(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                            const uint32_t *slots) {
    for (uint32_t i = 0; i < object->count; ++i) {
        if (object->fields[i].required && slots[i] == CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, at, "the key %s is missing",
                           object->fields[i].key);
    }
    return true;
}

/* ---- one value ---- */

static void store_float(const struct cb_field *field, void *into, float value) {
    memcpy((char *)into + field->offset, &value, sizeof value);
}

/* Stores an integer that fits the field's type. */
static void store_whole(const struct cb_field *field, void *into, uint32_t value) {
    char *place = (char *)into + field->offset;
    const uint16_t half = (uint16_t)value;
    const uint8_t byte = (uint8_t)value;
    if (field->kind == CB_FIELD_UINT16) {
        memcpy(place, &half, sizeof half);
    } else if (field->kind == CB_FIELD_UINT32 || field->kind == CB_FIELD_MS) {
        memcpy(place, &value, sizeof value);
    } else {
        memcpy(place, &byte, sizeof byte);
    }
}

/* Milliseconds, 0 … 60 000, to the nearest microsecond. */
static uint32_t microseconds(float milliseconds) {
    return (uint32_t)(milliseconds * 1000.0f + 0.5f);
}

static bool read_bool(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                      void *into) {
    const enum cb_json_kind kind = cb_token_at(loader, at).kind;
    const bool value = kind == CB_JSON_TRUE;
    if (!value && kind != CB_JSON_FALSE)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be true or false, not %o", at);
    memcpy((char *)into + field->offset, &value, sizeof value);
    return true;
}

static bool read_number(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                        void *into) {
    float number = 0.0f;
    if (!cb_read_float(loader, at, field->least, field->most, &number)) return false;
    if (field->kind == CB_FIELD_MS) {
        store_whole(field, into, microseconds(number));
    } else {
        store_float(field, into, number);
    }
    return true;
}

static bool read_whole(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                       void *into) {
    uint32_t number = 0;
    if (!cb_read_whole(loader, at, field->least, field->most, &number)) return false;
    store_whole(field, into, number);
    return true;
}

static bool read_sign(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                      void *into) {
    float number = 0.0f;
    if (!cb_read_float(loader, at, "-1", "1", &number)) return false;
    if (number != 1.0f && number != -1.0f)
        return cb_fail(loader, CB_ERROR_RANGE, at, "must be 1 or -1, not %o", at);
    *((int8_t *)into + field->offset) = number > 0.0f ? 1 : -1;
    return true;
}

static bool read_word(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                      void *into) {
    return cb_read_word(loader, at, field->words, (uint8_t *)into + field->offset);
}

static bool must_be(struct cb_loader *loader, uint32_t at, enum cb_json_kind kind,
                    const char *what) {
    if (cb_token_at(loader, at).kind == kind) return true;
    return cb_fail(loader, CB_ERROR_TYPE, at, "must be %s, not %o", what, at);
}

/* in : at: the value of a key; into: the struct of the table's offsets
 * out: true: the value has the field's kind and range, and simple values are stored; false: the
 *      message is written */
static bool read_field(struct cb_loader *loader, uint32_t at, const struct cb_field *field,
                       void *into) {
    switch (field->kind) {
        case CB_FIELD_FLOAT:
        case CB_FIELD_MS:
            return read_number(loader, at, field, into);
        case CB_FIELD_UINT8:
        case CB_FIELD_UINT16:
        case CB_FIELD_UINT32:
            return read_whole(loader, at, field, into);
        case CB_FIELD_SIGN:
            return read_sign(loader, at, field, into);
        case CB_FIELD_BOOL:
            return read_bool(loader, at, field, into);
        case CB_FIELD_WORD:
            return read_word(loader, at, field, into);
        case CB_FIELD_NAME:
            return cb_read_name(loader, at, (char *)into + field->offset);
        case CB_FIELD_TEXT:
            return cb_read_text(loader, at, (char *)into + field->offset, field->size);
        case CB_FIELD_STRING:
            return must_be(loader, at, CB_JSON_STRING, "a text in double quotes");
        case CB_FIELD_OBJECT:
            return must_be(loader, at, CB_JSON_OBJECT, "an object {…}");
        case CB_FIELD_ARRAY:
            return must_be(loader, at, CB_JSON_ARRAY, "a list […]");
        case CB_FIELD_ANY:
            return true;
        case CB_FIELD_LATER:
            break;
    }
    return cb_fail(loader, CB_ERROR_KEY, at, "this version of compbox does not have %s yet",
                   field->key);
}

/* ---- absent keys ---- */

/* in : a default of the table, which is valid by construction (a test loads every one) */
static void store_default(const struct cb_field *field, void *into) {
    const char *text = field->otherwise;
    float number = 0.0f;
    if (field->kind == CB_FIELD_BOOL) {
        const bool value = cb_same_text(text, "true");
        memcpy((char *)into + field->offset, &value, sizeof value);
    } else if (field->kind == CB_FIELD_WORD) {
        cb_find_word(field->words, text, (uint8_t *)into + field->offset);
    } else {
        number = cb_number_of(text);
        if (field->kind == CB_FIELD_FLOAT) {
            store_float(field, into, number);
        } else {
            store_whole(field, into,
                        field->kind == CB_FIELD_MS ? microseconds(number) : (uint32_t)number);
        }
    }
}

bool cb_read_object(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                    void *into, uint32_t *slots) {
    if (!must_be(loader, at, CB_JSON_OBJECT, "an object {…}")) return false;
    if (!collect(loader, at, object, slots)) return false;
    if (!nothing_missing(loader, at, object, slots)) return false;
    for (uint32_t i = 0; i < object->count; ++i) {
        const struct cb_field *field = &object->fields[i];
        if (slots[i] != CB_ABSENT) {
            if (!read_field(loader, slots[i], field, into)) return false;
        } else if (field->otherwise) {
            store_default(field, into);
        }
    }
    return true;
}
