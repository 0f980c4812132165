/* SPDX-License-Identifier: MIT
 * One CSV row per cycle: time_s (since the first), every signal by its name (empty until it is
 * first received), every term output by its name, comp_NAME_um of every channel, mode and reason
 * (numbers of the status register). The file holds only whole lines at any time. */
#ifndef COMPBOX_HAL_LINUX_FILES_RECORD_H
#define COMPBOX_HAL_LINUX_FILES_RECORD_H

#include <stddef.h>
#include <stdint.h>

#include "hal/linux/files/row.h"

struct cb_config;

enum { CB_RECORD_BUFFER = 65536, CB_RECORD_LINE = 8192 };

struct cb_record {
    int fd; /* -1: no record */
    int64_t first_us;
    uint64_t rows;      /* in the file or in the buffer */
    uint64_t lost;      /* rows that could not be written */
    int error;          /* errno of the first failure, 0: none */
    uint32_t waiting;   /* rows in the buffer */
    size_t used;        /* bytes in the buffer */
    int64_t whole_size; /* bytes of whole lines in the file */
    char buffer[CB_RECORD_BUFFER];
};

/* Creates the file and writes its header. path NULL: no record. out: 0, or errno. */
int cb_record_start(struct cb_record *record, const char *path, const struct cb_config *config);

/* Another coefficient file begins with the next row. If its columns differ, the file is closed and
 * renamed to the first free PATH.1, PATH.2 …, and a new one begins. out: 0, or errno. */
int cb_record_follow(struct cb_record *record, const char *path, const struct cb_config *before,
                     const struct cb_config *now);

/* Adds a row; writes when the buffer is full. Behind a failed follow it is counted as lost. */
void cb_record_add(struct cb_record *record, const struct cb_config *config,
                   const struct cb_row *row);

/* Writes the buffer. Rows that do not fit on the disk are counted in `lost`. */
void cb_record_flush(struct cb_record *record);

/* Flushes and closes. out: 0, or errno of the first failure. */
int cb_record_finish(struct cb_record *record);

#endif
