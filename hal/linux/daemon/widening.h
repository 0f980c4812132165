/* SPDX-License-Identifier: MIT
 * Finds changes in a new coefficient file that let outputs go further, faster or elsewhere than the
 * running one: such a file is taken only at rest (docs/decisions/0011-site-ceiling.md). */
#ifndef COMPBOX_HAL_LINUX_DAEMON_WIDENING_H
#define COMPBOX_HAL_LINUX_DAEMON_WIDENING_H

#include <stdbool.h>
#include <stddef.h>

struct cb_config;

/* Compares channels and slopes by name, and pairs by their channels: a larger limit_um, error_um,
 * slew_um_per_s, largest step or max_difference_um; another register, type, scale or sign, of
 * `applied` and `tangent` too; a new or missing channel or pair.
 * in : both complete, their limits already under the site's ceiling
 * out: true and the first difference in text[size], as "channel Z: limit_um is 1000000, not 300" */
bool cb_widening_find(const struct cb_config *now, const struct cb_config *fresh, char *text,
                      size_t size);

#endif
