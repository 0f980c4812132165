/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/record.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/linux/files/output_file.h"
#include "hal/linux/whole_file.h"

static void note_failure(struct cb_record *record, int error) {
    if (record->error == 0) record->error = error;
    record->last_error = error;
    record->failures++;
}

/* Removes the part of a line that was written before an error; in a stream it becomes a line of its
 * own. out: false: it is still there */
static bool cut_torn(struct cb_record *record) {
    if (record->is_torn && record->is_stream)
        record->is_torn = cb_output_write(record->fd, "\n", 1) != 1;
    else if (record->is_torn)
        record->is_torn = !cb_output_cut(record->fd, record->whole_size) ||
                          lseek(record->fd, record->whole_size, SEEK_SET) < 0;
    return !record->is_torn;
}

/* out: whether all is in the file; else nothing of it, but for what cut_torn() has yet to remove */
static bool append(struct cb_record *record, const char *text, size_t bytes) {
    const size_t done = cut_torn(record) ? cb_output_write(record->fd, text, bytes) : 0;
    if (done == bytes) {
        record->whole_size += (int64_t)bytes;
        return true;
    }
    note_failure(record, errno);
    record->is_torn |= done > 0;
    cut_torn(record);
    return false;
}

static unsigned commas_of(const char *text, size_t bytes) {
    unsigned count = 0;
    for (size_t i = 0; i < bytes; i++) count += text[i] == ',';
    return count;
}

/* in : row, a whole line with its end at row[bytes - 1]. out: false: it is no row */
static bool take_last_row(struct cb_record *record, const char *row, size_t bytes) {
    double time_s, unix_s;
    size_t comma = bytes - 1;
    if (commas_of(row, bytes) != commas_of(record->header, record->header_used)) return false;
    while (row[comma] != ',') comma--; /* each header has some */
    if (sscanf(row, "%lf,", &time_s) != 1 || sscanf(row + comma, ",%lf\n", &unix_s) != 1 ||
        !(time_s >= 0 && time_s < 1e12) || !(unix_s >= 0 && unix_s < 1e12))
        return false;
    record->before_us = (int64_t)(time_s * 1e6 + 0.5);
    record->before_unix_us = (int64_t)(unix_s * 1e6 + 0.5);
    return record->before_unix_us < cb_unix_us();
}

/* in : text[bytes]: the end of a file of whole_size + bytes, without the header
 * out: the file may go on; whole_size is that of its whole lines, before_us that of the last one */
static bool take_end(struct cb_record *record, const char *text, size_t bytes) {
    size_t end = bytes;
    while (end > 0 && text[end - 1] != '\n') end--;
    size_t begin = end > 0 ? end - 1 : 0;
    while (begin > 0 && text[begin - 1] != '\n') begin--;
    /* a text that begins within the file may begin within a line */
    const bool all_rows = record->whole_size == (int64_t)record->header_used;
    record->whole_size += (int64_t)end;
    if (begin == 0 && !all_rows) return false;
    if (end == 0) return true;
    return take_last_row(record, text + begin, end - begin);
}

/* in : bytes: size of the file; the buffer has no rows, because the file is read into it
 * out: rows may be appended behind whole_size */
static bool goes_on(struct cb_record *record, int64_t bytes) {
    const int64_t header = (int64_t)record->header_used;
    const int64_t most = sizeof record->buffer;
    const int64_t tail = bytes - header < most ? bytes - header : most;
    const int fd = tail < 0 ? -1 : open(record->path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return false;
    bool good = cb_read_at(fd, 0, record->buffer, record->header_used) &&
                memcmp(record->buffer, record->header, record->header_used) == 0 &&
                cb_read_at(fd, bytes - tail, record->buffer, (size_t)tail);
    record->whole_size = bytes - tail;
    good = good && take_end(record, record->buffer, (size_t)tail);
    close(fd);
    return good;
}

/* Closes the file, on the disk, and renames it to PATH.1. out: 0, or errno */
static int put_aside(struct cb_record *record) {
    cut_torn(record);
    const int error = cb_output_close(record->fd, 0, true);
    if (error != 0) note_failure(record, error);
    record->fd = -1;
    return cb_archive_keep(&record->archive);
}

/* Opens the file; another one takes its place if its rows cannot go on. out: 0, or errno */
static int open_file(struct cb_record *record) {
    int64_t bytes;
    record->fd = cb_output_open_kept(record->path, &bytes);
    if (record->fd < 0) return errno;
    record->is_stream = bytes < 0;
    if (bytes <= 0) return 0;
    if (goes_on(record, bytes)) {
        if (record->whole_size < bytes && !cb_output_cut(record->fd, record->whole_size))
            return errno;
        return lseek(record->fd, record->whole_size, SEEK_SET) < 0 ? errno : 0;
    }
    record->before_unix_us = record->whole_size = 0;
    const int error = put_aside(record);
    if (error != 0) return error;
    record->fd = cb_output_open(record->path);
    return record->fd < 0 ? errno : 0;
}

static int write_header(struct cb_record *record) {
    return append(record, record->header, record->header_used) ? 0 : record->last_error;
}

/* Opens the file and writes the header of a new one. out: 0, or errno */
static int begin(struct cb_record *record) {
    record->whole_size = 0;
    record->is_torn = false;
    int error = open_file(record);
    if (error == 0 && record->whole_size == 0) error = write_header(record);
    if (error == 0) return 0;
    if (record->fd >= 0) close(record->fd);
    record->fd = -1;
    return error;
}

/* Keeps the file as PATH.1 and begins another. out: 0; or errno, and there is no file */
static int another_file(struct cb_record *record) {
    int error = put_aside(record);
    if (error == 0) error = begin(record);
    if (error != 0) note_failure(record, error);
    return error;
}

/* Behind a power cut a start goes on with the time of the last row that is on the disk. */
static void sync_first_rows(struct cb_record *record) {
    if (fsync(record->fd) != 0) note_failure(record, errno);
    cb_output_sync_folder(record->path);
}

void cb_record_flush(struct cb_record *record) {
    record->wall_us = cb_unix_us() - cb_boottime_us();
    if (record->fd < 0 || record->used == 0) return;
    const int64_t bytes = record->whole_size + (int64_t)record->used;
    if (bytes > cb_archive_piece(&record->archive) && !record->is_stream) another_file(record);
    const bool first = record->whole_size == (int64_t)record->header_used;
    if (record->fd < 0 || !append(record, record->buffer, record->used)) {
        record->lost += record->waiting;
        record->rows -= record->waiting;
    } else if (first && !record->is_stream) {
        sync_first_rows(record);
    }
    record->used = 0;
    record->waiting = 0;
}

int cb_record_start(struct cb_record *record, const char *path, int64_t most_bytes,
                    const struct cb_config *config) {
    *record = (struct cb_record){.fd = -1, .path = path, .every_us = record->every_us};
    record->wall_us = cb_unix_us() - cb_boottime_us();
    if (path == NULL) return 0;
    cb_archive_start(&record->archive, path, most_bytes);
    record->header_used = cb_row_header(record->header, config);
    record->values = cb_row_count(config);
    return begin(record);
}

int cb_record_follow(struct cb_record *record, const struct cb_config *config) {
    char header[CB_ROW_TEXT];
    if (record->path == NULL) return 0;
    cb_record_flush(record);
    const size_t bytes = cb_row_header(header, config);
    if (bytes == record->header_used && memcmp(header, record->header, bytes) == 0) return 0;
    memcpy(record->header, header, bytes);
    record->header_used = bytes;
    record->values = cb_row_count(config);
    if (record->fd < 0) return 0; /* the next file begins with them */
    if (record->is_stream) return write_header(record);
    return another_file(record);
}

/* The first row of this run goes on behind the last one of the file, by the wall clock. */
static void find_zero(struct cb_record *record, const struct cb_row *row) {
    record->has_zero = true;
    record->zero_us = row->time_us;
    if (record->before_unix_us == 0) return;
    const int64_t pause_us = row->time_us + record->wall_us - record->before_unix_us;
    record->zero_us -= record->before_us + (pause_us > 1000 ? pause_us : 1000);
}

/* out: the first row of an interval, or another mode or reason */
static bool is_due(struct cb_record *record, const struct cb_row *row) {
    const uint16_t status = (uint16_t)(row->reason << 8 | row->mode);
    const int64_t interval = record->every_us > 0 ? row->time_us / record->every_us : 0;
    const bool due = record->every_us == 0 || !record->has_zero || interval != record->interval ||
                     status != record->status;
    record->interval = interval;
    record->status = status;
    return due;
}

void cb_record_add(struct cb_record *record, const struct cb_config *config,
                   const struct cb_row *row) {
    float values[CB_ROW_VALUES];
    if (!is_due(record, row)) return;
    if (sizeof record->buffer - record->used < CB_ROW_TEXT) cb_record_flush(record);
    if (record->fd < 0) { /* its next file could not be begun, perhaps just now */
        record->lost += record->error != 0;
        return;
    }
    if (!record->has_zero) find_zero(record, row);
    const struct cb_row_frame frame = {row->time_us - record->zero_us,
                                       row->time_us + record->wall_us, row->mode, row->reason};
    cb_row_values(values, config, row);
    record->used += cb_row_line(record->buffer + record->used, &frame, values, record->values);
    record->rows++;
    record->waiting++;
}

static void try_again(struct cb_record *record, int64_t now_us) {
    if (record->fd >= 0 || now_us < record->retry_us) return;
    const bool was_due = record->retry_us != 0;
    record->retry_us = now_us + CB_RECORD_RETRY_US;
    if (!was_due) return;
    const int error = begin(record);
    if (error != 0)
        note_failure(record, error);
    else
        record->retry_us = 0;
}

void cb_record_work(struct cb_record *record, int64_t now_us) {
    if (record->path == NULL) return;
    try_again(record, now_us);
    cb_archive_work(&record->archive);
}

int cb_record_finish(struct cb_record *record) {
    cb_archive_finish(&record->archive);
    if (record->fd < 0) return record->error;
    cb_record_flush(record);
    cut_torn(record);
    record->error = cb_output_close(record->fd, record->error, false);
    record->fd = -1;
    return record->error;
}
