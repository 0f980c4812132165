/* SPDX-License-Identifier: MIT
 * Modbus requests and replies as bytes: the part that TCP and RTU share (function code and data,
 * without address, transaction id or checksum). No I/O, no state, every length checked before a
 * byte is copied. Written after the Modbus application protocol specification 1.1b3. */
#ifndef COMPBOX_FIRMWARE_WIRE_MODBUS_H
#define COMPBOX_FIRMWARE_WIRE_MODBUS_H

#include <stddef.h>
#include <stdint.h>

enum {
    CB_MODBUS_MAX_PDU = 253,
    CB_MODBUS_READ = 3,             /* read holding registers */
    CB_MODBUS_WRITE = 16,           /* write multiple registers */
    CB_MODBUS_WRITE_READ = 23,      /* write, then read, in one request */
    CB_MODBUS_ILLEGAL_FUNCTION = 1, /* exception: the server does not have the function */
};

/* A request. Fields that the function does not use are ignored. */
struct cb_modbus_request {
    uint8_t function;
    uint16_t read_start, read_count;   /* FC3, FC23: 1 … 125 registers */
    uint16_t write_start, write_count; /* FC16: 1 … 123, FC23: 1 … 121 registers */
    const uint16_t *write_registers;
};

/* The three kinds of request; the registers must stay valid until the request is encoded. */
struct cb_modbus_request cb_modbus_read(uint16_t start, uint16_t count);
struct cb_modbus_request cb_modbus_write(uint16_t start, uint16_t count, const uint16_t *registers);
struct cb_modbus_request cb_modbus_write_read(uint16_t write_start, uint16_t write_count,
                                              const uint16_t *write_registers, uint16_t read_start,
                                              uint16_t read_count);

/* Relation of a reply to its request. */
enum cb_modbus_answer {
    CB_MODBUS_OK,        /* valid reply */
    CB_MODBUS_EXCEPTION, /* well-formed refusal */
    CB_MODBUS_INVALID,   /* other function, wrong length, or mismatching echo */
};

/* in : request; pdu[CB_MODBUS_MAX_PDU]
 * out: number of bytes written to pdu, 0 when the request is outside the ranges above */
size_t cb_modbus_encode(const struct cb_modbus_request *request, uint8_t *pdu);

/* in : the request that was sent; the reply's bytes pdu[length], any content and length
 * out: registers[read_count] only for CB_MODBUS_OK of FC3 and FC23, else unchanged;
 *      *exception only for CB_MODBUS_EXCEPTION, else unchanged */
enum cb_modbus_answer cb_modbus_decode(const struct cb_modbus_request *request, const uint8_t *pdu,
                                       size_t length, uint16_t *registers, uint8_t *exception);

#endif
