/* SPDX-License-Identifier: MIT
 * A JSON object, written member by member: quotes, commas and lines are the writer's. Members of
 * the object have lines of their own, and so have objects of an array. */
#ifndef COMPBOX_HAL_LINUX_FILES_WRITER_H
#define COMPBOX_HAL_LINUX_FILES_WRITER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CB_WRITER_BYTES = 131072 }; /* the longest file */

struct cb_writer {
    char *text; /* [size] */
    size_t size, used;
    uint32_t arrays; /* bit d: what is open at depth d is an array */
    uint8_t depth;   /* of open objects and arrays, 0 … 31 */
    bool one_line;   /* the whole object: a line of a log */
    bool begun;      /* the innermost open one has an entry */
};

/* Begins the object. in: text[size] is for it; the object is to fit. */
struct cb_writer cb_writer_begin(char *text, size_t size, bool one_line);
/* Closes it, with a newline. out: its bytes in text, without a 0; 0: it did not fit */
size_t cb_writer_end(struct cb_writer *json);

/* A member of an object, or an entry of an array, where key is NULL. */
void cb_writer_object(struct cb_writer *json, const char *key);
void cb_writer_array(struct cb_writer *json, const char *key);
void cb_writer_close(struct cb_writer *json); /* the innermost object or array */
void cb_writer_text(struct cb_writer *json, const char *key, const char *text);
void cb_writer_whole(struct cb_writer *json, const char *key, int64_t number);
void cb_writer_null(struct cb_writer *json, const char *key);
void cb_writer_truth(struct cb_writer *json, const char *key, bool value);
/* With nine digits, as many as tell float32 values apart; null if it is not finite. */
void cb_writer_number(struct cb_writer *json, const char *key, double number);
/* With three decimals: times, which are finite. */
void cb_writer_thousandths(struct cb_writer *json, const char *key, double number);

/* Replaces a file by the object that put(json, from) fills. Uses static memory: for one thread.
 * in : durable: as in cb_output_whole()
 * out: 0, or errno (EFBIG: longer than CB_WRITER_BYTES) */
int cb_writer_replace(const char *path, bool durable, void (*put)(struct cb_writer *, const void *),
                      const void *from);

#endif
