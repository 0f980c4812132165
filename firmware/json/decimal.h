/* SPDX-License-Identifier: MIT
 * Decimal text to numbers in integer arithmetic: the same bits on every target. */
#ifndef COMPBOX_FIRMWARE_JSON_DECIMAL_H
#define COMPBOX_FIRMWARE_JSON_DECIMAL_H

#include <stdbool.h>
#include <stdint.h>

/* in : text[length], a number in the grammar of JSON; length < 10^8, any number of digits
 * out: true and the float32 nearest to it, ties to even, subnormals and -0 included; false, *value
 *      unchanged, when it rounds to infinity
 * Time linear in length, about 300 bytes of stack. */
bool cb_decimal_to_float(const char *text, uint32_t length, float *value);

/* in : text[length]
 * out: true and its value if it has only digits and fits; false, *value unchanged */
bool cb_decimal_to_uint32(const char *text, uint32_t length, uint32_t *value);

#endif
