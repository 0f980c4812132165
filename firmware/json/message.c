/* SPDX-License-Identifier: MIT
 * The loader's one message: path, sentence, line and column. The path is found by a second walk
 * over the text up to the mistake, so that a valid file costs no bookkeeping. */
#include <stdarg.h>
#include <string.h>

#include "firmware/json/reader.h"
#include "firmware/json/text.h"

enum {
    QUOTE_BYTES = 48, /* of a value, as in the file */
    KEY_BYTES = 32,   /* of a key in the path */
};

/* ---- text into fixed memory ---- */

struct writer {
    char *text;
    uint32_t used, size; /* size: without the ending 0 */
    bool full;           /* output was cut; nothing more is written */
};

static uint32_t text_length(const char *text) {
    const char *end = text;
    while (*end) ++end;
    return (uint32_t)(end - text);
}

/* Largest length <= limit that does not cut a UTF-8 character of valid text. */
static uint32_t whole_characters(const char *text, uint32_t limit) {
    while (limit > 0 && ((uint8_t)text[limit] & 0xC0) == 0x80) --limit;
    return limit;
}

static void put(struct writer *writer, const char *text, uint32_t length) {
    const uint32_t room = writer->size - writer->used;
    if (writer->full) return;
    if (length > room) {
        length = whole_characters(text, room);
        writer->full = true;
    }
    memcpy(writer->text + writer->used, text, length);
    writer->used += length;
}

static void put_text(struct writer *writer, const char *text) {
    put(writer, text, text_length(text));
}

static void put_whole(struct writer *writer, uint32_t number) {
    char digits[10];
    uint32_t first = sizeof digits;
    do {
        digits[--first] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    put(writer, digits + first, (uint32_t)sizeof digits - first);
}

/* Copies text of the file; a control character, which could forge a line of the log, becomes
 * '?'. */
static void put_shown(struct writer *writer, const char *text, uint32_t length) {
    uint32_t first = 0;
    for (uint32_t at = 0; at < length; ++at) {
        const uint32_t control = cb_control_length(text, length, at);
        if (control == 0) continue;
        put(writer, text + first, at - first);
        put_text(writer, "?");
        first = at + control;
    }
    put(writer, text + first, length - first);
}

/* Copies a piece of the file, shortened to about `most` bytes. */
static void put_piece(struct writer *writer, const char *text, uint32_t length, uint32_t most) {
    if (length <= most) {
        put_shown(writer, text, length);
        return;
    }
    put_shown(writer, text, whole_characters(text, most));
    put_text(writer, "…");
}

/* A value as in the file; a container by its kind. */
static void put_value(struct writer *writer, const struct cb_loader *loader, uint32_t at) {
    const struct cb_json_token token = cb_token_at(loader, at);
    if (token.kind == CB_JSON_OBJECT) {
        put_text(writer, "an object {…}");
    } else if (token.kind == CB_JSON_ARRAY) {
        put_text(writer, "a list […]");
    } else {
        put_piece(writer, loader->text + token.at, token.length, QUOTE_BYTES);
    }
}

/* Ends the text with 0, after three dots if it was cut. */
static void finish(struct writer *writer) {
    const char dots[] = "…";
    if (writer->full) {
        uint32_t cut = writer->used;
        while (cut + sizeof dots - 1 > writer->size) cut = whole_characters(writer->text, cut - 1);
        memcpy(writer->text + cut, dots, sizeof dots - 1);
        writer->used = cut + (uint32_t)sizeof dots - 1;
    }
    writer->text[writer->used] = '\0';
}

/* ---- path ---- */

enum { NO_INDEX = -1 };

/* Position of the walk in one open container. */
struct level {
    uint32_t key_at;     /* object: offset of the current key */
    uint32_t key_length; /* … and its length; 0: none yet, or an array */
    int32_t index;       /* array: the current element; NO_INDEX: none yet, or an object */
};

struct walk {
    struct cb_json json;
    struct level levels[CB_JSON_MAX_DEPTH];
};

static bool is_object(const struct walk *walk, uint32_t level) {
    return walk->json.objects >> level & 1u;
}

/* Records that a key or value of the innermost open container (of `depth`) begins. */
static void enter_member(struct walk *walk, uint32_t depth, struct cb_json_token token) {
    if (depth == 0) return;
    struct level *level = &walk->levels[depth - 1];
    if (!is_object(walk, depth - 1)) ++level->index;
    if (token.kind != CB_JSON_KEY) return;
    level->key_at = token.at;
    level->key_length = token.length;
}

static void open_level(struct walk *walk, uint32_t depth) {
    walk->levels[depth] = (struct level){0, 0, NO_INDEX};
}

/* For a syntax error after the token `before`: checks whether a new key or element begins there. */
static void enter_bad(struct walk *walk, struct cb_json_token before) {
    const char *text = walk->json.text;
    uint32_t at = before.at + before.length;
    if (walk->json.depth == 0) return;
    struct level *level = &walk->levels[walk->json.depth - 1];
    while (at < walk->json.length &&
           (text[at] == ' ' || text[at] == '\t' || text[at] == '\r' || text[at] == '\n'))
        ++at;
    const bool opened = before.kind == CB_JSON_OBJECT || before.kind == CB_JSON_ARRAY;
    const bool comma = at < walk->json.length && text[at] == ',';
    if (!opened && !comma) return;
    level->key_length = 0;
    ++level->index;
}

/* Walks to the token at offset `at`; returns the number of levels above it. */
static uint32_t walk_to(struct walk *walk, uint32_t at) {
    struct cb_json_token before = {CB_JSON_END, 0, 0};
    for (;;) {
        const uint32_t depth = walk->json.depth;
        const struct cb_json_token token = cb_json_next(&walk->json);
        switch (token.kind) {
            case CB_JSON_BAD:
                enter_bad(walk, before);
                return walk->json.depth;
            case CB_JSON_END:
                return 0;
            case CB_JSON_OBJECT_END:
            case CB_JSON_ARRAY_END:
                break;
            case CB_JSON_OBJECT:
            case CB_JSON_ARRAY:
                enter_member(walk, depth, token);
                open_level(walk, depth);
                break;
            case CB_JSON_KEY:
            case CB_JSON_STRING:
            case CB_JSON_NUMBER:
            case CB_JSON_TRUE:
            case CB_JSON_FALSE:
            case CB_JSON_NULL:
                enter_member(walk, depth, token);
                break;
        }
        if (token.at >= at) return depth;
        before = token;
    }
}

/* Writes terms[3].knots[7] and ": "; nothing for the whole file. */
static void put_path(struct writer *writer, const struct cb_loader *loader, uint32_t at) {
    struct walk walk;
    cb_json_start(&walk.json, loader->text, loader->length, 0);
    const uint32_t levels = walk_to(&walk, at);
    for (uint32_t i = 0; i < levels; ++i) {
        const struct level *level = &walk.levels[i];
        if (is_object(&walk, i) && level->key_length > 0) {
            if (writer->used > 0) put_text(writer, ".");
            put_piece(writer, loader->text + level->key_at + 1, level->key_length - 2, KEY_BYTES);
        } else if (!is_object(&walk, i)) {
            put_text(writer, "[");
            put_whole(writer, (uint32_t)level->index);
            put_text(writer, "]");
        }
    }
    if (writer->used > 0) put_text(writer, ": ");
}

/* ---- sentence ---- */

/* in : sentence with %o, %s and %u as cb_fail (reader.h), and their arguments in order
 * out: the sentence with its arguments in the writer, cut where that is full */
static void put_sentence(struct writer *writer, const struct cb_loader *loader,
                         const char *sentence, va_list *arguments) {
    for (const char *c = sentence; *c; ++c) {
        if (*c != '%') {
            put(writer, c, 1);
            continue;
        }
        switch (*++c) {
            case 'o':
                put_value(writer, loader, va_arg(*arguments, uint32_t));
                break;
            case 's':
                put_text(writer, va_arg(*arguments, const char *));
                break;
            default:
                put_whole(writer, va_arg(*arguments, uint32_t));
                break;
        }
    }
}

bool cb_fail(struct cb_loader *loader, enum cb_error error, uint32_t at, const char *sentence,
             ...) {
    struct cb_message *message = loader->message;
    struct writer writer = {message->text, 0, sizeof message->text - 1, false};
    struct cb_json_place place = {0, 0};
    va_list arguments;
    if (at != CB_ABSENT) {
        put_path(&writer, loader, at);
        place = cb_json_locate(loader->text, at);
    }
    va_start(arguments, sentence);
    put_sentence(&writer, loader, sentence, &arguments);
    va_end(arguments);
    finish(&writer);
    message->line = place.line;
    message->column = place.column;
    loader->error = error;
    return false;
}
