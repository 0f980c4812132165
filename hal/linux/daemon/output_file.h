/* SPDX-License-Identifier: MIT
 * Files that the daemon writes. The folder may belong to another user, so a symbolic link at the
 * name itself is refused. Links on the way to the folder are followed. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_OUTPUT_FILE_H
#define COMPBOX_HAL_LINUX_DAEMON_OUTPUT_FILE_H

#include <stddef.h>

/* Opens `path` for writing, created where it is missing; a regular file is emptied, a device or a
 * pipe never waited for.
 * out: a descriptor; or -1 with errno (ELOOP: it is a symbolic link) and nothing changed */
int cb_output_open(const char *path);

/* A new empty file PATH.new, which replaces `path` by cb_output_replace. A PATH.new that a run
 * before left there is removed first.
 * in : temporary[size]: for its name
 * out: a descriptor; or -1 with errno (ELOOP: `path` is a symbolic link, ENOTSUP: no regular file)
 */
int cb_output_begin(const char *path, char *temporary, size_t size);

/* in : error: of writing it, 0 where all is on the disk
 * out: 0: renamed over `path`; else errno: the temporary file is removed, `path` untouched */
int cb_output_replace(const char *path, const char *temporary, int error);

/* Why a file cannot be written, for people. */
const char *cb_output_error(int error);

#endif
