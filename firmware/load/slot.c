/* SPDX-License-Identifier: MIT */
#include "firmware/load/slot.h"

#include <string.h>

#include "firmware/base/crc32.h"
#include "firmware/wire/rtu_line.h"

enum {
    MAGIC = 0,
    REVISION = 4,
    LENGTH = 8,
    TEXT_CRC = 12,
    REPORT = 16,
    REPORT_BAUD = 20,
    HEADER_CRC = 28
};

static const uint8_t magic[4] = {'C', 'B', 'X', '1'};

static uint32_t get_word(const uint8_t *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

static void put_word(uint8_t *bytes, uint32_t word) {
    for (unsigned i = 0; i < 4; ++i) bytes[i] = (uint8_t)(word >> 8 * i);
}

/* out: true if all bits of the header are 1, as after erasing */
static int is_erased(const uint8_t *bytes) {
    for (unsigned i = 0; i < CB_SLOT_HEADER_BYTES; ++i) {
        if (bytes[i] != 0xFF) return 0;
    }
    return 1;
}

static bool header_is_whole(const uint8_t *header) {
    return memcmp(header + MAGIC, magic, sizeof magic) == 0 &&
           get_word(header + HEADER_CRC) == cb_crc32(0, header, HEADER_CRC);
}

enum cb_slot_state cb_slot_read(const void *bytes, size_t size, struct cb_slot *slot) {
    const uint8_t *const header = bytes;
    if (size < CB_SLOT_HEADER_BYTES || is_erased(header)) return CB_SLOT_EMPTY;
    const uint32_t length = get_word(header + LENGTH);
    if (!header_is_whole(header)) return CB_SLOT_BROKEN;
    if (length == 0 || length > CB_MAX_TEXT_BYTES || length > size - CB_SLOT_HEADER_BYTES)
        return CB_SLOT_BROKEN;
    const uint8_t *const text = header + CB_SLOT_HEADER_BYTES;
    if (get_word(header + TEXT_CRC) != cb_crc32(0, text, length)) return CB_SLOT_BROKEN;
    slot->revision = get_word(header + REVISION);
    slot->length = length;
    slot->crc = get_word(header + TEXT_CRC);
    slot->text = (const char *)text;
    return CB_SLOT_WHOLE;
}

int cb_slot_newest(const enum cb_slot_state states[CB_SLOTS],
                   const struct cb_slot slots[CB_SLOTS]) {
    int newest = -1;
    for (int i = 0; i < CB_SLOTS; ++i) {
        if (states[i] != CB_SLOT_WHOLE) continue;
        if (newest >= 0 && slots[i].revision <= slots[newest].revision) continue;
        newest = i;
    }
    return newest;
}

void cb_slot_header(uint32_t revision, const char *text, uint32_t length,
                    uint8_t header[CB_SLOT_HEADER_BYTES]) {
    memset(header, 0, CB_SLOT_HEADER_BYTES);
    memcpy(header + MAGIC, magic, sizeof magic);
    put_word(header + REVISION, revision);
    put_word(header + LENGTH, length);
    put_word(header + TEXT_CRC, cb_crc32(0, text, length));
    put_word(header + HEADER_CRC, cb_crc32(0, header, HEADER_CRC));
}

void cb_slot_set_report(uint8_t header[CB_SLOT_HEADER_BYTES], const struct cb_slot_report *report) {
    put_word(header + REPORT, (uint32_t)report->status | (uint32_t)report->unit << 16 |
                                  (uint32_t)report->parity << 24 |
                                  (uint32_t)report->stop_bits << 28);
    put_word(header + REPORT_BAUD, report->baud);
    put_word(header + HEADER_CRC, cb_crc32(0, header, HEADER_CRC));
}

bool cb_slot_read_report(const void *bytes, size_t size, struct cb_slot_report *report) {
    const uint8_t *const header = bytes;
    if (size < CB_SLOT_HEADER_BYTES || !header_is_whole(header)) return false;
    const uint32_t word = get_word(header + REPORT);
    const struct cb_slot_report read = {.baud = get_word(header + REPORT_BAUD),
                                        .status = (uint16_t)word,
                                        .unit = (uint8_t)(word >> 16),
                                        .parity = (uint8_t)(word >> 24 & 15),
                                        .stop_bits = (uint8_t)(word >> 28)};
    if (read.baud < CB_RTU_LEAST_BAUD || read.baud > CB_RTU_MOST_BAUD || read.unit < 1 ||
        read.unit > CB_RTU_LAST_UNIT || read.parity > CB_PARITY_ODD || read.stop_bits < 1 ||
        read.stop_bits > 2)
        return false;
    *report = read;
    return true;
}
