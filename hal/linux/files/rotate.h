/* SPDX-License-Identifier: MIT
 * Files that are kept beside the one that is written: PATH.1 is the newest, then PATH.2 …. A
 * compressed one is PATH.N.gz. */
#ifndef COMPBOX_HAL_LINUX_FILES_ROTATE_H
#define COMPBOX_HAL_LINUX_FILES_ROTATE_H

#include <stdbool.h>

/* Renames PATH to PATH.1, PATH.1 to PATH.2 …, up to the first number that is free. A crash within
 * leaves one number free and loses nothing.
 * in : most: highest number; may_remove: PATH.most is removed if no number is free
 * out: 0, or errno (EEXIST: no number is free) */
int cb_rotate(const char *path, unsigned most, bool may_remove);

#endif
