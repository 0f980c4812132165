/* SPDX-License-Identifier: MIT
 * A slot of the MCU's flash: the text of a coefficient file behind a header that says whether it is
 * whole. `compbox pack` writes it; bytes are little-endian:
 *
 *    0  magic "CBX1"
 *    4  revision of the file
 *    8  length of the text in bytes
 *   12  CRC-32 of the text (crc32.h)
 *   16  where a box without a file that it can run says so (struct cb_slot_report): status
 * register, two bytes; unit id; parity (low half) and stop bits (high half) 20  baud rate; 0:
 * nowhere 24  0, one word, reserved 28  CRC-32 of the bytes 0 … 27 32  text
 *
 * There are two slots. The one with the newest revision that is whole wins; the other is the one to
 * write next, so that the box has a good file whenever the power goes. */
#ifndef COMPBOX_FIRMWARE_LOAD_SLOT_H
#define COMPBOX_FIRMWARE_LOAD_SLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/limits.h"

enum { CB_SLOT_HEADER_BYTES = 32, CB_SLOTS = 2 };

enum cb_slot_state {
    CB_SLOT_EMPTY,  /* erased: no header (all bits 1), or shorter than one */
    CB_SLOT_BROKEN, /* neither empty nor whole: a cut during writing, a worn cell */
    CB_SLOT_WHOLE,
};

struct cb_slot {
    uint32_t revision;
    uint32_t length;  /* 1 … CB_MAX_TEXT_BYTES */
    uint32_t crc;     /* of the text */
    const char *text; /* in the caller's bytes; no end mark behind it */
};

/* The PLC's serial line and status register as the file has them: the header has a check sum of its
 * own, so that a box can report a text that is broken or that it refuses. */
struct cb_slot_report {
    uint32_t baud;
    uint16_t status; /* address of the status register */
    uint8_t unit;
    uint8_t parity, stop_bits; /* as in struct cb_rtu_line */
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

/* Adds the place of the report to a header. */
void cb_slot_set_report(uint8_t header[CB_SLOT_HEADER_BYTES], const struct cb_slot_report *report);

/* in : bytes[size], all of the slot's memory; any content
 * out: *report and true where the header, not necessarily the text, is whole and has one that a
 * serial line can be set to */
bool cb_slot_read_report(const void *bytes, size_t size, struct cb_slot_report *report);

#endif
