/* SPDX-License-Identifier: MIT */
#include "firmware/modbus_rtu.h"

/* The polynomial 0xA001 after four bits, by what leaves the register. */
static const uint16_t CRC_OF_NIBBLE[16] = {
    0x0000, 0xCC01, 0xD801, 0x1400, 0xF001, 0x3C00, 0x2800, 0xE401,
    0xA001, 0x6C00, 0x7800, 0xB401, 0x5000, 0x9C01, 0x8801, 0x4400,
};

uint16_t cb_rtu_crc(const uint8_t *bytes, size_t count) {
    uint32_t crc = 0xFFFF;
    for (size_t i = 0; i < count; ++i) {
        crc ^= bytes[i];
        crc = crc >> 4 ^ CRC_OF_NIBBLE[crc & 15];
        crc = crc >> 4 ^ CRC_OF_NIBBLE[crc & 15];
    }
    return (uint16_t)crc;
}

size_t cb_rtu_encode(uint8_t unit, const struct cb_modbus_request *request, uint8_t *frame) {
    if (unit < 1 || unit > CB_RTU_LAST_UNIT) return 0;
    const size_t pdu = cb_modbus_encode(request, frame + 1);
    if (pdu == 0) return 0;
    frame[0] = unit;
    const uint16_t crc = cb_rtu_crc(frame, 1 + pdu);
    frame[1 + pdu] = (uint8_t)(crc & 0xFF); /* the only little-endian number of Modbus */
    frame[2 + pdu] = (uint8_t)(crc >> 8);
    return pdu + CB_RTU_OVERHEAD;
}

size_t cb_rtu_request_bytes(const struct cb_modbus_request *request) {
    const size_t written = (size_t)2 * request->write_count;
    switch (request->function) {
        case CB_MODBUS_WRITE:
            return CB_RTU_OVERHEAD + 6 + written;
        case CB_MODBUS_WRITE_READ:
            return CB_RTU_OVERHEAD + 10 + written;
        default:
            return CB_RTU_OVERHEAD + 5;
    }
}

size_t cb_rtu_reply_bytes(const struct cb_modbus_request *request) {
    if (request->function == CB_MODBUS_WRITE) return CB_RTU_OVERHEAD + 5;
    return CB_RTU_OVERHEAD + 2 + (size_t)2 * request->read_count;
}

enum cb_rtu_answer cb_rtu_check(uint8_t unit, const uint8_t *frame, size_t length) {
    if (length < CB_RTU_MIN_FRAME || length > CB_RTU_MAX_FRAME) return CB_RTU_LENGTH;
    const uint16_t crc = (uint16_t)(frame[length - 2] | frame[length - 1] << 8);
    if (cb_rtu_crc(frame, length - 2) != crc) return CB_RTU_CRC;
    return frame[0] == unit ? CB_RTU_OK : CB_RTU_UNIT;
}

enum cb_rtu_answer cb_rtu_decode(uint8_t unit, const struct cb_modbus_request *request,
                                 const uint8_t *frame, size_t length, uint16_t *registers,
                                 uint8_t *exception) {
    const enum cb_rtu_answer checked = cb_rtu_check(unit, frame, length);
    if (checked != CB_RTU_OK) return checked;
    switch (cb_modbus_decode(request, frame + 1, length - CB_RTU_OVERHEAD, registers, exception)) {
        case CB_MODBUS_OK:
            return CB_RTU_OK;
        case CB_MODBUS_EXCEPTION:
            return CB_RTU_EXCEPTION;
        case CB_MODBUS_INVALID:
            break;
    }
    return CB_RTU_INVALID;
}
