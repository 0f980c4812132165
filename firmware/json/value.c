/* SPDX-License-Identifier: MIT
 * Single values of the coefficient file: numbers, words, texts, names, lists of numbers. */
#include <string.h>

#include "firmware/base/assert.h"
#include "firmware/json/decimal.h"
#include "firmware/json/reader.h"
#include "firmware/json/text.h"
#include "models/num.h"

struct cb_json_token cb_token_at(const struct cb_loader *loader, uint32_t at) {
    struct cb_json json;
    cb_json_start(&json, loader->text, loader->length, at);
    return cb_json_next(&json);
}

bool cb_same_text(const char *a, const char *b) {
    while (*a && *a == *b) {
        ++a;
        ++b;
    }
    return *a == *b;
}

uint8_t cb_find_name(const void *array, size_t stride, uint32_t count, const char *name) {
    const char *element = array;
    for (uint32_t i = 0; i < count; ++i, element += stride) {
        if (cb_same_text(element, name)) return (uint8_t)i;
    }
    return CB_NONE;
}

/* ---- numbers ---- */

/* Length of a text of the tables. */
static uint32_t table_length(const char *text) {
    for (uint32_t length = 0; length < CB_TABLE_TEXT; ++length)
        if (text[length] == '\0') return length;
    return CB_TABLE_TEXT;
}

float cb_number_of(const char *text) {
    float value = 0.0f;
    const bool is_number = cb_decimal_to_float(text, table_length(text), &value);
    CB_ASSERT(is_number);
    return value;
}

static uint32_t whole_of(const char *text) {
    uint32_t value = 0;
    const bool is_whole = cb_decimal_to_uint32(text, table_length(text), &value);
    CB_ASSERT(is_whole);
    return value;
}

static bool out_of_range(struct cb_loader *loader, uint32_t at, const char *least,
                         const char *most) {
    return cb_fail(loader, CB_ERROR_RANGE, at, "%o is outside the range of %s to %s", at, least,
                   most);
}

/* out: whether the token is a number within least … most, and *number that */
static bool is_within(const struct cb_loader *loader, struct cb_json_token token, const char *least,
                      const char *most, float *number) {
    return cb_decimal_to_float(loader->text + token.at, token.length, number) &&
           *number >= cb_number_of(least) && *number <= cb_number_of(most);
}

bool cb_read_float(struct cb_loader *loader, uint32_t at, const char *least, const char *most,
                   float *value) {
    const struct cb_json_token token = cb_token_at(loader, at);
    float number = 0.0f;
    if (token.kind != CB_JSON_NUMBER)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a number, not %o", at);
    if (!is_within(loader, token, least, most, &number))
        return out_of_range(loader, at, least, most);
    *value = number;
    return true;
}

/* Rejects a number that is no uint32_t; the message names its range or its notation. */
static bool not_whole(struct cb_loader *loader, struct cb_json_token token, const char *least,
                      const char *most) {
    const char *text = loader->text + token.at;
    float number = 0.0f;
    bool digits_only = true;
    for (uint32_t i = 0; i < token.length; ++i)
        digits_only = digits_only && text[i] >= '0' && text[i] <= '9';
    if (digits_only || !is_within(loader, token, least, most, &number))
        return out_of_range(loader, token.at, least, most);
    return cb_fail(loader, CB_ERROR_TYPE, token.at,
                   "must be a whole number written in digits only, not %o", token.at);
}

bool cb_read_whole(struct cb_loader *loader, uint32_t at, const char *least, const char *most,
                   uint32_t *value) {
    const struct cb_json_token token = cb_token_at(loader, at);
    uint32_t whole = 0;
    if (token.kind != CB_JSON_NUMBER)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a whole number, not %o", at);
    if (!cb_decimal_to_uint32(loader->text + token.at, token.length, &whole))
        return not_whole(loader, token, least, most);
    if (whole < whole_of(least) || whole > whole_of(most))
        return out_of_range(loader, at, least, most);
    *value = whole;
    return true;
}

bool cb_read_numbers(struct cb_loader *loader, uint32_t at, float *numbers, uint32_t max,
                     uint32_t *count) {
    struct cb_list list = cb_list(loader, at);
    *count = 0;
    while (cb_list_next(&list)) {
        if (*count == max)
            return cb_fail(loader, CB_ERROR_FULL, list.at,
                           "a list of numbers here holds at most %u", max);
        if (!cb_read_float(loader, list.at, CB_LEAST_NUMBER, CB_MOST_NUMBER, &numbers[*count]))
            return false;
        ++*count;
    }
    return true;
}

/* ---- texts ---- */

bool cb_find_word(const struct cb_word *words, const char *word, uint8_t *value) {
    for (; words->word; ++words) {
        if (!cb_same_text(words->word, word)) continue;
        *value = words->value;
        return true;
    }
    return false;
}

/* Lists the words in the message: "use a, b or c". */
static bool unknown_word(struct cb_loader *loader, uint32_t at, const struct cb_word *words) {
    char *const known = loader->scratch->known; /* not on the stack, because this is its deepest
                                                   path */
    const uint32_t size = sizeof loader->scratch->known;
    uint32_t used = 0;
    for (const struct cb_word *word = words; word->word; ++word) {
        const char *joint = word == words ? "" : word[1].word ? ", " : " or ";
        const uint32_t joint_length = table_length(joint), length = table_length(word->word);
        if (used + joint_length + length >= size) break;
        memcpy(known + used, joint, joint_length);
        memcpy(known + used + joint_length, word->word, length);
        used += joint_length + length;
    }
    known[used] = '\0';
    return cb_fail(loader, CB_ERROR_NAME, at, "%o is not known; use %s", at, known);
}

void cb_short_text(const char *text, struct cb_json_token token, char buffer[CB_KEY_SIZE]) {
    const uint32_t length = cb_json_text(text, token, buffer, CB_KEY_SIZE - 1);
    buffer[length < CB_KEY_SIZE ? length : 0] = '\0';
    if (table_length(buffer) != length) buffer[0] = '\0';
}

bool cb_read_word(struct cb_loader *loader, uint32_t at, const struct cb_word *words,
                  uint8_t *value) {
    const struct cb_json_token token = cb_token_at(loader, at);
    char word[CB_KEY_SIZE];
    if (token.kind != CB_JSON_STRING)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a text in double quotes, not %o", at);
    cb_short_text(loader->text, token, word);
    if (cb_find_word(words, word, value)) return true;
    return unknown_word(loader, at, words);
}

bool cb_read_text(struct cb_loader *loader, uint32_t at, char *buffer, uint32_t size) {
    const struct cb_json_token token = cb_token_at(loader, at);
    if (token.kind != CB_JSON_STRING)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a text in double quotes, not %o", at);
    const uint32_t length = cb_json_text(loader->text, token, buffer, size - 1);
    if (length >= size)
        return cb_fail(loader, CB_ERROR_NAME, at, "%o is longer than %u bytes", at, size - 1);
    for (uint32_t i = 0; i < length; ++i) {
        if (cb_control_length(buffer, length, i) > 0)
            return cb_fail(loader, CB_ERROR_NAME, at, "%o contains a control character", at);
    }
    memset(buffer + length, 0, size - length);
    return true;
}

static bool fits_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
}

bool cb_read_name(struct cb_loader *loader, uint32_t at, char name[CB_NAME_SIZE]) {
    if (!cb_read_text(loader, at, name, CB_NAME_SIZE)) return false;
    if (name[0] == '\0') return cb_fail(loader, CB_ERROR_NAME, at, "a name may not be empty");
    for (const char *c = name; *c; ++c) {
        if (!fits_name(*c))
            return cb_fail(loader, CB_ERROR_NAME, at,
                           "%o is no name: use letters A to Z, digits and _ - . only", at);
    }
    return true;
}

/* ---- lists ---- */

struct cb_list cb_list(const struct cb_loader *loader, uint32_t at) {
    struct cb_list list = {.at = at};
    cb_json_start(&list.json, loader->text, loader->length, at);
    cb_json_next(&list.json);
    return list;
}

bool cb_list_next(struct cb_list *list) {
    cb_json_skip(&list->json, 1);
    const struct cb_json_token token = cb_json_next(&list->json);
    if (token.kind == CB_JSON_ARRAY_END) return false;
    list->index = list->started ? list->index + 1 : 0;
    list->started = true;
    list->at = token.at;
    return true;
}

bool cb_list_has_room(struct cb_loader *loader, const struct cb_list *list, uint32_t max,
                      const char *what) {
    if (list->index < max) return true;
    return cb_fail(loader, CB_ERROR_FULL, list->at,
                   "the box has room for %u %s, and this is one more", max, what);
}

uint32_t cb_list_at(const struct cb_loader *loader, uint32_t at, uint32_t index) {
    struct cb_list list = cb_list(loader, at);
    for (uint32_t i = 0; i <= index; ++i) cb_list_next(&list);
    return list.at;
}
