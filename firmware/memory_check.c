/* SPDX-License-Identifier: MIT */
#include "firmware/memory_check.h"

#include <string.h>

uint32_t cb_memory_check(uint32_t sum, const void *memory, uint32_t words) {
    const char *at = memory;
    for (const char *const end = at + words * sizeof sum; at != end; at += sizeof sum) {
        uint32_t word;
        memcpy(&word, at, sizeof word);
        sum ^= word;
        sum = (sum << 15 | sum >> 17) * 0x85EBCA6Bu;
        sum ^= sum >> 15;
    }
    return sum;
}
