/* SPDX-License-Identifier: MIT
 * stderr, whose reader may have stopped: none of these calls waits for it. */
#ifndef COMPBOX_HAL_LINUX_STDERR_H
#define COMPBOX_HAL_LINUX_STDERR_H

#include <stdbool.h>

/* out: whether stderr takes a line without a wait */
bool cb_stderr_is_ready(void);

/* The last sentence of a program that ends, also where another thread holds the lock of stderr; no
 * sentence if that is not ready. */
void cb_stderr_last_words(const char *text);

#endif
