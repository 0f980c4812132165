/* SPDX-License-Identifier: MIT
 * Times of a serial line: characters, frames, the silences between frames and whole exchanges. All
 * times in µs, rounded up; 32-bit arithmetic that cannot overflow in the ranges below. */
#ifndef COMPBOX_FIRMWARE_WIRE_RTU_LINE_H
#define COMPBOX_FIRMWARE_WIRE_RTU_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/modbus_rtu.h"

enum { CB_RTU_LEAST_BAUD = 1200, CB_RTU_MOST_BAUD = 921600 };

enum cb_parity { CB_PARITY_NONE, CB_PARITY_EVEN, CB_PARITY_ODD };

struct cb_rtu_line {
    uint32_t baud;     /* CB_RTU_LEAST_BAUD … CB_RTU_MOST_BAUD */
    uint8_t parity;    /* enum cb_parity */
    uint8_t stop_bits; /* 1 or 2 */
};

/* A serial line of the coefficient file. */
struct cb_serial_config {
    char device[64]; /* Linux: path of the device; a microcontroller uses its own port */
    struct cb_rtu_line line;
    uint32_t slave_delay_us; /* longest time of a slave from request to reply, beyond the 3.5
                                characters by which it detects the request's end */
    bool rs485;              /* Linux: RTS switches the driver of a two-wire line */
    uint8_t unit;            /* of the PLC; for a bus the signals name the modules */
};

/* Silences between and inside frames. */
struct cb_rtu_silence {
    uint32_t inside_us;  /* t1.5: longest inside a frame */
    uint32_t between_us; /* t3.5: shortest between two frames */
};

/* Bits of a character: start, eight of data, parity, stop. */
uint32_t cb_rtu_character_bits(const struct cb_rtu_line *line);

/* in : bytes <= CB_RTU_MAX_FRAME */
uint32_t cb_rtu_frame_us(const struct cb_rtu_line *line, size_t bytes);

/* 1.5 and 3.5 characters; above 19 200 baud 750 µs and 1.75 ms, as in the standard. */
struct cb_rtu_silence cb_rtu_silences(const struct cb_rtu_line *line);

/* Time from the silence before a request to the end of its reply: silence, request, silence by
 * which the slave detects the end of the request, the slave's own delay, reply. */
uint32_t cb_rtu_exchange_us(const struct cb_rtu_line *line, const struct cb_modbus_request *request,
                            uint32_t slave_delay_us);

#endif
