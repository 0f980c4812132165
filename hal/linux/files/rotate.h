/* SPDX-License-Identifier: MIT
 * Files that are kept beside the one that is written: PATH.1 is the newest, then PATH.2 …. A
 * compressed one is PATH.N.gz. */
#ifndef COMPBOX_HAL_LINUX_FILES_ROTATE_H
#define COMPBOX_HAL_LINUX_FILES_ROTATE_H

#include <stdbool.h>
#include <stdint.h>

enum { CB_ROTATE_NAME = 4096 };

/* out: name[CB_ROTATE_NAME]: PATH.N, or PATH.N.gz; false: it does not fit */
bool cb_rotate_name(char *name, const char *path, unsigned n, bool compressed);

/* out: size of both forms of PATH.N; or -errno (-ENOENT: there is none) */
int64_t cb_rotate_bytes(const char *path, unsigned n);

/* Removes both forms of PATH.N. out: 0, or errno */
int cb_rotate_remove(const char *path, unsigned n);

/* Renames PATH to PATH.1, PATH.1 to PATH.2 …, up to the first number that is free. A crash within
 * leaves one number free and loses nothing.
 * in : most: highest number; may_remove: PATH.most is removed if no number is free
 * out: 0, or errno (EEXIST: no number is free; ENAMETOOLONG: PATH.most.gz does not fit) */
int cb_rotate(const char *path, unsigned most, bool may_remove);

#endif
