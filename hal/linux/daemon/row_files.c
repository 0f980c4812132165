/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/row_files.h"

#include <stdio.h>
#include <string.h>

#include "hal/linux/clock.h"
#include "hal/linux/files/output_file.h"

bool cb_row_files_is_open(const char *path, int error) {
    if (error != 0)
        fprintf(stderr, "compboxd: %s: cannot be written: %s\n", path, cb_output_error(error));
    return error == 0;
}

bool cb_row_files_start(struct cb_row_files *files, const struct cb_options *options,
                        struct cb_log *log, const struct cb_config *config) {
    const int64_t record_most = options->record_most_mb * 1000000LL;
    const int64_t blackbox_most = options->blackbox_most_mb * 1000000LL;
    files->options = options;
    files->log = log;
    files->record.every_us = options->record_every_ms * 1000LL;
    return cb_row_files_is_open(options->events,
                                cb_events_start(&files->events, options->events)) &&
           cb_row_files_is_open(options->record, cb_record_start(&files->record, options->record,
                                                                 record_most, config)) &&
           cb_row_files_is_open(
               options->blackbox,
               cb_blackbox_start(&files->blackbox, options->blackbox, blackbox_most, config)) &&
           cb_row_files_is_open(options->inputs,
                                cb_input_record_start(&files->inputs, options->inputs));
}

/* Logs the file of the black box that became whole, if one did. */
static void log_blackbox(struct cb_row_files *files, int64_t now_us) {
    const struct cb_blackbox *box = &files->blackbox;
    if (box->files == files->blackbox_files) return;
    files->blackbox_files = box->files;
    cb_log_limited(files->log, CB_LOG_FILES, now_us, "black box: %s/%s", box->folder, box->name);
}

void cb_row_files_follow(struct cb_row_files *files, const struct cb_config *config) {
    int error = cb_record_follow(&files->record, config);
    if (error != 0)
        cb_log_limited(files->log, CB_LOG_FILES, cb_boottime_us(), "%s: cannot be written: %s",
                       files->options->record, cb_output_error(error));
    error = cb_blackbox_follow(&files->blackbox, config);
    log_blackbox(files, cb_boottime_us());
    if (error != 0)
        cb_log_limited(files->log, CB_LOG_FILES, cb_boottime_us(), "no black box from now on: %s",
                       strerror(error));
}

void cb_row_files_add(struct cb_row_files *files, const struct cb_config *config,
                      const struct cb_row *row) {
    cb_record_add(&files->record, config, row);
    cb_blackbox_add(&files->blackbox, config, row);
    cb_input_record_add(&files->inputs, config, row);
}

/* Logs when the record begins to fail, and when it was written for a while again. The final line
 * has the number of lost rows. */
static void log_record(struct cb_row_files *files, int64_t now_us) {
    const struct cb_record *record = &files->record;
    const char *path = files->options->record;
    if (record->failures != files->failures) {
        if (!files->is_failing)
            cb_log_limited(files->log, CB_LOG_FILES, now_us, "%s: rows are lost: %s", path,
                           strerror(record->last_error));
        files->is_failing = true;
        files->failures = record->failures;
        files->failed_us = now_us;
        files->rows_written = record->rows;
    } else if (files->is_failing && record->rows > files->rows_written &&
               now_us - files->failed_us > CB_RECORD_RETRY_US) {
        files->is_failing = false;
        cb_log_limited(files->log, CB_LOG_FILES, now_us, "%s: is written again", path);
    }
}

void cb_row_files_flush(struct cb_row_files *files) {
    cb_record_flush(&files->record);
    log_record(files, cb_boottime_us());
}

void cb_row_files_work(struct cb_row_files *files, int64_t now_us) {
    const struct cb_archive *archive = &files->record.archive;
    const struct cb_blackbox *box = &files->blackbox;
    cb_events_sync(&files->events, now_us);
    cb_log_file(files->log, files->options->events, files->events.error, &files->events_error,
                now_us);
    cb_record_work(&files->record, now_us);
    cb_log_file(files->log, archive->temporary, archive->error, &files->archive_error, now_us);
    cb_blackbox_work(&files->blackbox, now_us);
    log_blackbox(files, now_us);
    cb_log_file(files->log, box->folder, box->error, &files->blackbox_error, now_us);
    cb_log_file(files->log, files->options->inputs, files->inputs.error, &files->inputs_error,
                now_us);
}

bool cb_row_files_finish(struct cb_row_files *files, int64_t now_us) {
    const struct cb_options *options = files->options;
    const int record_error = cb_record_finish(&files->record);
    const int inputs_error = cb_input_record_finish(&files->inputs);
    const int blackbox_error = cb_blackbox_finish(&files->blackbox, now_us);
    const unsigned long long lost = files->record.lost;
    log_blackbox(files, now_us);
    cb_log_file(files->log, options->blackbox, blackbox_error, &files->blackbox_error, now_us);
    if (record_error != 0)
        cb_log_line(files->log, now_us, "%s: %llu row%s could not be written: %s", options->record,
                    lost, lost == 1 ? "" : "s", strerror(record_error));
    if (inputs_error != 0)
        cb_log_line(files->log, now_us, "%s: cannot be written: %s", options->inputs,
                    strerror(inputs_error));
    return record_error == 0 && inputs_error == 0;
}
