/* SPDX-License-Identifier: MIT
 * The console's line: text out, commands in. Never waits; a line without room is counted as
 * lost. */
#ifndef COMPBOX_HAL_STM32F405_CONSOLE_H
#define COMPBOX_HAL_STM32F405_CONSOLE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/stm32f405/text.h"

enum { CB_CONSOLE_BAUD = 115200, CB_CONSOLE_LINE = 40 };

struct cb_console {
    struct cb_text line; /* under construction */
    uint32_t lost;       /* lines */
    uint32_t have;       /* characters of the command being typed */
    char typed[CB_CONSOLE_LINE];
};

void cb_console_start(struct cb_console *console);

/* out: an empty line to fill */
struct cb_text *cb_console_line(struct cb_console *console);

/* Sends the line with its line end; a full one, which may be cut off, ends with "...". */
void cb_console_end(struct cb_console *console);

/* Sends a line of these words. */
void cb_console_say(struct cb_console *console, const char *words);

/* out: whether there is room for `lines` more lines of maximum length */
bool cb_console_has_room(uint32_t lines);

/* out: the next complete typed line, ended by 0; NULL when there is none. Valid until the next
 *      call. A damaged byte, or one behind lost bytes, is '?', also where it was a line end. */
const char *cb_console_take(struct cb_console *console);

#endif
