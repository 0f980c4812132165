/* SPDX-License-Identifier: MIT
 * CRC-32 (IEEE 802.3: reflected, 0xEDB88320, start and end inverted), a piece at a time. */
#ifndef COMPBOX_FIRMWARE_BASE_CRC32_H
#define COMPBOX_FIRMWARE_BASE_CRC32_H

#include <stddef.h>
#include <stdint.h>

/* in : crc of everything before (0 at the start); data[length]
 * out: crc of everything so far: cb_crc32(cb_crc32(0, a), b) == cb_crc32(0, ab)
 * A table of 16 words; two look-ups for a byte. */
uint32_t cb_crc32(uint32_t crc, const void *data, size_t length);

#endif
