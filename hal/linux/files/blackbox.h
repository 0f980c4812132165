/* SPDX-License-Identifier: MIT
 * The black box: every row of the last ten minutes in memory. Around each HOLD and FAULT and on
 * request it becomes a file NUMBER-YYYYMMDDTHHMMSSZ-WORD.csv with the columns of the record
 * (row_text.h), and goes on until ten seconds after the event (docs/record.md). No row is written
 * twice, and a file of an event begins at most once a minute, so that many events write no more
 * than a record does. Numbers rise, whatever the wall clock does; the lowest are removed first. */
#ifndef COMPBOX_HAL_LINUX_FILES_BLACKBOX_H
#define COMPBOX_HAL_LINUX_FILES_BLACKBOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/linux/files/row_text.h"

enum {
    CB_BLACKBOX_US = 600000000,      /* before the event … */
    CB_BLACKBOX_AFTER_US = 10000000, /* … and behind it */
    CB_BLACKBOX_PAUSE_US = 60000000, /* from file to file */
    CB_BLACKBOX_MEMORY = 32 << 20,   /* most for the rows; then they are of fewer minutes */
    CB_BLACKBOX_FILES = 99,
    CB_BLACKBOX_SLICE = 500, /* rows written at once */
    CB_BLACKBOX_NAME = 64,
};

struct cb_blackbox {
    const char *folder; /* NULL: there is none */
    int64_t most_bytes; /* of all files */
    int error;          /* errno of the last file; 0: it is whole */
    uint32_t files;     /* written by this run; the last one is `name` */
    /* ---- the ring; rows have numbers from 0 */
    unsigned char *rows;
    uint32_t capacity;
    uint32_t longest; /* rows of a file at most: those of the ring, and new ones while it grows */
    unsigned values;  /* of a row */
    uint64_t added;
    uint8_t mode; /* of the last row */
    /* ---- the event and its file */
    const char *word; /* of an event without a file; NULL: none */
    int64_t event_us, begun_us;
    int fd;           /* of the file that is written; -1: none */
    uint64_t next;    /* row to be written … */
    uint64_t written; /* … and end of those in whole files */
    int64_t first_us, wall_us;
    char name[CB_BLACKBOX_NAME]; /* of the last file */
    size_t header_used;
    char header[CB_ROW_TEXT];
};

/* Takes memory for the rows, and removes what a crash has left of a file.
 * in : folder: it exists; NULL: no black box
 * out: 0, or errno */
int cb_blackbox_start(struct cb_blackbox *box, const char *folder, int64_t most_bytes,
                      const struct cb_config *config);

/* Another coefficient file begins with the next row. If its columns differ, what is pending
 * is written at once, and the ring is empty. out: 0, or errno: there is no black box */
int cb_blackbox_follow(struct cb_blackbox *box, const struct cb_config *config);

/* Adds a row; one that begins a HOLD or a FAULT is an event. */
void cb_blackbox_add(struct cb_blackbox *box, const struct cb_config *config,
                     const struct cb_row *row);

/* An event on request; it waits for no pause. */
void cb_blackbox_request(struct cb_blackbox *box, int64_t now_us);

/* Call it regularly: begins a file that is due, or writes a slice of it. */
void cb_blackbox_work(struct cb_blackbox *box, int64_t now_us);

/* Writes what is pending. out: 0, or errno of the last file */
int cb_blackbox_finish(struct cb_blackbox *box, int64_t now_us);

#endif
