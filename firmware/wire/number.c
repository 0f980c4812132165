/* SPDX-License-Identifier: MIT */
#include "firmware/wire/number.h"

#include <string.h>

#include "models/num.h"

/* Kind of the value, independent of its byte order. */
enum kind { KIND_UINT8, KIND_INT8, KIND_UINT16, KIND_INT16, KIND_UINT32, KIND_INT32, KIND_FLOAT32 };

/* Order of the two registers of a 32-bit value, and of the two bytes of each. */
enum order { ORDER_ABCD, ORDER_CDAB, ORDER_DCBA };

struct layout {
    enum kind kind;
    enum order order;
};

/* out: kind and register order of a type; an unknown type counts as CB_NUMBER_UINT16 */
static struct layout layout_of(enum cb_number_type type) {
    static const struct layout layouts[] = {
        [CB_NUMBER_UINT16] = {KIND_UINT16, ORDER_ABCD},
        [CB_NUMBER_INT16] = {KIND_INT16, ORDER_ABCD},
        [CB_NUMBER_UINT32] = {KIND_UINT32, ORDER_ABCD},
        [CB_NUMBER_INT32] = {KIND_INT32, ORDER_ABCD},
        [CB_NUMBER_FLOAT32] = {KIND_FLOAT32, ORDER_ABCD},
        [CB_NUMBER_UINT32_CDAB] = {KIND_UINT32, ORDER_CDAB},
        [CB_NUMBER_INT32_CDAB] = {KIND_INT32, ORDER_CDAB},
        [CB_NUMBER_FLOAT32_CDAB] = {KIND_FLOAT32, ORDER_CDAB},
        [CB_NUMBER_UINT16_LE] = {KIND_UINT16, ORDER_DCBA},
        [CB_NUMBER_INT16_LE] = {KIND_INT16, ORDER_DCBA},
        [CB_NUMBER_UINT32_LE] = {KIND_UINT32, ORDER_DCBA},
        [CB_NUMBER_INT32_LE] = {KIND_INT32, ORDER_DCBA},
        [CB_NUMBER_FLOAT32_LE] = {KIND_FLOAT32, ORDER_DCBA},
        [CB_NUMBER_UINT8] = {KIND_UINT8, ORDER_ABCD},
        [CB_NUMBER_INT8] = {KIND_INT8, ORDER_ABCD},
    };
    const unsigned known = sizeof layouts / sizeof layouts[0];
    return layouts[(unsigned)type < known ? (unsigned)type : CB_NUMBER_UINT16];
}

static bool is_wide(enum kind kind) {
    return kind == KIND_UINT32 || kind == KIND_INT32 || kind == KIND_FLOAT32;
}

unsigned cb_number_registers(enum cb_number_type type) {
    return is_wide(layout_of(type).kind) ? 2 : 1;
}

unsigned cb_number_bytes(enum cb_number_type type) {
    const enum kind kind = layout_of(type).kind;
    if (kind == KIND_UINT8 || kind == KIND_INT8) return 1;
    return is_wide(kind) ? 4 : 2;
}

/* As number.h; an integer's ends are exact except the upper end of 32 bits, the largest float below
 * it. */
struct cb_range cb_number_range(enum cb_number_type type) {
    switch (layout_of(type).kind) {
        case KIND_UINT8:
            return (struct cb_range){0.0f, 255.0f};
        case KIND_INT8:
            return (struct cb_range){-128.0f, 127.0f};
        case KIND_UINT16:
            return (struct cb_range){0.0f, 65535.0f};
        case KIND_INT16:
            return (struct cb_range){-32768.0f, 32767.0f};
        case KIND_UINT32:
            return (struct cb_range){0.0f, 4294967040.0f};
        case KIND_INT32:
            return (struct cb_range){-2147483648.0f, 2147483520.0f};
        case KIND_FLOAT32:
            break;
    }
    return (struct cb_range){-FLT_MAX, FLT_MAX};
}

static uint16_t swap_bytes(uint16_t word) {
    return (uint16_t)((word << 8) | (word >> 8));
}

/* Writes the bits of a value to the registers in the layout's order. */
static void scatter(struct layout layout, uint32_t bits, uint16_t *registers) {
    const uint16_t high = (uint16_t)(bits >> 16), low = (uint16_t)bits;
    if (!is_wide(layout.kind)) {
        registers[0] = layout.order == ORDER_DCBA ? swap_bytes(low) : low;
        return;
    }
    const bool high_first = layout.order == ORDER_ABCD;
    registers[0] = high_first ? high : low;
    registers[1] = high_first ? low : high;
    if (layout.order == ORDER_DCBA) {
        registers[0] = swap_bytes(registers[0]);
        registers[1] = swap_bytes(registers[1]);
    }
}

/* Two's complement without a cast whose result is implementation-defined. */
static inline float signed_16(uint16_t bits) {
    return (float)((int32_t)(bits ^ 0x8000u) - 0x8000);
}

static inline float signed_32(uint32_t bits) {
    if (!(bits & 0x80000000u)) return (float)(int32_t)bits;
    return (float)((int32_t)(bits & 0x7FFFFFFFu) - INT32_MAX - 1);
}

static inline uint32_t wide(uint16_t high, uint16_t low) {
    return (uint32_t)high << 16 | low;
}

float cb_number_decode(enum cb_number_type type, const uint16_t *r) {
    switch (type) {
        case CB_NUMBER_UINT16:
            return (float)r[0];
        case CB_NUMBER_INT16:
            return signed_16(r[0]);
        case CB_NUMBER_UINT32:
            return (float)wide(r[0], r[1]);
        case CB_NUMBER_INT32:
            return signed_32(wide(r[0], r[1]));
        case CB_NUMBER_FLOAT32:
            return cb_float_of(wide(r[0], r[1]));
        case CB_NUMBER_UINT32_CDAB:
            return (float)wide(r[1], r[0]);
        case CB_NUMBER_INT32_CDAB:
            return signed_32(wide(r[1], r[0]));
        case CB_NUMBER_FLOAT32_CDAB:
            return cb_float_of(wide(r[1], r[0]));
        case CB_NUMBER_UINT16_LE:
            return (float)swap_bytes(r[0]);
        case CB_NUMBER_INT16_LE:
            return signed_16(swap_bytes(r[0]));
        case CB_NUMBER_UINT32_LE:
            return (float)wide(swap_bytes(r[1]), swap_bytes(r[0]));
        case CB_NUMBER_INT32_LE:
            return signed_32(wide(swap_bytes(r[1]), swap_bytes(r[0])));
        case CB_NUMBER_FLOAT32_LE:
            return cb_float_of(wide(swap_bytes(r[1]), swap_bytes(r[0])));
        case CB_NUMBER_UINT8:
            return (float)(r[0] & 0xFF);
        case CB_NUMBER_INT8:
            return (float)(((r[0] & 0xFF) ^ 0x80) - 0x80);
    }
    return 0.0f;
}

bool cb_number_encode(enum cb_number_type type, float number, uint16_t *registers) {
    const struct layout layout = layout_of(type);
    const struct cb_range range = cb_number_range(type);
    uint32_t bits = 0;
    if (!(number >= range.min && number <= range.max)) return false;
    switch (layout.kind) {
        case KIND_FLOAT32:
            memcpy(&bits, &number, sizeof bits);
            break;
        case KIND_UINT32:
            /* from 2^24 a float is whole, and (float)whole + 0.5 below */
            bits = number >= 16777216.0f ? (uint32_t)number : (uint32_t)cb_round(number);
            break;
        case KIND_UINT8:
        case KIND_INT8:
            bits = (uint32_t)cb_round(number) & 0xFFu;
            break;
        case KIND_UINT16:
        case KIND_INT16:
        case KIND_INT32:
            bits = (uint32_t)cb_round(number);
            break;
    }
    scatter(layout, bits, registers);
    return true;
}

float cb_number_decode_bytes(enum cb_number_type type, const uint8_t *bytes) {
    uint16_t registers[2] = {bytes[0], 0};
    if (cb_number_bytes(type) == 1) return cb_number_decode(type, registers);
    for (unsigned i = 0; i < cb_number_registers(type); ++i)
        registers[i] = (uint16_t)((bytes[2 * i] << 8) | bytes[2 * i + 1]);
    return cb_number_decode(type, registers);
}
