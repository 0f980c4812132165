/* SPDX-License-Identifier: MIT */
#ifndef COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H
#define COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H

#include <stddef.h>
#include <stdint.h>

/* Names the exceptions that came since `logged`, in the terms of the Modbus application protocol:
 * appends "; exception 2 (illegal data address)" to text for each code.
 * in : logged[codes], now[codes]: replies counted by code, 0 for codes without a place
 * out: text, cut at size, ended by 0 */
void cb_add_exceptions(const uint32_t *logged, const uint32_t *now, unsigned codes, char *text,
                       size_t size);

#endif
