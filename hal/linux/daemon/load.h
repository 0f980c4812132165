/* SPDX-License-Identifier: MIT
 * The coefficient file from the disk into the box, by the site's rules: signed, where it has
 * enrolled a key, and under its ceiling. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_LOAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/box/ceiling.h"
#include "hal/linux/files/events.h"

struct cb_config;

/* What the site sets once, and no coefficient file changes. */
struct cb_site {
    struct cb_ceiling ceiling;
    const char *keys; /* folder of the enrolled keys; NULL: none */
};

enum { CB_LOAD_MESSAGE_BYTES = 512 };

/* Facts about a coefficient file that was read. */
struct cb_loaded {
    struct cb_file_facts facts;          /* was_read: all of it could be read */
    uint32_t lowered;                    /* bit i: the ceiling lowers the limits of channel i */
    bool is_signed;                      /* by an enrolled key; false: none is enrolled */
    char message[CB_LOAD_MESSAGE_BYTES]; /* reason of a rejection: a sentence with file, place and
                                            remedy */
};

/* Reads a regular file only, and opens it without waiting: a pipe or a device in its place is
 * rejected. The file is read once: the bytes that the signature fits are those that are parsed.
 * out: true and *config complete, its limits at most the ceiling; or false, *config undefined, and
 *      the sentence in loaded->message. Uses static memory: for one thread. */
bool cb_load_file(struct cb_config *config, const char *path, const struct cb_site *site,
                  struct cb_loaded *loaded);

#endif
