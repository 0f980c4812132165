/* SPDX-License-Identifier: MIT
 * A check sum over memory that must not change, cheap enough for every step: 5 instructions a word
 * where a CRC-32 takes 40. */
#ifndef COMPBOX_FIRMWARE_BASE_MEMORY_CHECK_H
#define COMPBOX_FIRMWARE_BASE_MEMORY_CHECK_H

#include <stdint.h>

/* in : sum of everything before (any number at the start); words * 4 bytes of memory
 * out: the sum of everything so far
 * Each word enters by a one-to-one function of the sum and of the word: a change inside one word,
 * whatever its bits, is always found, any other but for one in 2^32. */
uint32_t cb_memory_check(uint32_t sum, const void *memory, uint32_t words);

#endif
