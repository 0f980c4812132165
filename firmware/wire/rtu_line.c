/* SPDX-License-Identifier: MIT */
#include "firmware/wire/rtu_line.h"

enum { SHORT_SILENCES_ABOVE_BAUD = 19200, SHORT_INSIDE_US = 750, SHORT_BETWEEN_US = 1750 };

/* 256 characters of 12 bits: 3.1e9 < 2^32 bit·µs */
_Static_assert(UINT64_C(1000000) * CB_RTU_MAX_FRAME * 12 < UINT32_MAX, "frame time fits 32 bits");

uint32_t cb_rtu_character_bits(const struct cb_rtu_line *line) {
    return 9u + (line->parity != CB_PARITY_NONE) + line->stop_bits;
}

/* in : bits < 4 294 */
static uint32_t bits_us(const struct cb_rtu_line *line, uint32_t bits) {
    return (bits * 1000000u + line->baud - 1) / line->baud;
}

uint32_t cb_rtu_frame_us(const struct cb_rtu_line *line, size_t bytes) {
    return bits_us(line, (uint32_t)bytes * cb_rtu_character_bits(line));
}

struct cb_rtu_silence cb_rtu_silences(const struct cb_rtu_line *line) {
    const uint32_t bits = cb_rtu_character_bits(line);
    if (line->baud > SHORT_SILENCES_ABOVE_BAUD)
        return (struct cb_rtu_silence){SHORT_INSIDE_US, SHORT_BETWEEN_US};
    return (struct cb_rtu_silence){(bits_us(line, 3 * bits) + 1) / 2,
                                   (bits_us(line, 7 * bits) + 1) / 2};
}

uint32_t cb_rtu_exchange_us(const struct cb_rtu_line *line, const struct cb_modbus_request *request,
                            uint32_t slave_delay_us) {
    return 2 * cb_rtu_silences(line).between_us + slave_delay_us +
           cb_rtu_frame_us(line, cb_rtu_request_bytes(request)) +
           cb_rtu_frame_us(line, cb_rtu_reply_bytes(request));
}
