/* SPDX-License-Identifier: MIT
 * Strict JSON (RFC 8259), one token at a time from text in memory: no recursion, no copy, no heap.
 *
 * Rejected: trailing text, trailing commas, comments, NaN, leading zeros, control characters in
 * texts, bytes that are not UTF-8, half surrogates, a byte order mark, nesting beyond
 * CB_JSON_MAX_DEPTH. Duplicate keys are valid JSON; the reader of an object rejects them. */
#ifndef COMPBOX_FIRMWARE_JSON_JSON_H
#define COMPBOX_FIRMWARE_JSON_JSON_H

#include <stdbool.h>
#include <stdint.h>

enum { CB_JSON_MAX_DEPTH = 32 }; /* a coefficient file needs 4, its provenance perhaps 10 */

enum cb_json_kind {
    CB_JSON_OBJECT, /* { */
    CB_JSON_OBJECT_END,
    CB_JSON_ARRAY, /* [ */
    CB_JSON_ARRAY_END,
    CB_JSON_KEY, /* a text and its colon */
    CB_JSON_STRING,
    CB_JSON_NUMBER,
    CB_JSON_TRUE,
    CB_JSON_FALSE,
    CB_JSON_NULL,
    CB_JSON_END, /* the text is complete */
    CB_JSON_BAD, /* not JSON; every later token is BAD too */
};

struct cb_json_token {
    enum cb_json_kind kind;
    uint32_t at;     /* offset of its first byte: of a text the opening quote */
    uint32_t length; /* in bytes, as written; 1 for brackets, 0 for END and BAD */
};

/* Position of the reader in a text that the caller owns. */
struct cb_json {
    const char *text;
    uint32_t length;
    uint32_t at;         /* next byte to read */
    uint32_t objects;    /* bit d: the container at depth d + 1 is an object */
    uint8_t depth;       /* open containers */
    uint8_t expect;      /* set of permitted next tokens; internal */
    const char *mistake; /* after CB_JSON_BAD: a sentence about the byte at the token's place */
};

/* in : at <= length: 0 for a whole text, or the offset of a value inside a text known to be valid
 * out: a reader before that value */
void cb_json_start(struct cb_json *json, const char *text, uint32_t length, uint32_t at);

/* The next token; after the last one CB_JSON_END. Linear in the bytes it passes. */
struct cb_json_token cb_json_next(struct cb_json *json);

/* Skips tokens until only `depth` containers are open: past the end of the current one. */
void cb_json_skip(struct cb_json *json, uint8_t depth);

/* in : a valid CB_JSON_KEY or CB_JSON_STRING token; buffer[size]
 * out: its UTF-8 text with escapes resolved, without an ending 0, and its length; size + 1 when it
 *      is longer than size (buffer then holds only its beginning) */
uint32_t cb_json_text(const char *text, struct cb_json_token token, char *buffer, uint32_t size);

/* Line and column, both from 1, of an offset: columns count bytes. */
struct cb_json_place {
    uint32_t line, column;
};
struct cb_json_place cb_json_locate(const char *text, uint32_t offset);

#endif
