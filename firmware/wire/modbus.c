/* SPDX-License-Identifier: MIT */
#include "firmware/wire/modbus.h"

#include <stdbool.h>

enum {
    MAX_READ = 125,
    MAX_WRITE = 123,
    MAX_WRITE_READ = 121,
    EXCEPTION_BIT = 0x80,
};

/* Big-endian, as all of Modbus. out: the place behind the number. */
static uint8_t *put_u16(uint8_t *at, uint16_t value) {
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)(value & 0xFF);
    return at + 2;
}

static uint16_t get_u16(const uint8_t *at) {
    return (uint16_t)(at[0] << 8 | at[1]);
}

static bool within(uint16_t count, uint16_t max) {
    return count >= 1 && count <= max;
}

/* Writes byte count and registers, the tail of FC16 and FC23. */
static uint8_t *put_registers(uint8_t *at, const struct cb_modbus_request *request) {
    *at++ = (uint8_t)(2 * request->write_count);
    const uint16_t *const end = request->write_registers + request->write_count;
    for (const uint16_t *from = request->write_registers; from != end; ++from)
        at = put_u16(at, *from);
    return at;
}

static bool encodable(const struct cb_modbus_request *request) {
    switch (request->function) {
        case CB_MODBUS_READ:
            return within(request->read_count, MAX_READ);
        case CB_MODBUS_WRITE:
            return within(request->write_count, MAX_WRITE);
        case CB_MODBUS_WRITE_READ:
            return within(request->read_count, MAX_READ) &&
                   within(request->write_count, MAX_WRITE_READ);
        default:
            return false;
    }
}

struct cb_modbus_request cb_modbus_read(uint16_t start, uint16_t count) {
    return (struct cb_modbus_request){
        .function = CB_MODBUS_READ, .read_start = start, .read_count = count};
}

struct cb_modbus_request cb_modbus_write(uint16_t start, uint16_t count,
                                         const uint16_t *registers) {
    return (struct cb_modbus_request){.function = CB_MODBUS_WRITE,
                                      .write_start = start,
                                      .write_count = count,
                                      .write_registers = registers};
}

struct cb_modbus_request cb_modbus_write_read(uint16_t write_start, uint16_t write_count,
                                              const uint16_t *write_registers, uint16_t read_start,
                                              uint16_t read_count) {
    return (struct cb_modbus_request){.function = CB_MODBUS_WRITE_READ,
                                      .read_start = read_start,
                                      .read_count = read_count,
                                      .write_start = write_start,
                                      .write_count = write_count,
                                      .write_registers = write_registers};
}

size_t cb_modbus_encode(const struct cb_modbus_request *request, uint8_t *pdu) {
    if (!encodable(request)) return 0;
    uint8_t *at = pdu;
    *at++ = request->function;
    if (request->function != CB_MODBUS_WRITE) {
        at = put_u16(at, request->read_start);
        at = put_u16(at, request->read_count);
    }
    if (request->function != CB_MODBUS_READ) {
        at = put_u16(at, request->write_start);
        at = put_u16(at, request->write_count);
        at = put_registers(at, request);
    }
    return (size_t)(at - pdu);
}

/* FC16: the reply repeats start and count. */
static bool echo_matches(const struct cb_modbus_request *request, const uint8_t *pdu,
                         size_t length) {
    return length == 5 && get_u16(pdu + 1) == request->write_start &&
           get_u16(pdu + 3) == request->write_count;
}

/* FC3, FC23: the stated byte count, the frame's length and the requested count must agree. */
static bool data_matches(const struct cb_modbus_request *request, const uint8_t *pdu,
                         size_t length) {
    size_t bytes = (size_t)2 * request->read_count;
    return length == 2 + bytes && pdu[1] == bytes;
}

enum cb_modbus_answer cb_modbus_decode(const struct cb_modbus_request *request, const uint8_t *pdu,
                                       size_t length, uint16_t *registers, uint8_t *exception) {
    if (length == 2 && pdu[0] == (request->function | EXCEPTION_BIT)) {
        *exception = pdu[1];
        return CB_MODBUS_EXCEPTION;
    }
    if (length < 2 || pdu[0] != request->function) return CB_MODBUS_INVALID;
    if (request->function == CB_MODBUS_WRITE)
        return echo_matches(request, pdu, length) ? CB_MODBUS_OK : CB_MODBUS_INVALID;
    if (!data_matches(request, pdu, length)) return CB_MODBUS_INVALID;
    const uint16_t *const end = registers + request->read_count;
    for (pdu += 2; registers != end; pdu += 2) *registers++ = get_u16(pdu);
    return CB_MODBUS_OK;
}
