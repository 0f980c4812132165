/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/record.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/base/assert.h"
#include "hal/linux/files/output_file.h"

/* Appends to the buffer. A line has at most 64 + 128 + 16 values of 16 characters, so
 * CB_RECORD_LINE holds it; the callers keep that much free. */
static __attribute__((format(printf, 2, 3))) void put(struct cb_record *record, const char *format,
                                                      ...) {
    va_list arguments;
    va_start(arguments, format);
    size_t room = sizeof record->buffer - record->used;
    const size_t length = (size_t)vsnprintf(record->buffer + record->used, room, format, arguments);
    va_end(arguments);
    CB_ASSERT(length < room);
    record->used += length;
}

static void put_header(struct cb_record *record, const struct cb_config *config) {
    put(record, "time_s");
    for (unsigned i = 0; i < config->signals_count; i++)
        put(record, ",%s", config->signals[i].name);
    for (unsigned i = 0; i < config->outputs_count; i++)
        put(record, ",%s", config->outputs[i].name);
    for (unsigned i = 0; i < config->channels_count; i++)
        put(record, ",comp_%s_um", config->channels[i].name);
    put(record, ",mode,reason\n");
}

/* Nine digits, so that a float32 reads back with the same bits. */
static void put_value(struct cb_record *record, float value) {
    put(record, ",%.9g", (double)value);
}

static void put_row(struct cb_record *record, const struct cb_config *config,
                    const struct cb_row *row) {
    put(record, "%.6f", (double)(row->time_us - record->first_us) * 1e-6);
    for (unsigned i = 0; i < config->signals_count; i++) {
        if (row->signals[i].state != CB_ROW_SIGNAL_NEVER)
            put_value(record, row->signals[i].value);
        else
            put(record, ",");
    }
    for (unsigned i = 0; i < config->outputs_count; i++) put_value(record, row->outputs[i]);
    for (unsigned i = 0; i < config->channels_count; i++)
        put_value(record, row->channels[i].output_um);
    put(record, ",%u,%u\n", row->mode, row->reason);
}

/* Removes the part of a line that was written before an error. */
static void cut_to_whole_lines(struct cb_record *record) {
    if (ftruncate(record->fd, record->whole_size) == 0)
        lseek(record->fd, record->whole_size, SEEK_SET);
}

void cb_record_flush(struct cb_record *record) {
    if (record->fd < 0 || record->used == 0) return;
    if (cb_output_write(record->fd, record->buffer, record->used) == record->used) {
        record->whole_size += (int64_t)record->used;
    } else {
        if (record->error == 0) record->error = errno;
        cut_to_whole_lines(record);
        record->lost += record->waiting;
        record->rows -= record->waiting;
    }
    record->used = 0;
    record->waiting = 0;
}

int cb_record_start(struct cb_record *record, const char *path, const struct cb_config *config) {
    *record = (struct cb_record){.fd = -1};
    if (path == NULL) return 0;
    record->fd = cb_output_open(path);
    if (record->fd < 0) return errno;
    put_header(record, config);
    cb_record_flush(record);
    return record->error;
}

static bool same_columns(const struct cb_config *a, const struct cb_config *b) {
    if (a->signals_count != b->signals_count || a->outputs_count != b->outputs_count ||
        a->channels_count != b->channels_count)
        return false;
    for (unsigned i = 0; i < a->signals_count; i++)
        if (strcmp(a->signals[i].name, b->signals[i].name) != 0) return false;
    for (unsigned i = 0; i < a->outputs_count; i++)
        if (strcmp(a->outputs[i].name, b->outputs[i].name) != 0) return false;
    for (unsigned i = 0; i < a->channels_count; i++)
        if (strcmp(a->channels[i].name, b->channels[i].name) != 0) return false;
    return true;
}

/* out: 0: renamed to PATH.N; or errno */
static int move_away(const char *path) {
    char other[4096];
    for (unsigned n = 1; n < 100000; n++) {
        const size_t length = (size_t)snprintf(other, sizeof other, "%s.%u", path, n);
        if (length >= sizeof other) return ENAMETOOLONG;
        if (access(other, F_OK) != 0) return rename(path, other) == 0 ? 0 : errno;
    }
    return EEXIST;
}

int cb_record_follow(struct cb_record *record, const char *path, const struct cb_config *before,
                     const struct cb_config *now) {
    if (record->fd < 0 || same_columns(before, now)) return 0;
    cb_record_flush(record);
    int error = move_away(path);
    close(record->fd);
    record->fd = error == 0 ? cb_output_open(path) : -1;
    if (record->fd < 0 && error == 0) error = errno;
    if (error != 0) return record->error = error;
    record->whole_size = 0;
    put_header(record, now);
    cb_record_flush(record);
    return record->error;
}

void cb_record_add(struct cb_record *record, const struct cb_config *config,
                   const struct cb_row *row) {
    if (record->fd < 0) {
        record->lost += record->error != 0;
        return;
    }
    if (sizeof record->buffer - record->used < CB_RECORD_LINE) cb_record_flush(record);
    if (record->rows == 0 && record->lost == 0) record->first_us = row->time_us;
    put_row(record, config, row);
    record->rows++;
    record->waiting++;
}

int cb_record_finish(struct cb_record *record) {
    if (record->fd < 0) return record->error;
    cb_record_flush(record);
    if (close(record->fd) != 0 && record->error == 0) record->error = errno;
    record->fd = -1;
    return record->error;
}
