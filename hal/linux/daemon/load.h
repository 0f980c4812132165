/* SPDX-License-Identifier: MIT
 * The coefficient file from the disk into the box, under the site's ceiling. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_LOAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box/ceiling.h"
#include "hal/linux/files/events.h"

struct cb_config;

enum { CB_LOAD_MESSAGE_BYTES = 512 };

/* Facts about a coefficient file that was read. */
struct cb_loaded {
    struct cb_file_facts facts;          /* was_read: all of it could be read */
    uint32_t lowered;                    /* bit i: the ceiling lowers the limits of channel i */
    char message[CB_LOAD_MESSAGE_BYTES]; /* reason of a rejection: a sentence with file, place and
                                            remedy */
};

/* Reads a regular file only, and opens it without waiting: a pipe or a device in its place is
 * rejected.
 * out: true and *config complete, its limits at most the ceiling; or false, *config undefined, and
 *      the sentence in loaded->message. Uses static memory: for one thread. */
bool cb_load_file(struct cb_config *config, const char *path, const struct cb_ceiling *ceiling,
                  struct cb_loaded *loaded);

#endif
