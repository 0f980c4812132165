/* SPDX-License-Identifier: MIT
 * A slot of the MCU's flash: a header with check sums, followed by the text of a coefficient file.
 * `compbox pack` writes it. Words are little-endian:
 *
 *  - byte 0:  magic "CBX1"
 *  - byte 4:  revision of the file
 *  - byte 8:  length of the text in bytes
 *  - byte 12: CRC-32 of the text (crc32.h)
 *  - byte 16: struct cb_slot_report: status register (two bytes), unit id (one byte), parity (low
 *    half byte), stop bits (high half byte)
 *  - byte 20: its baud rate; 0: no report
 *  - byte 24: reserved, 0
 *  - byte 28: CRC-32 of the bytes 0 … 27
 *  - byte 32: the text
 *
 * There are two slots. The box loads the whole one with the higher revision. Write a new file to
 * the other slot: then the box has a good file even if the power fails. */
#ifndef COMPBOX_FIRMWARE_LOAD_SLOT_H
#define COMPBOX_FIRMWARE_LOAD_SLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/limits.h"

enum { CB_SLOT_HEADER_BYTES = 32, CB_SLOTS = 2 };

enum cb_slot_state {
    CB_SLOT_EMPTY,  /* erased: no header (all bits 1), or shorter than one */
    CB_SLOT_BROKEN, /* neither empty nor whole: writing was interrupted, or a cell is worn */
    CB_SLOT_WHOLE,
};

struct cb_slot {
    uint32_t revision;
    uint32_t length;  /* 1 … CB_MAX_TEXT_BYTES */
    uint32_t crc;     /* of the text */
    const char *text; /* in the caller's bytes; not terminated by 0 */
};

/* The PLC's serial line and status register, copied from the file. The header has a check sum of
 * its own, so a box can report a broken or refused text to the PLC. */
struct cb_slot_report {
    uint32_t baud;
    uint16_t status; /* address of the status register */
    uint8_t unit;
    uint8_t parity, stop_bits; /* as in struct cb_rtu_line */
};

/* in : bytes[size], all of the slot's memory; any content
 * out: *slot if CB_SLOT_WHOLE, else unchanged. Reads each byte at most twice. */
enum cb_slot_state cb_slot_read(const void *bytes, size_t size, struct cb_slot *slot);

/* in : both slots, as cb_slot_read() left them
 * out: index of the slot to load: the whole one with the higher revision, the first of two equal
 *      ones; -1 if neither is whole */
int cb_slot_newest(const enum cb_slot_state states[CB_SLOTS], const struct cb_slot slots[CB_SLOTS]);

/* in : text[length], length 1 … CB_MAX_TEXT_BYTES
 * out: its header, without a report */
void cb_slot_header(uint32_t revision, const char *text, uint32_t length,
                    uint8_t header[CB_SLOT_HEADER_BYTES]);

/* Adds *report to a header, and renews the header's check sum. */
void cb_slot_set_report(uint8_t header[CB_SLOT_HEADER_BYTES], const struct cb_slot_report *report);

/* in : bytes[size], all of the slot's memory; any content
 * out: true and *report if the header is whole, whatever the text, and its report has valid
 *      settings of a serial line; else *report unchanged */
bool cb_slot_read_report(const void *bytes, size_t size, struct cb_slot_report *report);

#endif
