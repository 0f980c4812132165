/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/ceiling_words.h"

#include <stdio.h>

#include "firmware/config/config.h"

void cb_lowered_names(const struct cb_config *config, uint32_t lowered, char *text, size_t size) {
    size_t length = 0;
    text[0] = '\0';
    for (unsigned i = 0; i < cb_all_channels(config) && length < size; i++) {
        if (!(lowered & 1u << i)) continue;
        const int more =
            snprintf(text + length, size - length, "%s%s%s", length > 0 ? ", " : "",
                     config->channels[i].is_slope ? "the slope of " : "", config->channels[i].name);
        length += more > 0 ? (size_t)more : 0;
    }
}
