/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/writer.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/files/output_file.h"

/* Appends. What does not fit is left out, and `used` beyond size says so. */
static void add_bytes(struct cb_writer *json, const char *bytes, size_t count) {
    const size_t room = json->used < json->size ? json->size - json->used : 0;
    if (room > 0) memcpy(json->text + json->used, bytes, count < room ? count : room);
    json->used += count;
}

static void add(struct cb_writer *json, const char *text) {
    add_bytes(json, text, strlen(text));
}

/* in : a number's format, of less than 512 characters: the longest is a double with decimals */
static __attribute__((format(printf, 2, 3))) void add_number(struct cb_writer *json,
                                                             const char *format, ...) {
    char digits[512];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(digits, sizeof digits, format, arguments);
    va_end(arguments);
    if (length > 0) add_bytes(json, digits, (size_t)length);
}

/* Whatever needs no escape goes at once: all of most strings. */
static void add_string(struct cb_writer *json, const char *text) {
    add(json, "\"");
    for (const char *plain = text;; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c >= 0x20 && c != '"' && c != '\\') continue;
        add_bytes(json, plain, (size_t)(text - plain));
        plain = text + 1;
        if (c == '\0') break;
        if (c < 0x20)
            add_number(json, "\\u%04x", c);
        else
            add_bytes(json, (const char[2]){'\\', *text}, 2);
    }
    add(json, "\"");
}

/* Separates an entry from the one before, and writes its key. */
static void next(struct cb_writer *json, const char *key, bool is_object) {
    const bool in_array = json->arrays >> json->depth & 1u;
    const bool own_line = !json->one_line && (json->depth == 1 || (in_array && is_object));
    if (json->begun) add(json, own_line ? "," : ", ");
    if (own_line) add(json, "\n");
    for (unsigned depth = 0; own_line && depth < json->depth; ++depth) add(json, "  ");
    json->begun = true;
    if (key == NULL) return;
    add_string(json, key);
    add(json, ": ");
}

static void open_one(struct cb_writer *json, const char *key, bool is_array) {
    next(json, key, !is_array);
    add(json, is_array ? "[" : "{");
    json->depth++;
    json->arrays &= ~(1u << json->depth);
    json->arrays |= (uint32_t)is_array << json->depth;
    json->begun = false;
}

struct cb_writer cb_writer_begin(char *text, size_t size, bool one_line) {
    struct cb_writer json = {.text = text, .size = size, .depth = 1, .one_line = one_line};
    add(&json, "{");
    return json;
}

size_t cb_writer_end(struct cb_writer *json) {
    add(json, json->one_line ? "}\n" : "\n}\n");
    return json->used < json->size ? json->used : 0;
}

void cb_writer_object(struct cb_writer *json, const char *key) {
    open_one(json, key, false);
}

void cb_writer_array(struct cb_writer *json, const char *key) {
    open_one(json, key, true);
}

void cb_writer_close(struct cb_writer *json) {
    add(json, json->arrays >> json->depth & 1u ? "]" : "}");
    json->depth--;
    json->begun = true;
}

void cb_writer_text(struct cb_writer *json, const char *key, const char *text) {
    next(json, key, false);
    add_string(json, text);
}

void cb_writer_whole(struct cb_writer *json, const char *key, int64_t number) {
    next(json, key, false);
    add_number(json, "%lld", (long long)number);
}

void cb_writer_truth(struct cb_writer *json, const char *key, bool value) {
    next(json, key, false);
    add(json, value ? "true" : "false");
}

void cb_writer_null(struct cb_writer *json, const char *key) {
    next(json, key, false);
    add(json, "null");
}

void cb_writer_number(struct cb_writer *json, const char *key, double number) {
    next(json, key, false);
    if (isfinite(number))
        add_number(json, "%.9g", number);
    else
        add(json, "null");
}

void cb_writer_thousandths(struct cb_writer *json, const char *key, double number) {
    next(json, key, false);
    add_number(json, "%.3f", number);
}

int cb_writer_replace(const char *path, bool durable, void (*put)(struct cb_writer *, const void *),
                      const void *from) {
    static char text[CB_WRITER_BYTES];
    struct cb_writer json = cb_writer_begin(text, sizeof text, false);
    put(&json, from);
    const size_t bytes = cb_writer_end(&json);
    return bytes == 0 ? EFBIG : cb_output_whole(path, text, bytes, durable);
}
