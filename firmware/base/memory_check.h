/* SPDX-License-Identifier: MIT
 * A check sum over memory that must not change, cheap enough for every step: 5 instructions per
 * word, against 40 for a CRC-32. */
#ifndef COMPBOX_FIRMWARE_BASE_MEMORY_CHECK_H
#define COMPBOX_FIRMWARE_BASE_MEMORY_CHECK_H

#include <stdint.h>

/* in : sum of the memory before (any number at the start); words * 4 bytes of memory
 * out: the sum of all memory so far
 * Each word enters by a function that is one-to-one in the sum and in the word. A change within one
 * word is therefore always detected, and any other change except one in 2^32. */
uint32_t cb_memory_check(uint32_t sum, const void *memory, uint32_t words);

#endif
