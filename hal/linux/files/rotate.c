/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/rotate.h"

#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

bool cb_rotate_name(char *name, const char *path, unsigned n, bool compressed) {
    const char *end = compressed ? ".gz" : "";
    return snprintf(name, CB_ROTATE_NAME, "%s.%u%s", path, n, end) < CB_ROTATE_NAME;
}

int64_t cb_rotate_bytes(const char *path, unsigned n) {
    char name[CB_ROTATE_NAME];
    struct stat there;
    int64_t bytes = -ENOENT;
    for (int compressed = 0; compressed < 2; compressed++) {
        if (!cb_rotate_name(name, path, n, compressed)) return -ENAMETOOLONG;
        if (lstat(name, &there) == 0)
            bytes = there.st_size + (bytes < 0 ? 0 : bytes);
        else if (errno != ENOENT)
            return -errno;
    }
    return bytes;
}

int cb_rotate_remove(const char *path, unsigned n) {
    char name[CB_ROTATE_NAME];
    for (int compressed = 0; compressed < 2; compressed++) {
        if (!cb_rotate_name(name, path, n, compressed)) return ENAMETOOLONG;
        if (unlink(name) != 0 && errno != ENOENT) return errno;
    }
    return 0;
}

/* Renames both forms of PATH.N to the next number. in : the names fit. out: 0, or errno */
static int move(const char *path, unsigned n) {
    char from[CB_ROTATE_NAME], to[CB_ROTATE_NAME];
    for (int compressed = 0; compressed < 2; compressed++) {
        cb_rotate_name(from, path, n, compressed);
        cb_rotate_name(to, path, n + 1, compressed);
        if (rename(from, to) != 0 && errno != ENOENT) return errno;
    }
    return 0;
}

int cb_rotate(const char *path, unsigned most, bool may_remove) {
    char name[CB_ROTATE_NAME];
    unsigned free = 1;
    int64_t found;
    if (!cb_rotate_name(name, path, most, true)) return ENAMETOOLONG; /* else all names fit */
    while ((found = cb_rotate_bytes(path, free)) >= 0 && free < most) free++;
    int error = found >= 0 ? may_remove ? cb_rotate_remove(path, most) : EEXIST : (int)-found;
    if (error == ENOENT) error = 0;
    while (error == 0 && --free > 0) error = move(path, free);
    if (error != 0) return error;
    cb_rotate_name(name, path, 1, false);
    return rename(path, name) == 0 || errno == ENOENT ? 0 : errno;
}
