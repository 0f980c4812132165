/* SPDX-License-Identifier: MIT
 * SHA-256 (FIPS 180-4) of bytes in memory: the identity of a file, as `sha256sum` prints it. */
#ifndef COMPBOX_FIRMWARE_BASE_SHA256_H
#define COMPBOX_FIRMWARE_BASE_SHA256_H

#include <stddef.h>
#include <stdint.h>

enum { CB_SHA256_BYTES = 32 };

/* in : data[length], below 2^61 bytes
 * out: digest[CB_SHA256_BYTES]. About 20 ns for each byte on the board; for no real-time loop. */
void cb_sha256(const void *data, size_t length, uint8_t *digest);

#endif
