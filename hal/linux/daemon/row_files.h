/* SPDX-License-Identifier: MIT
 * The files that get the loop's rows: events, record, black box and inputs. What fails is logged;
 * the box runs on. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_ROW_FILES_H
#define COMPBOX_HAL_LINUX_DAEMON_ROW_FILES_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/linux/daemon/log.h"
#include "hal/linux/daemon/options.h"
#include "hal/linux/files/blackbox.h"
#include "hal/linux/files/events.h"
#include "hal/linux/files/input_record.h"
#include "hal/linux/files/record.h"

struct cb_row_files {
    const struct cb_options *options;
    struct cb_log *log;
    struct cb_events events;
    struct cb_record record;
    struct cb_blackbox blackbox;
    struct cb_input_record inputs;
    int events_error;        /* errno last logged of the events … */
    int archive_error;       /* … of the compression of old records … */
    int inputs_error;        /* … of the inputs … */
    int blackbox_error;      /* … and of the black box … */
    uint32_t blackbox_files; /* … of which so many files were logged */
    /* of the record: */
    bool is_failing;       /* that is the last line about it */
    uint32_t failures;     /* that were noticed … */
    int64_t failed_us;     /* … the last one at this time … */
    uint64_t rows_written; /* … behind so many rows */
};

/* out: true; or false, and a sentence is printed: the file cannot be written */
bool cb_row_files_is_open(const char *path, int error);

/* Opens the files, so that a wrong path is reported before the machine moves. The log is started
 * later. out: false: one of them failed, and a sentence about it is printed */
bool cb_row_files_start(struct cb_row_files *files, const struct cb_options *options,
                        struct cb_log *log, const struct cb_config *config);

/* Rows of another coefficient file follow. */
void cb_row_files_follow(struct cb_row_files *files, const struct cb_config *config);

void cb_row_files_add(struct cb_row_files *files, const struct cb_config *config,
                      const struct cb_row *row);

/* Writes the rows that were added; call it behind the last one of a number of rows. */
void cb_row_files_flush(struct cb_row_files *files);

/* Call it regularly: syncs, compresses and writes files in slices. */
void cb_row_files_work(struct cb_row_files *files, int64_t now_us);

/* Completes the files, but for the events, which have the log's last lines.
 * out: all rows of record and inputs are written */
bool cb_row_files_finish(struct cb_row_files *files, int64_t now_us);

#endif
