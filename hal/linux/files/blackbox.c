/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/blackbox.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "firmware/box/mode.h"
#include "hal/linux/clock.h"
#include "hal/linux/files/output_file.h"

static const char requested[] = "REQUEST";

enum { PATH_SIZE = 4096 };

/* A row in the ring; its values are behind it. */
struct head {
    int64_t time_us;
    uint8_t mode, reason;
};

static size_t row_bytes(const struct cb_blackbox *box) {
    return sizeof(struct head) + box->values * sizeof(float);
}

static unsigned char *row_at(const struct cb_blackbox *box, uint64_t number) {
    return box->rows + number % box->capacity * row_bytes(box);
}

/* ---- the folder ---- */

/* Its own files, by their names. */
struct listing {
    unsigned count, lowest, highest;
    int64_t bytes;
    char oldest[CB_BLACKBOX_NAME];
};

/* out: path[PATH_SIZE]: FOLDER/NAMEEND, which fits: cb_blackbox_start() checks the folder */
static void put_path(const struct cb_blackbox *box, char *path, const char *name, const char *end) {
    snprintf(path, PATH_SIZE, "%s/%s%s", box->folder, name, end);
}

/* out: 0, or errno */
static int list_one(const char *path, const char *name, unsigned number, struct listing *all) {
    struct stat there;
    if (lstat(path, &there) != 0) return errno == ENOENT ? 0 : errno;
    if (all->count == 0 || number < all->lowest) {
        all->lowest = number;
        snprintf(all->oldest, sizeof all->oldest, "%s", name);
    }
    if (number > all->highest) all->highest = number;
    all->bytes += there.st_size;
    all->count++;
    return 0;
}

/* Removes what a crash has left of a file; other files stay. out: 0, or errno */
static int take_name(const struct cb_blackbox *box, const char *name, struct listing *all) {
    unsigned number, date, time;
    char word[8] = "", end[8] = "", own[CB_BLACKBOX_NAME], path[PATH_SIZE];
    if (sscanf(name, "%6u-%8uT%6uZ-%7[A-Z].%7[a-z.]", &number, &date, &time, word, end) != 5)
        return 0;
    snprintf(own, sizeof own, "%06u-%08uT%06uZ-%s.%s", number, date, time, word, end);
    if (strcmp(own, name) != 0) return 0;
    put_path(box, path, own, "");
    if (strcmp(end, "csv.new") == 0) unlink(path);
    return strcmp(end, "csv") == 0 ? list_one(path, own, number, all) : 0;
}

/* All of them, or errno: after a part of them the next file would get a number that is taken, and
 * be removed as the oldest. */
static int list(const struct cb_blackbox *box, struct listing *all) {
    DIR *folder = opendir(box->folder);
    memset(all, 0, sizeof *all);
    if (folder == NULL) return errno;
    int error = 0;
    while (error == 0) {
        errno = 0;
        const struct dirent *entry = readdir(folder);
        if (entry == NULL) break;
        error = take_name(box, entry->d_name, all);
    }
    if (error == 0) error = errno;
    closedir(folder);
    return error;
}

/* Removes the oldest files beyond so many files and bytes. out: 0, or errno. *highest: number of
 * the newest */
static int make_room(const struct cb_blackbox *box, unsigned files, int64_t bytes,
                     unsigned *highest) {
    char path[PATH_SIZE];
    struct listing all;
    for (;;) {
        const int error = list(box, &all);
        *highest = all.highest;
        if (error != 0 || all.count == 0 || (all.count <= files && all.bytes <= bytes))
            return error;
        put_path(box, path, all.oldest, "");
        if (unlink(path) != 0 && errno != ENOENT) return errno;
    }
}

/* ---- the ring ---- */

/* in : no file is being written. out: 0, or errno */
static int make_ring(struct cb_blackbox *box, const struct cb_config *config) {
    const int64_t span_us = CB_BLACKBOX_US + CB_BLACKBOX_AFTER_US + CB_BLACKBOX_PAUSE_US;
    const int64_t rows = span_us / config->period_us;
    free(box->rows);
    box->header_used = cb_row_header(box->header, config);
    box->values = cb_row_count(config);
    const int64_t most = CB_BLACKBOX_MEMORY / (int64_t)row_bytes(box);
    box->capacity = (uint32_t)(rows < most ? rows : most);
    box->longest = box->capacity + (uint32_t)(CB_BLACKBOX_PAUSE_US / config->period_us);
    box->added = box->written = 0;
    box->rows = calloc(box->capacity, row_bytes(box));
    return box->rows != NULL ? 0 : ENOMEM;
}

int cb_blackbox_start(struct cb_blackbox *box, const char *folder, int64_t most_bytes,
                      const struct cb_config *config) {
    unsigned highest;
    *box = (struct cb_blackbox){.folder = folder, .most_bytes = most_bytes, .fd = -1};
    if (folder == NULL) return 0;
    if (strlen(folder) + sizeof "/.new" + CB_BLACKBOX_NAME > PATH_SIZE) return ENAMETOOLONG;
    int error = make_room(box, CB_BLACKBOX_FILES, most_bytes, &highest);
    if (error == 0 && access(folder, W_OK) != 0) error = errno;
    return error != 0 ? error : make_ring(box, config);
}

static void note_event(struct cb_blackbox *box, const char *word, int64_t now_us) {
    if (box->word == NULL || word == requested) box->word = word;
    box->event_us = now_us;
}

void cb_blackbox_add(struct cb_blackbox *box, const struct cb_config *config,
                     const struct cb_row *row) {
    float values[CB_ROW_VALUES];
    const struct head head = {row->time_us, row->mode, row->reason};
    const bool begins = row->mode != box->mode;
    if (box->rows == NULL) return;
    unsigned char *at = row_at(box, box->added++);
    cb_row_values(values, config, row);
    memcpy(at, &head, sizeof head);
    memcpy(at + sizeof head, values, box->values * sizeof(float));
    box->mode = row->mode;
    if (begins && (row->mode == CB_MODE_HOLD || row->mode == CB_MODE_FAULT))
        note_event(box, cb_mode_name(row->mode), row->time_us);
}

void cb_blackbox_request(struct cb_blackbox *box, int64_t now_us) {
    if (box->rows != NULL) note_event(box, requested, now_us);
}

/* ---- a file ---- */

/* out: name: of a file that begins now */
static void make_name(struct cb_blackbox *box, unsigned number) {
    const time_t now = (time_t)(cb_unix_us() / 1000000);
    struct tm utc;
    gmtime_r(&now, &utc);
    snprintf(box->name, sizeof box->name, "%06u-%04u%02u%02uT%02u%02u%02uZ-%.7s.csv",
             number % 1000000u, (unsigned)(utc.tm_year + 1900) % 10000u,
             (unsigned)(utc.tm_mon + 1) % 100u, (unsigned)utc.tm_mday % 100u,
             (unsigned)utc.tm_hour % 100u, (unsigned)utc.tm_min % 100u, (unsigned)utc.tm_sec % 100u,
             box->word);
}

/* out: a file of this number of rows has at most so many bytes */
static int64_t bytes_of(const struct cb_blackbox *box, uint64_t rows) {
    return (int64_t)box->header_used + (int64_t)rows * (64 + 17 * (int64_t)box->values);
}

/* Begins the file of the pending event, with the rows that are in no other. out: 0, or errno */
static int begin(struct cb_blackbox *box, int64_t now_us) {
    char path[PATH_SIZE];
    unsigned highest;
    const uint64_t oldest = box->added > box->capacity ? box->added - box->capacity : 0;
    box->next = box->written > oldest ? box->written : oldest;
    const int64_t room = box->most_bytes - bytes_of(box, box->longest);
    const int error = make_room(box, CB_BLACKBOX_FILES - 1, room > 0 ? room : 0, &highest);
    if (error != 0) return error;
    make_name(box, highest + 1);
    box->begun_us = now_us;
    box->wall_us = cb_unix_us() - cb_boottime_us();
    box->first_us = -1;
    put_path(box, path, box->name, ".new");
    box->fd = cb_output_open(path);
    if (box->fd < 0) return errno;
    return cb_output_write(box->fd, box->header, box->header_used) == box->header_used ? 0 : errno;
}

/* out: time of the file's last row: some seconds behind the event, within its longest time */
static int64_t last_time(const struct cb_blackbox *box) {
    const int64_t after_us = box->event_us + CB_BLACKBOX_AFTER_US;
    const int64_t longest_us = box->begun_us + CB_BLACKBOX_PAUSE_US;
    return after_us < longest_us ? after_us : longest_us;
}

/* Ends the file; an incomplete one is removed. An event whose last seconds are not in it gets
 * another one. out: 0, or errno */
static int end(struct cb_blackbox *box, int error) {
    char temporary[PATH_SIZE], path[PATH_SIZE];
    if (box->fd >= 0) error = cb_output_close(box->fd, error, true);
    box->fd = -1;
    if (error != 0 || last_time(box) == box->event_us + CB_BLACKBOX_AFTER_US) box->word = NULL;
    put_path(box, temporary, box->name, ".new");
    put_path(box, path, box->name, "");
    if (error == 0 && rename(temporary, path) != 0) error = errno;
    if (error != 0) unlink(temporary);
    if (error != 0) return error;
    cb_output_sync_folder(path);
    box->written = box->next;
    box->files++;
    return 0;
}

/* in : text[CB_ROW_TEXT]. out: length of the row's line; 0: it is beyond the file's last one */
static size_t put_row(struct cb_blackbox *box, char *text, int64_t last_us) {
    struct head head;
    float values[CB_ROW_VALUES];
    const unsigned char *at = row_at(box, box->next);
    memcpy(&head, at, sizeof head);
    memcpy(values, at + sizeof head, box->values * sizeof(float));
    if (head.time_us > last_us) return 0;
    if (box->first_us < 0) box->first_us = head.time_us;
    const struct cb_row_frame frame = {head.time_us - box->first_us, head.time_us + box->wall_us,
                                       head.mode, head.reason};
    return cb_row_line(text, &frame, values, box->values);
}

/* Writes rows up to that time, a slice at most. out: 0, or errno. *more: others may come */
static int write_slice(struct cb_blackbox *box, int64_t last_us, bool *more) {
    static char text[8 * CB_ROW_TEXT];
    size_t used = 0, bytes = 1;
    if (box->added - box->next > box->capacity) box->next = box->added - box->capacity;
    for (unsigned i = 0; i < CB_BLACKBOX_SLICE && box->next < box->added; i++) {
        if (sizeof text - used < CB_ROW_TEXT) {
            if (cb_output_write(box->fd, text, used) != used) return errno;
            used = 0;
        }
        bytes = put_row(box, text + used, last_us);
        if (bytes == 0) break;
        used += bytes;
        box->next++;
    }
    *more = bytes != 0;
    return cb_output_write(box->fd, text, used) == used ? 0 : errno;
}

/* out: the event's file is to begin */
static bool is_due(const struct cb_blackbox *box, int64_t now_us) {
    return box->word == requested || box->begun_us == 0 ||
           now_us - box->begun_us >= CB_BLACKBOX_PAUSE_US;
}

void cb_blackbox_work(struct cb_blackbox *box, int64_t now_us) {
    int error = 0;
    if (box->rows == NULL || box->word == NULL) return;
    if (box->fd < 0) {
        if (is_due(box, now_us) && (error = begin(box, now_us)) != 0) box->error = end(box, error);
        return;
    }
    const int64_t last_us = last_time(box);
    bool more = false;
    error = write_slice(box, last_us, &more);
    const bool comes = box->next < box->added || now_us < last_us + 1000000; /* the loop runs */
    if (error != 0 || !more || !comes) box->error = end(box, error);
}

/* Writes what is pending up to the last row. */
static void drain(struct cb_blackbox *box, int64_t now_us) {
    int error = 0;
    if (box->rows == NULL || box->word == NULL) return;
    if (box->fd < 0) error = begin(box, now_us);
    bool more = false;
    while (error == 0 && box->next < box->added) error = write_slice(box, INT64_MAX, &more);
    box->error = end(box, error);
    box->word = NULL; /* this is the event's last file */
}

int cb_blackbox_follow(struct cb_blackbox *box, const struct cb_config *config) {
    char header[CB_ROW_TEXT];
    if (box->rows == NULL) return 0;
    const size_t bytes = cb_row_header(header, config);
    if (bytes == box->header_used && memcmp(header, box->header, bytes) == 0) return 0;
    drain(box, cb_boottime_us());
    return make_ring(box, config);
}

int cb_blackbox_finish(struct cb_blackbox *box, int64_t now_us) {
    drain(box, now_us);
    free(box->rows);
    box->rows = NULL;
    return box->error;
}
