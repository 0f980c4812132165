/* SPDX-License-Identifier: MIT
 * Text without stdio: a line built piece by piece. Excess text is cut off. */
#ifndef COMPBOX_HAL_STM32F405_TEXT_H
#define COMPBOX_HAL_STM32F405_TEXT_H

#include <stddef.h>
#include <stdint.h>

enum { CB_TEXT_BYTES = 512 };

struct cb_text {
    size_t length;
    char bytes[CB_TEXT_BYTES];
};

void cb_text_clear(struct cb_text *text);
void cb_text_put(struct cb_text *text, const char *words);
void cb_text_put_bytes(struct cb_text *text, const char *bytes, size_t size);
void cb_text_put_unsigned(struct cb_text *text, uint32_t number);
void cb_text_put_signed64(struct cb_text *text, int64_t number);

/* in : digits 1 … 8 */
void cb_text_put_hex(struct cb_text *text, uint32_t number, unsigned digits);

/* in : number in thousandths. out: as "12.345" with 1 … 3 decimals, the rest truncated */
void cb_text_put_thousandths(struct cb_text *text, int64_t number, unsigned decimals);

/* Writes the value's bits, which read back exactly. */
void cb_text_put_float_bits(struct cb_text *text, float number);

/* in : any value. out: rounded to a tenth, with its sign; "?" beyond 1e8 and for NaN */
void cb_text_put_tenths(struct cb_text *text, float number);

#endif
