/* SPDX-License-Identifier: MIT */
#include "firmware/load/host.h"

#include <stdint.h>

/* Skips a number 0 … 255 without leading zeros. out: true if there was one */
static bool pass_byte(const char **text) {
    const char *first = *text;
    uint32_t value = 0;
    while (**text >= '0' && **text <= '9' && *text - first < 3)
        value = value * 10 + (uint32_t)(*(*text)++ - '0');
    const long digits = *text - first;
    return digits > 0 && value <= 255 && (*first != '0' || digits == 1);
}

static bool is_ipv4(const char *text) {
    for (int i = 0; i < 4; ++i) {
        if (i > 0 && *text++ != '.') return false;
        if (!pass_byte(&text)) return false;
    }
    return *text == '\0';
}

static bool is_hex(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/* Skips one to four hexadecimal digits. out: true if there were any */
static bool pass_group(const char **text) {
    int digits = 0;
    for (; is_hex(**text) && digits < 4; ++digits) ++*text;
    return digits > 0;
}

/* out: true for eight groups; "::" may replace a run of them, an IPv4 address the last two */
static bool is_ipv6(const char *text) {
    int groups = 0;
    bool gap = false;
    if (text[0] == ':' && text[1] != ':') return false;
    while (*text) {
        if (text[0] == ':' && text[1] == ':') {
            if (gap) return false;
            gap = true;
            text += 2;
            if (!*text) break;
        } else if (groups > 0 && *text++ != ':') {
            return false;
        }
        if (is_ipv4(text)) {
            groups += 2;
            break;
        }
        if (!pass_group(&text)) return false;
        ++groups;
    }
    return gap ? groups < 8 : groups == 8;
}

bool cb_is_numeric_address(const char *text) {
    return is_ipv4(text) || is_ipv6(text);
}
