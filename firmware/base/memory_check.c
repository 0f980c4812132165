/* SPDX-License-Identifier: MIT */
#include "firmware/base/memory_check.h"

#include <string.h>

static inline uint32_t with(uint32_t sum, const char *at) {
    uint32_t word;
    memcpy(&word, at, sizeof word);
    sum ^= word;
    sum = (sum << 15 | sum >> 17) * 0x85EBCA6Bu;
    return sum ^ sum >> 15;
}

uint32_t cb_memory_check(uint32_t sum, const void *memory, uint32_t words) {
    const char *at = memory;
    for (; words >= 4; words -= 4, at += 16)
        sum = with(with(with(with(sum, at), at + 4), at + 8), at + 12);
    for (; words > 0; --words, at += 4) sum = with(sum, at);
    return sum;
}
