/* SPDX-License-Identifier: MIT
 * Texts inside JSON: quotes, escapes, UTF-8. Used by json.c. */
#ifndef COMPBOX_FIRMWARE_JSON_TEXT_H
#define COMPBOX_FIRMWARE_JSON_TEXT_H

#include <stdint.h>

/* in : text[*at] is the opening quote
 * out: NULL and *at behind the closing quote; or a sentence and *at at the wrong byte */
const char *cb_json_scan_string(const char *text, uint32_t length, uint32_t *at);

/* in : at < length
 * out: length in bytes of the control character at text[at]; 0 for any other character and for
 *      invalid UTF-8
 * Control characters are C0, DEL, C1, the line and paragraph separators and those that change the
 * direction of text: a terminal or a log would not show them as written. */
uint32_t cb_control_length(const char *text, uint32_t length, uint32_t at);

/* out: value of a hexadecimal digit; 16 for any other byte */
uint32_t cb_hex_digit(char c);

#endif
