/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/text.h"

#include <string.h>

void cb_text_clear(struct cb_text *text) {
    text->length = 0;
}

void cb_text_put_bytes(struct cb_text *text, const char *bytes, size_t size) {
    const size_t room = sizeof text->bytes - text->length;
    const size_t count = size < room ? size : room;
    memcpy(text->bytes + text->length, bytes, count);
    text->length += count;
}

void cb_text_put(struct cb_text *text, const char *words) {
    size_t size = 0;
    while (words[size] != 0) ++size;
    cb_text_put_bytes(text, words, size);
}

static void put_unsigned64(struct cb_text *text, uint64_t number) {
    char digits[20];
    size_t at = sizeof digits;
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    cb_text_put_bytes(text, digits + at, sizeof digits - at);
}

void cb_text_put_unsigned(struct cb_text *text, uint32_t number) {
    put_unsigned64(text, number);
}

void cb_text_put_signed64(struct cb_text *text, int64_t number) {
    if (number < 0) cb_text_put(text, "-");
    put_unsigned64(text, number < 0 ? 0 - (uint64_t)number : (uint64_t)number);
}

void cb_text_put_hex(struct cb_text *text, uint32_t number, unsigned digits) {
    static const char signs[] = "0123456789abcdef";
    for (unsigned i = digits; i-- > 0;) cb_text_put_bytes(text, &signs[number >> 4 * i & 15], 1);
}

void cb_text_put_thousandths(struct cb_text *text, int64_t number, unsigned decimals) {
    const uint64_t size = number < 0 ? 0 - (uint64_t)number : (uint64_t)number;
    const uint32_t rest = (uint32_t)(size % 1000);
    const char digits[3] = {(char)('0' + rest / 100), (char)('0' + rest / 10 % 10),
                            (char)('0' + rest % 10)};
    if (number < 0) cb_text_put(text, "-");
    put_unsigned64(text, size / 1000);
    cb_text_put(text, ".");
    cb_text_put_bytes(text, digits, decimals);
}

static uint32_t bits_of(float number) {
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

void cb_text_put_float_bits(struct cb_text *text, float number) {
    cb_text_put_hex(text, bits_of(number), 8);
}

void cb_text_put_tenths(struct cb_text *text, float number) {
    const float size = number < 0.0f ? -number : number;
    if (!(size < 1e8f)) {
        cb_text_put(text, "?");
        return;
    }
    cb_text_put(text, number < 0.0f ? "-" : "+");
    cb_text_put_thousandths(text, (int64_t)(size * 10.0f + 0.5f) * 100, 1);
}
