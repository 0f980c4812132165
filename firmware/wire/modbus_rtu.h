/* SPDX-License-Identifier: MIT
 * Modbus RTU frames: unit id, the PDU of modbus.h, CRC-16. No I/O, no state, every length checked
 * before a byte is copied. Written after "Modbus over serial line" 1.02.
 *
 * RTU has no transaction id. The owner of the wire assigns a reply to its request (rtu_receiver.h
 * takes a reply from the received bytes). */
#ifndef COMPBOX_FIRMWARE_WIRE_MODBUS_RTU_H
#define COMPBOX_FIRMWARE_WIRE_MODBUS_RTU_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/wire/modbus.h"

enum {
    CB_RTU_MAX_FRAME = 256, /* unit id, PDU, CRC */
    CB_RTU_OVERHEAD = 3,    /* all bytes except the PDU */
    CB_RTU_MIN_FRAME = 4,   /* unit id, function, CRC */
    CB_RTU_EXCEPTION_FRAME = 5,
    CB_RTU_LAST_UNIT = 247, /* 1 … 247; 0 is broadcast and gets no reply */
};

/* Relation of a frame to its request: the first that applies. */
enum cb_rtu_answer {
    CB_RTU_OK,        /* valid reply */
    CB_RTU_EXCEPTION, /* well-formed refusal */
    CB_RTU_LENGTH,    /* too short or too long for any frame */
    CB_RTU_CRC,       /* the check sum does not match */
    CB_RTU_UNIT,      /* from another module */
    CB_RTU_INVALID,   /* other function, other count than requested, mismatching echo */
};

/* CRC-16 of Modbus (0x8005 reflected: 0xA001, start 0xFFFF). */
uint16_t cb_rtu_crc(const uint8_t *bytes, size_t count);

/* in : unit 1 … 247; frame[CB_RTU_MAX_FRAME]
 * out: number of bytes written to frame; 0 when unit or request is out of range (modbus.h) */
size_t cb_rtu_encode(uint8_t unit, const struct cb_modbus_request *request, uint8_t *frame);

/* Length in bytes of the whole frames: of a request that cb_rtu_encode accepts, and of its reply if
 * it is no exception. */
size_t cb_rtu_request_bytes(const struct cb_modbus_request *request);
size_t cb_rtu_reply_bytes(const struct cb_modbus_request *request);

/* in : frame[length], any content and length
 * out: CB_RTU_OK, _LENGTH, _CRC or _UNIT: the checks that do not need the request */
enum cb_rtu_answer cb_rtu_check(uint8_t unit, const uint8_t *frame, size_t length);

/* in : the request that was sent; a frame for which cb_rtu_check gave CB_RTU_OK
 * out: CB_RTU_OK, _EXCEPTION or _INVALID; registers and *exception as cb_modbus_decode */
enum cb_rtu_answer cb_rtu_decode_sound(const struct cb_modbus_request *request,
                                       const uint8_t *frame, size_t length, uint16_t *registers,
                                       uint8_t *exception);

#endif
