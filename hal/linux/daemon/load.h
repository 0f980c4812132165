/* SPDX-License-Identifier: MIT
 * The coefficient file from the disk into the box. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_LOAD_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/config.h"

/* out: true and *config complete; or false, *config undefined, and a sentence with file, place and
 *      remedy in said[size]. Uses static memory: for one thread. */
bool cb_load_file(struct cb_config *config, const char *path, char *said, size_t size);

#endif
