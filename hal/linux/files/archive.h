/* SPDX-License-Identifier: MIT
 * A file of a limited size and those that are kept of it (rotate.h), all together within a limit.
 * The normal thread compresses what is kept, a slice at a time: PATH.N.gz.new is renamed PATH.N.gz
 * when it is whole and on the disk, and only then PATH.N is removed. */
#ifndef COMPBOX_HAL_LINUX_FILES_ARCHIVE_H
#define COMPBOX_HAL_LINUX_FILES_ARCHIVE_H

#include <stdint.h>

#include "hal/linux/files/rotate.h"

enum {
    CB_ARCHIVE_FILES = 999,
    CB_ARCHIVE_SHARE = 8, /* of the limit: size of the file that is written */
};

struct cb_archive {
    const char *path;
    int64_t most_bytes;             /* 0: no limit: nothing is removed or compressed */
    unsigned number;                /* the next one to look at; 0: there is nothing to do … */
    bool compresses;                /* … its compression goes on … */
    int error;                      /* errno of the last compression; 0: it succeeded */
    char temporary[CB_ROTATE_NAME]; /* … into this file */
};

/* Removes what a crash has left of a compression. */
void cb_archive_start(struct cb_archive *archive, const char *path, int64_t most_bytes);

/* out: size at which the file is kept and another one begins; INT64_MAX without a limit */
int64_t cb_archive_piece(const struct cb_archive *archive);

/* Keeps PATH as PATH.1. Removes the oldest files until the others, the next file and a compression
 * are within the limit; PATH.1 stays, even if it alone is larger. out: 0, or errno */
int cb_archive_keep(struct cb_archive *archive);

/* Call it regularly: compresses a slice. */
void cb_archive_work(struct cb_archive *archive);

/* Leaves a compression to the next start. */
void cb_archive_finish(struct cb_archive *archive);

#endif
