/* SPDX-License-Identifier: MIT
 * Files written by the daemon. The folder may belong to another user, so a symbolic link at the
 * name itself is rejected. Links on the way to the folder are followed. */
#ifndef COMPBOX_HAL_LINUX_FILES_OUTPUT_FILE_H
#define COMPBOX_HAL_LINUX_FILES_OUTPUT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Opens `path` for writing and creates a missing file. A regular file is emptied; a device or a
 * pipe is opened without waiting.
 * out: a descriptor; or -1 with errno (ELOOP: it is a symbolic link) and nothing changed */
int cb_output_open(const char *path);

/* Like cb_output_open(), but keeps the content; *bytes: its size, -1: it is no regular file. */
int cb_output_open_kept(const char *path, int64_t *bytes);

/* Opens `path` for appending and creates a missing file. A last line without an end gets one.
 * out: a descriptor, and the size of a regular file in *bytes; or -1 with errno (ELOOP: it is a
 *      symbolic link) */
int cb_output_append(const char *path, int64_t *bytes);

/* Goes on after a short write. out: number of bytes written; fewer than size only with errno set */
size_t cb_output_write(int fd, const void *bytes, size_t size);

/* Cuts a file off behind `bytes`, be it interrupted or not. out: false, with errno, if it is not */
bool cb_output_cut(int fd, int64_t bytes);

/* Closes a file. in : error: errno of what was written to it, 0: it is whole; durable: a whole one
 * is on the disk before the call returns. out: error, or errno of the first failure here */
int cb_output_close(int fd, int error, bool durable);

/* Brings the entry of `path` in its folder to the disk, so that a new name survives a power cut. */
void cb_output_sync_folder(const char *path);

/* Replaces the content of `path` as a whole: writes PATH.new and renames it over `path`, so a
 * reader sees the old content or the new one. A PATH.new of an earlier run is removed first. in :
 * durable: content and name are on the disk before the call returns out: 0, or errno (ELOOP: `path`
 * is a symbolic link, ENOTSUP: no regular file); on error `path` is unchanged */
int cb_output_whole(const char *path, const void *bytes, size_t size, bool durable);

/* out: the cause of a failed write, for a person */
const char *cb_output_error(int error);

#endif
