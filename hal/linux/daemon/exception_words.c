/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/exception_words.h"

#include <stdio.h>
#include <string.h>

static const char *name_of(unsigned code) {
    static const char *const names[] = {
        [0] = "of a code that has no name", [1] = "illegal function",
        [2] = "illegal data address",       [3] = "illegal data value",
        [4] = "server device failure",      [5] = "acknowledge",
        [6] = "server device busy",         [8] = "memory parity error",
        [10] = "gateway path unavailable",  [11] = "gateway target device failed to respond"};
    const unsigned count = sizeof names / sizeof names[0];
    return code < count && names[code] != NULL ? names[code] : names[0];
}

void cb_add_exceptions(const uint32_t *before, const uint32_t *now, unsigned codes, char *text,
                       size_t size) {
    for (unsigned code = 0; code < codes; code++) {
        const size_t used = strlen(text);
        if (now[code] == before[code]) continue;
        if (code == 0)
            snprintf(text + used, size - used, "; exceptions %s", name_of(code));
        else
            snprintf(text + used, size - used, "; exception %u (%s)", code, name_of(code));
    }
}

void cb_add_counter(const char *name, uint32_t count, char *text, size_t size) {
    const size_t used = strlen(text);
    if (count == 0) return;
    snprintf(text + used, size - used, "%s%s: %u", used == 0 ? "" : ", ", name, (unsigned)count);
    for (char *at = text + used; *at != '\0'; at++)
        if (*at == '_') *at = ' ';
}
