/* SPDX-License-Identifier: MIT
 * Channels that the site's ceiling lowers, for log and statistics. */
#ifndef COMPBOX_HAL_LINUX_FILES_CEILING_WORDS_H
#define COMPBOX_HAL_LINUX_FILES_CEILING_WORDS_H

#include <stddef.h>
#include <stdint.h>

struct cb_config;

/* in : lowered: bits as in cb_ceiling_apply()
 * out: text[size]: the names of these channels, "X, Z, the slope of Z"; cut off where it is full */
void cb_lowered_names(const struct cb_config *config, uint32_t lowered, char *text, size_t size);

#endif
