/* SPDX-License-Identifier: MIT
 * Whether a file was written or replaced between two looks at it. */
#ifndef COMPBOX_HAL_LINUX_FILE_VERSION_H
#define COMPBOX_HAL_LINUX_FILE_VERSION_H

#include <stdbool.h>
#include <sys/stat.h>

static inline bool cb_same_time(const struct timespec *a, const struct timespec *b) {
    return a->tv_sec == b->tv_sec && a->tv_nsec == b->tv_nsec;
}

/* out: true if both are one file with one content. ctime, the time of any last change, reveals a
 * file whose old mtime was restored. */
static inline bool cb_same_version(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size &&
           cb_same_time(&a->st_mtim, &b->st_mtim) && cb_same_time(&a->st_ctim, &b->st_ctim);
}

#endif
