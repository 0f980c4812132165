/* SPDX-License-Identifier: MIT
 * Modbus exceptions and counters in the log. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H
#define COMPBOX_HAL_LINUX_DAEMON_EXCEPTION_WORDS_H

#include <stddef.h>
#include <stdint.h>

/* Names the new exceptions in the terms of the Modbus application protocol:
 * appends "; exception 2 (illegal data address)" to text for each code.
 * in : before[codes], now[codes]: exceptions by code; 0: all others
 * out: text, truncated to size, terminated by 0 */
void cb_add_exceptions(const uint32_t *before, const uint32_t *now, unsigned codes, char *text,
                       size_t size);

/* Appends ", late replies: 2" to text[size] for the counter late_replies; nothing for a count of 0.
 */
void cb_add_counter(const char *name, uint32_t count, char *text, size_t size);

#endif
