/* SPDX-License-Identifier: MIT */
#ifndef COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H
#define COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H

#include <stddef.h>
#include <stdint.h>

/* Which exceptions the PLC answered since `told`, as the Modbus application protocol calls them:
 * "; exception 2 (illegal data address)" for each code behind what text holds already.
 * in : told[codes], now[codes]: replies counted by their code, 0 for codes that have no place
 * out: text, cut at size, ends with a zero */
void cb_add_exceptions(const uint32_t *told, const uint32_t *now, unsigned codes, char *text,
                       size_t size);

#endif
