/* SPDX-License-Identifier: MIT
 * CRC-32 (IEEE 802.3: reflected, 0xEDB88320, start and end inverted), computed in pieces. */
#ifndef COMPBOX_FIRMWARE_BASE_CRC32_H
#define COMPBOX_FIRMWARE_BASE_CRC32_H

#include <stddef.h>
#include <stdint.h>

/* in : crc of all data before (0 at the start); data[length]
 * out: crc of all data so far: cb_crc32(cb_crc32(0, a), b) == cb_crc32(0, ab)
 * Table of 16 words, two look-ups for each byte. */
uint32_t cb_crc32(uint32_t crc, const void *data, size_t length);

#endif
