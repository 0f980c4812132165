/* SPDX-License-Identifier: MIT
 * The rows as CSV (row_text.h), kept across restarts. A start goes on behind the last row of the
 * file. A file with other columns, or one whose last row is later than the wall clock is now, is
 * kept as PATH.1 (archive.h), and another one begins. The file holds only whole lines at any time;
 * a start cuts what a power cut has torn. A stream keeps a torn line, as a line of its own. */
#ifndef COMPBOX_HAL_LINUX_FILES_RECORD_H
#define COMPBOX_HAL_LINUX_FILES_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/linux/files/archive.h"
#include "hal/linux/files/row_text.h"

enum {
    CB_RECORD_BUFFER = 65536,
    CB_RECORD_RETRY_US = 10000000, /* until a file that could not be begun is tried again */
};

struct cb_record {
    int64_t every_us; /* interval of rows, 0: each one; set it before the start */
    int64_t interval; /* the number of the interval of the last row … */
    uint16_t status;  /* … with its mode and reason: a changed one is a row too */
    struct cb_archive archive;
    const char *path;
    int fd;                 /* -1: no record */
    bool is_stream;         /* a device or a pipe: nothing is kept beside it */
    bool has_zero;          /* zero_us is set … */
    int64_t zero_us;        /* … the time of time_s = 0, on the clock of the rows */
    int64_t before_us;      /* time_s of the last row of an earlier run … */
    int64_t before_unix_us; /* … and its wall clock; 0: there is none */
    int64_t wall_us;        /* the wall clock minus the clock of the rows */
    uint64_t rows;          /* in the file or in the buffer */
    uint64_t lost;          /* rows that could not be written */
    int error;              /* errno of the first failure, 0: none … */
    int last_error;         /* … and of the last one */
    uint32_t failures;      /* number of failures */
    int64_t retry_us;       /* without a file: when it is tried again */
    uint32_t waiting;       /* rows in the buffer */
    size_t used;            /* bytes in the buffer */
    int64_t whole_size;     /* bytes of whole lines in the file … */
    bool is_torn;           /* … behind which a part of one is yet to be cut off, or ended */
    size_t header_used;     /* bytes in … */
    unsigned values;        /* of a row */
    char header[CB_ROW_TEXT];
    char buffer[CB_RECORD_BUFFER];
};

/* Opens the file; writes the header of a new one.
 * in : path NULL: no record; most_bytes: of all files together, 0: no limit
 * out: 0, or errno */
int cb_record_start(struct cb_record *record, const char *path, int64_t most_bytes,
                    const struct cb_config *config);

/* Another coefficient file begins with the next row. If its columns differ, the file is closed and
 * kept as PATH.1, and a new one begins with the same zero of time. out: 0, or errno. */
int cb_record_follow(struct cb_record *record, const struct cb_config *config);

/* Adds a row that is due; writes when the buffer is full. Behind a failed follow it is counted as
 * lost. */
void cb_record_add(struct cb_record *record, const struct cb_config *config,
                   const struct cb_row *row);

/* Writes the buffer, and takes the present wall clock for the next rows. A file's first rows are on
 * the disk before the call returns. Rows that do not fit on the disk are counted in `lost`. */
void cb_record_flush(struct cb_record *record);

/* Call it regularly: compresses a slice of an old file. If the file could not be begun, tries again
 * every CB_RECORD_RETRY_US; meanwhile rows are counted in `lost`. */
void cb_record_work(struct cb_record *record, int64_t now_us);

/* Flushes and closes. out: 0, or errno of the first failure. */
int cb_record_finish(struct cb_record *record);

#endif
