/* SPDX-License-Identifier: MIT
 * A slot of the MCU's flash: the text of a coefficient file behind a header that says whether it is
 * whole. `compbox pack` writes it; bytes are little-endian:
 *
 *    0  magic "CBX1"
 *    4  revision of the file
 *    8  length of the text in bytes
 *   12  CRC-32 of the text (crc32.h)
 *   16  0, three words, reserved
 *   28  CRC-32 of the bytes 0 … 27
 *   32  text
 *
 * There are two slots. The one with the newest revision that is whole wins; the other is the one to
 * write next, so that the box has a good file whenever the power goes. */
#ifndef COMPBOX_FIRMWARE_SLOT_H
#define COMPBOX_FIRMWARE_SLOT_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/limits.h"

enum { CB_SLOT_HEADER_BYTES = 32, CB_SLOTS = 2 };

enum cb_slot_state {
    CB_SLOT_EMPTY,  /* erased: no header (all bits 1), or shorter than one */
    CB_SLOT_BROKEN, /* neither empty nor whole: a cut during writing, a worn cell */
    CB_SLOT_WHOLE,
};

struct cb_slot {
    uint32_t revision;
    uint32_t length;  /* 1 … CB_MAX_TEXT_BYTES */
    const char *text; /* in the caller's bytes; no end mark behind it */
};

/* in : bytes[size], all of the slot's memory; any content
 * out: *slot where CB_SLOT_WHOLE, else unchanged. Reads each byte at most twice. */
enum cb_slot_state cb_slot_read(const void *bytes, size_t size, struct cb_slot *slot);

/* in : bytes[CB_SLOTS], each `size` long
 * out: index and content of the slot to load: the whole one with the higher revision, the first of
 *      two equal ones; -1 and *slot unchanged where neither is whole */
int cb_slot_newest(const void *const bytes[CB_SLOTS], size_t size, struct cb_slot *slot);

/* in : text[length], length 1 … CB_MAX_TEXT_BYTES
 * out: the header to write before it */
void cb_slot_header(uint32_t revision, const char *text, uint32_t length,
                    uint8_t header[CB_SLOT_HEADER_BYTES]);

#endif
