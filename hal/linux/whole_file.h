/* SPDX-License-Identifier: MIT
 * Reads a whole file at once, without waiting for what is no file. */
#ifndef COMPBOX_HAL_LINUX_WHOLE_FILE_H
#define COMPBOX_HAL_LINUX_WHOLE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

/* Reads a regular file only, and opens it without waiting: a pipe would wait for its writer.
 * out: bytes read, at most `size`, and *there of the file; -1 and in *why the cause */
long cb_whole_file_read(const char *path, char *text, size_t size, struct stat *there,
                        const char **why);

/* Reads on after a short read or a signal. in: fd of a file that does not wait
 * out: bytes read, at most `size`; -1 with errno */
long cb_read_to_end(int fd, char *text, size_t size);

/* Reads a part of a file, as cb_read_to_end() does. out: whether all of it was read; else errno */
bool cb_read_at(int fd, int64_t at, char *to, size_t bytes);

#endif
