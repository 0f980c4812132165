/* SPDX-License-Identifier: MIT
 * Files written by the daemon. The folder may belong to another user, so a symbolic link at the
 * name itself is rejected. Links on the way to the folder are followed. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_OUTPUT_FILE_H
#define COMPBOX_HAL_LINUX_DAEMON_OUTPUT_FILE_H

#include <stddef.h>

/* Opens `path` for writing and creates a missing file. A regular file is emptied; a device or a
 * pipe is opened without waiting.
 * out: a descriptor; or -1 with errno (ELOOP: it is a symbolic link) and nothing changed */
int cb_output_open(const char *path);

/* Creates an empty file PATH.new, which cb_output_replace moves over `path`. A PATH.new of an
 * earlier run is removed first.
 * in : temporary[size]: for its name
 * out: a descriptor; or -1 with errno (ELOOP: `path` is a symbolic link, ENOTSUP: no regular
 * file) */
int cb_output_begin(const char *path, char *temporary, size_t size);

/* in : error: of writing it, 0 when all is on the disk
 * out: 0: renamed over `path`; else errno: the temporary file is removed, `path` unchanged */
int cb_output_replace(const char *path, const char *temporary, int error);

/* out: the cause of a failed write, for a person */
const char *cb_output_error(int error);

#endif
