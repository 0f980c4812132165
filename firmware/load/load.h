/* SPDX-License-Identifier: MIT
 * coefficients.json to struct cb_config: the one loader, on every target (docs/DESIGN.md §6). */
#ifndef COMPBOX_FIRMWARE_LOAD_LOAD_H
#define COMPBOX_FIRMWARE_LOAD_LOAD_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/config/loading.h"

/* in : text[length], need not end with 0; target, scratch and message not NULL
 * out: CB_OK and *config complete, or the error and the first mistake in *message; *config is then
 *      undefined and must not be run
 * No heap, no recursion, no libc; time linear in length. */
enum cb_error cb_config_load(struct cb_config *config, const char *text, size_t length,
                             const struct cb_target *target, struct cb_load_scratch *scratch,
                             struct cb_message *message);

#endif
