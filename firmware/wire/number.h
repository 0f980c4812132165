/* SPDX-License-Identifier: MIT
 * Numbers in Modbus registers: the codec of every enum cb_number_type. No I/O, no state. */
#ifndef COMPBOX_FIRMWARE_WIRE_NUMBER_H
#define COMPBOX_FIRMWARE_WIRE_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/* Representation of a number in registers or in a bus frame. Multi-register values are big-endian
 * (ABCD) unless the type states otherwise; "le" is little-endian (DCBA), "cdab" has the words
 * swapped. */
enum cb_number_type {
    CB_NUMBER_UINT16,
    CB_NUMBER_INT16,
    CB_NUMBER_UINT32,
    CB_NUMBER_INT32,
    CB_NUMBER_FLOAT32,
    CB_NUMBER_UINT32_CDAB,
    CB_NUMBER_INT32_CDAB,
    CB_NUMBER_FLOAT32_CDAB,
    CB_NUMBER_UINT16_LE,
    CB_NUMBER_INT16_LE,
    CB_NUMBER_UINT32_LE,
    CB_NUMBER_INT32_LE,
    CB_NUMBER_FLOAT32_LE,
    CB_NUMBER_UINT8, /* one byte of a bus frame, never a register */
    CB_NUMBER_INT8,
};

/* Number of registers of a value of this type: 1 or 2. */
unsigned cb_number_registers(enum cb_number_type type);

/* Number of its bytes in a bus frame: 1, 2 or 4. */
unsigned cb_number_bytes(enum cb_number_type type);

/* Largest and smallest float32 that the type can represent (a uint32 ends at 4 294 967 040, the
 * float below 2^32). */
struct cb_range {
    float min, max;
};
struct cb_range cb_number_range(enum cb_number_type type);

/* true for every type but float32 in its three orders. */
static inline bool cb_number_is_integer(enum cb_number_type type) {
    return type != CB_NUMBER_FLOAT32 && type != CB_NUMBER_FLOAT32_CDAB &&
           type != CB_NUMBER_FLOAT32_LE;
}

/* in : r[cb_number_registers(type)], registers in the order of reception
 * out: the number; integers beyond 2^24 rounded to the nearest float32; a float32 register
 *      unchanged, NaN and infinities included: the caller checks it */
float cb_number_decode(enum cb_number_type type, const uint16_t *r);

/* in : registers[cb_number_registers(type)]
 * out: true and the number in the registers, integers rounded half away from zero; false, registers
 *      unchanged, when it is NaN or out of range */
bool cb_number_encode(enum cb_number_type type, float number, uint16_t *registers);

/* The number from cb_number_bytes() bytes of a bus frame, in the order of the type. A register is
 * sent high byte first. */
float cb_number_decode_bytes(enum cb_number_type type, const uint8_t *bytes);

/* Nearest integer, halves away from zero. in: |x| < 2^31. */
static inline int32_t cb_round(float x) {
    const int32_t whole = (int32_t)x;
    const float rest = x - (float)whole; /* exact: |rest| < 1 */
    return whole + (rest >= 0.5f ? 1 : 0) - (rest <= -0.5f ? 1 : 0);
}

#endif
