/* SPDX-License-Identifier: MIT
 * The events of the box: each line of the log (log.h) as one line of JSON with the wall clock, kept
 * across restarts (docs/events.md). The file is appended to. At CB_EVENTS_BYTES it is renamed to
 * PATH.1, and PATH.1 to PATH.2 …, so that all of them together have a limit. */
#ifndef COMPBOX_HAL_LINUX_FILES_EVENTS_H
#define COMPBOX_HAL_LINUX_FILES_EVENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/sha256.h"
#include "hal/linux/files/row.h"
#include "hal/linux/files/state.h"

enum {
    CB_EVENTS_BYTES = 1000000, /* of one file */
    CB_EVENTS_FILES = 5,       /* PATH, PATH.1 … PATH.4 */
    CB_EVENTS_LINE = 2048,
    CB_EVENTS_SYNC_US = 1000000, /* longest time for which the disk lacks a line */
};

/* A coefficient file, and who brought it. */
struct cb_file_facts {
    bool was_read; /* the members below are valid */
    uint32_t revision, crc32;
    uint8_t sha256[CB_SHA256_BYTES];
    uint32_t owner; /* user who owns the file */
    int64_t modified_unix_us;
    bool on_signal; /* SIGHUP requested its loading, sent by: */
    uint32_t sender_user;
    int32_t sender_pid;
};

struct cb_events {
    const char *path;                 /* NULL: none */
    const struct cb_file_facts *file; /* while it is set, each event has them; NULL: none */
    int fd;
    bool is_new;              /* the folder on the disk may lack the name */
    int64_t bytes;            /* of whole lines in the file */
    int64_t sync_us;          /* time of the first line since the last sync; 0: there is none */
    uint32_t revision, crc32; /* of the running coefficient file; the caller sets them */
    uint32_t lost;            /* lines since the last one that was written */
    int error;                /* errno of the last write; 0: it succeeded */
};

/* Opens the file, and ends a last line that a power cut has torn. path NULL: no events.
 * out: 0, or errno (cb_output_error()) */
int cb_events_start(struct cb_events *events, const char *path);

/* Appends an event.
 * in : kind: one word, as "mode"; text: a sentence; row: adds its mode, reason and cause, or NULL
 */
void cb_events_add(struct cb_events *events, const char *kind, const char *text,
                   const struct cb_row *row);

/* Call it regularly: syncs the file where that is due. */
void cb_events_sync(struct cb_events *events, int64_t now_us);

/* out: 0, or errno of the last write */
int cb_events_finish(struct cb_events *events);

#endif
