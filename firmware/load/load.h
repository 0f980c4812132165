/* SPDX-License-Identifier: MIT
 * The loader of every target: coefficients.json to struct cb_config (docs/DESIGN.md §6). */
#ifndef COMPBOX_FIRMWARE_LOAD_LOAD_H
#define COMPBOX_FIRMWARE_LOAD_LOAD_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/config/loading.h"

struct cb_config;

/* in : text[length], any bytes, without a terminating 0; target, scratch and message not NULL
 * out: CB_OK and *config complete; or an error, *message with the first mistake and its place, and
 *      *config undefined: do not run it
 * No heap, no recursion, no libc. */
enum cb_error cb_config_load(struct cb_config *config, const char *text, size_t length,
                             const struct cb_target *target, struct cb_load_scratch *scratch,
                             struct cb_message *message);

#endif
