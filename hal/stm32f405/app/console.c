/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/app/console.h"

#include <string.h>

#include "hal/stm32f405/usart.h"

static const char line_end[2] = {'\r', '\n'};

void cb_console_start(struct cb_console *console) {
    *console = (struct cb_console){.lost = 0};
    cb_usart_open(CB_USART_CONSOLE, CB_CONSOLE_BAUD, CB_USART_NONE, 1);
}

struct cb_text *cb_console_line(struct cb_console *console) {
    cb_text_clear(&console->line);
    return &console->line;
}

void cb_console_end(struct cb_console *console) {
    struct cb_text *line = &console->line;
    if (line->length == sizeof line->bytes) memcpy(line->bytes + line->length - 3, "...", 3);
    if (cb_usart_room(CB_USART_CONSOLE) < line->length + sizeof line_end) {
        ++console->lost;
        return;
    }
    (void)cb_usart_send(CB_USART_CONSOLE, line->bytes, line->length);
    (void)cb_usart_send(CB_USART_CONSOLE, line_end, sizeof line_end);
}

void cb_console_say(struct cb_console *console, const char *words) {
    cb_text_put(cb_console_line(console), words);
    cb_console_end(console);
}

bool cb_console_has_room(uint32_t lines) {
    return cb_usart_room(CB_USART_CONSOLE) >= lines * (CB_TEXT_BYTES + sizeof line_end);
}

const char *cb_console_take(struct cb_console *console) {
    struct cb_usart_byte one;
    while (cb_usart_take(CB_USART_CONSOLE, &one)) {
        const char typed = one.bad ? '?' : (char)one.byte; /* so that the line is no command */
        const bool ends = typed == '\r' || typed == '\n';
        if (!ends) {
            if (console->have < sizeof console->typed) /* the last place marks a line that is too
                                                          long */
                console->typed[console->have++] = typed;
            continue;
        }
        const uint32_t have = console->have;
        console->have = 0;
        if (have == 0 || have == sizeof console->typed) continue;
        console->typed[have] = 0;
        return console->typed;
    }
    return 0;
}
