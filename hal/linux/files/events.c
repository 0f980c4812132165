/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/events.h"

#include <errno.h>
#include <stdio.h>
#include <unistd.h>

#include "firmware/box/mode.h"
#include "hal/linux/files/cause_words.h"
#include "hal/linux/files/output_file.h"
#include "hal/linux/files/rotate.h"
#include "hal/linux/files/writer.h"

/* out: 0, or errno */
static int open_file(struct cb_events *events) {
    events->fd = cb_output_append(events->path, &events->bytes);
    events->is_new = true;
    return events->fd < 0 ? errno : 0;
}

int cb_events_start(struct cb_events *events, const char *path) {
    events->path = path;
    events->fd = -1;
    return path == NULL ? 0 : open_file(events);
}

/* Keeps the full file as PATH.1, on the disk, and begins another. */
static int rotate(struct cb_events *events) {
    int error = cb_output_close(events->fd, 0, true);
    events->fd = -1;
    if (error == 0) error = cb_rotate(events->path, CB_EVENTS_FILES - 1, true);
    return error != 0 ? error : open_file(events);
}

/* out: 0 when the line is in the file as a whole; else errno, and nothing of it is */
static int append(struct cb_events *events, const char *line, size_t bytes) {
    int error = events->fd < 0 ? open_file(events) : 0;
    if (error == 0 && events->bytes + (int64_t)bytes > CB_EVENTS_BYTES) error = rotate(events);
    if (error != 0) return error;
    if (cb_output_write(events->fd, line, bytes) == bytes) {
        events->bytes += (int64_t)bytes;
        return 0;
    }
    error = errno;
    if (!cb_output_cut(events->fd, events->bytes)) {
        close(events->fd);
        events->fd = -1; /* the next line opens it again, and ends the torn one */
    }
    return error;
}

static void put_mode(struct cb_writer *json, const struct cb_row *row) {
    char cause[CB_CAUSE_TEXT];
    cb_cause_text(&row->cause, cause);
    cb_writer_text(json, "mode", cb_mode_name(row->mode));
    cb_writer_text(json, "reason", cb_reason_text(row->reason));
    cb_writer_text(json, "cause", cause);
    cb_writer_whole(json, "cycle", (int64_t)row->number);
}

/* in : file->was_read. Adds the object "file": what the file is, and who brought it. */
static void put_file(struct cb_writer *json, const struct cb_file_facts *file) {
    char text[2 * CB_SHA256_BYTES + 1];
    cb_writer_object(json, "file");
    cb_writer_whole(json, "revision", file->revision);
    snprintf(text, sizeof text, "%08x", (unsigned)file->crc32);
    cb_writer_text(json, "crc", text);
    for (unsigned i = 0; i < CB_SHA256_BYTES; i++)
        snprintf(text + 2 * i, 3, "%02x", (unsigned)file->sha256[i]);
    cb_writer_text(json, "sha256", text);
    cb_writer_whole(json, "owner", file->owner);
    cb_writer_thousandths(json, "modified_unix_s", (double)file->modified_unix_us * 1e-6);
    if (file->on_signal) {
        cb_writer_object(json, "requested_by");
        cb_writer_whole(json, "user", file->sender_user);
        cb_writer_whole(json, "pid", file->sender_pid);
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

void cb_events_add(struct cb_events *events, const char *kind, const char *text,
                   const struct cb_row *row) {
    char line[CB_EVENTS_LINE], crc[12];
    struct cb_state_clock now;
    if (events == NULL || events->path == NULL) return;
    cb_state_clock_read(&now);
    snprintf(crc, sizeof crc, "%08x", (unsigned)events->crc32);
    struct cb_writer json = cb_writer_begin(line, sizeof line, true);
    cb_writer_thousandths(&json, "unix_s", (double)now.unix_us * 1e-6);
    cb_writer_truth(&json, "synchronised", now.synchronised);
    cb_writer_text(&json, "boot", now.boot_id);
    cb_writer_thousandths(&json, "boot_s", (double)now.boottime_us * 1e-6);
    cb_writer_whole(&json, "revision", events->revision);
    cb_writer_text(&json, "crc", crc);
    cb_writer_text(&json, "kind", kind);
    cb_writer_text(&json, "text", text);
    if (row != NULL) put_mode(&json, row);
    if (events->file != NULL && events->file->was_read) put_file(&json, events->file);
    if (events->lost > 0) cb_writer_whole(&json, "lost_before", events->lost);
    const size_t bytes = cb_writer_end(&json);
    events->error = bytes == 0 ? EFBIG : append(events, line, bytes);
    events->lost = events->error == 0 ? 0 : events->lost + 1;
    if (events->error == 0 && events->sync_us == 0) events->sync_us = now.boottime_us;
}

void cb_events_sync(struct cb_events *events, int64_t now_us) {
    if (events->sync_us == 0 || now_us - events->sync_us < CB_EVENTS_SYNC_US) return;
    if (events->fd < 0) return; /* the next line opens the file again */
    events->sync_us = 0;
    if (fsync(events->fd) != 0) events->error = errno;
    if (events->is_new) cb_output_sync_folder(events->path);
    events->is_new = false;
}

int cb_events_finish(struct cb_events *events) {
    cb_events_sync(events, INT64_MAX);
    if (events->fd >= 0) close(events->fd);
    events->fd = -1;
    return events->error;
}
