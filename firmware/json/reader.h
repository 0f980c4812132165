/* SPDX-License-Identifier: MIT
 * Inside of the loader: reading of objects of the coefficient file by tables of their keys.
 *
 * A first pass over the text checks that it is JSON. After that a value is identified by its offset
 * in the text, and any part can be read in any order. Every function that can fail returns false
 * after it has written the one message. */
#ifndef COMPBOX_FIRMWARE_JSON_READER_H
#define COMPBOX_FIRMWARE_JSON_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/config/loading.h"
#include "firmware/json/json.h"

/* Numbers of the file are within ±1e9: far beyond any machine in mm, µm, °C or 1/min, and far
 * enough from FLT_MAX that no later sum or product overflows. */
#define CB_LEAST_NUMBER "-1e9"
#define CB_MOST_NUMBER "1e9"

enum {
    CB_MAX_FIELDS = 24, /* keys of the largest object */
    CB_KEY_SIZE = 32,   /* longest known key or word, with the ending 0 */
    CB_TABLE_TEXT = 64, /* longest text in a table */
};
#define CB_ABSENT UINT32_MAX /* offset of an absent key */

/* Arguments `first` … are checked against the sentence, argument number `sentence`; by the builds
 * for Linux, because uint32_t is an unsigned long, and not %u, to a compiler for bare metal. */
#if defined(__GNUC__) && defined(__linux__)
#define CB_PRINTF(sentence, first) __attribute__((format(printf, sentence, first)))
#else
#define CB_PRINTF(sentence, first)
#endif

struct cb_loader {
    const char *text;
    uint32_t length;
    struct cb_config *config;
    const struct cb_target *target;
    struct cb_load_scratch *scratch;
    struct cb_message *message;
    enum cb_error error;
};

/* Writes the message: path of the value at `at`, the sentence, line and column. In the sentence, %o
 * takes the offset (uint32_t) of a value and quotes it as in the file (a control character as '?'),
 * %s a text, %u a uint32_t; there are no flags and no other letters. The compiler compares them
 * with the arguments as it does for printf. at = CB_ABSENT: the file as a whole, no place.
 * out: always false. */
CB_PRINTF(4, 5)
bool cb_fail(struct cb_loader *loader, enum cb_error error, uint32_t at, const char *sentence, ...);

/* ---- tables of keys ---- */

enum cb_field_kind {
    CB_FIELD_FLOAT,  /* number -> float */
    CB_FIELD_MS,     /* number of milliseconds -> uint32_t microseconds */
    CB_FIELD_UINT8,  /* whole number */
    CB_FIELD_UINT16, /* whole number */
    CB_FIELD_UINT32, /* whole number */
    CB_FIELD_SIGN,   /* 1 or -1 -> int8_t */
    CB_FIELD_BOOL,
    CB_FIELD_WORD,   /* one of `words` -> uint8_t */
    CB_FIELD_NAME,   /* letters, digits, _ - . -> char[CB_NAME_SIZE] */
    CB_FIELD_TEXT,   /* any text without control characters (text.h) -> char[size] */
    CB_FIELD_STRING, /* a text that the caller reads */
    CB_FIELD_OBJECT, /* the caller reads it */
    CB_FIELD_ARRAY,  /* the caller reads it */
    CB_FIELD_ANY,    /* valid JSON, ignored */
    CB_FIELD_LATER,  /* of a later version: rejected with a sentence that names it */
};

struct cb_word {
    const char *word; /* NULL ends a list */
    uint8_t value;
};

/* One key. Ranges and defaults are decimal texts, so that messages quote the compared text. */
struct cb_field {
    const char *key;
    enum cb_field_kind kind;
    bool required;
    uint16_t offset;             /* in the struct that the table fills */
    uint16_t size;               /* CB_FIELD_TEXT: bytes with the ending 0 */
    const char *least, *most;    /* numbers: inclusive range */
    const char *otherwise;       /* number or word of an absent key; NULL: the caller handles it */
    const struct cb_word *words; /* CB_FIELD_WORD */
};

/* In a table, for a key whose value the caller reads itself. */
#define CB_NOT_STORED .offset = 0

struct cb_object {
    const struct cb_field *fields;
    uint8_t count;
};

/* in : at: any value; into: the struct of the table's offsets, NULL if nothing is stored
 * out: true: it is an object with all required keys and no unknown or double ones, every simple
 *      field is stored, and slots[count] hold the offsets of the values, CB_ABSENT where absent */
bool cb_read_object(struct cb_loader *loader, uint32_t at, const struct cb_object *object,
                    void *into, uint32_t *slots);

/* out: offset of the value of `key` in the object at `at`; CB_ABSENT if there is none. */
uint32_t cb_find_key(const struct cb_loader *loader, uint32_t at, const char *key);

/* in : a valid CB_JSON_KEY or CB_JSON_STRING token
 * out: its text with escapes resolved; empty if it is longer than any known key or word, or if a
 *      \u0000 would end it early */
void cb_short_text(const char *text, struct cb_json_token token, char buffer[CB_KEY_SIZE]);

/* Looks a text up in a list of words; the message lists the known words. */
bool cb_read_word(struct cb_loader *loader, uint32_t at, const struct cb_word *words,
                  uint8_t *value);

/* Reads a number within [least, most]. */
bool cb_read_float(struct cb_loader *loader, uint32_t at, const char *least, const char *most,
                   float *value);
bool cb_read_whole(struct cb_loader *loader, uint32_t at, const char *least, const char *most,
                   uint32_t *value);

/* Reads a text into buffer[size], ended by 0; at most size - 1 bytes, no control characters
 * (text.h). */
bool cb_read_text(struct cb_loader *loader, uint32_t at, char *buffer, uint32_t size);

/* Reads a name: as a text, of letters, digits and _ - . only, not empty. */
bool cb_read_name(struct cb_loader *loader, uint32_t at, char name[CB_NAME_SIZE]);

/* ---- members of any name ---- */

/* Walks an object: for (each = cb_members(l, at); cb_members_next(&each);) … each.key, each.at. */
struct cb_members {
    struct cb_json json;
    struct cb_json_token key;
    uint32_t at; /* of the value */
};
struct cb_members cb_members(const struct cb_loader *loader, uint32_t at);
bool cb_members_next(struct cb_members *members);

/* ---- lists ---- */

/* Walks an array: for (each = cb_list(l, at); cb_list_next(&each);) … each.at, each.index. */
struct cb_list {
    struct cb_json json;
    uint32_t at, index; /* of the element */
    bool started;
};
struct cb_list cb_list(const struct cb_loader *loader, uint32_t at);
bool cb_list_next(struct cb_list *list);

/* out: offset of element `index`, which must exist */
uint32_t cb_list_at(const struct cb_loader *loader, uint32_t at, uint32_t index);

/* Reads an array of numbers within ±1e9 into numbers[max]. */
bool cb_read_numbers(struct cb_loader *loader, uint32_t at, float *numbers, uint32_t max,
                     uint32_t *count);

/* ---- helpers on values ---- */

struct cb_json_token cb_token_at(const struct cb_loader *loader, uint32_t at);
bool cb_same_text(const char *a, const char *b);

/* out: value of a number text of the tables, which is valid by construction */
float cb_number_of(const char *text);

bool cb_find_word(const struct cb_word *words, const char *word, uint8_t *value);

/* out: the known key that begins with `key`_, or the nearest one within two edits; NULL: none */
const char *cb_likely_key(const struct cb_object *object, const char *key);

/* in : an array of structs that begin with their name, `stride` bytes each
 * out: index in [0, count) of the element with this name; CB_NONE if there is none */
uint8_t cb_find_name(const void *array, size_t stride, uint32_t count, const char *name);

/* Fails if a list has more elements than the box has room for. */
bool cb_list_has_room(struct cb_loader *loader, const struct cb_list *list, uint32_t max,
                      const char *what);

#endif
