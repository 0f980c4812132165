/* SPDX-License-Identifier: MIT
 * A failed assertion in a Linux program: one line, then SIGABRT. The loop may be the one that
 * fails: a blocked reader of the log must not keep the program alive without its heartbeat. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "firmware/base/assert.h"
#include "hal/linux/stderr.h"

void cb_assertion_failed(const char *file, int line) {
    char text[200];
    snprintf(text, sizeof text,
             "%s: assertion failed at %s:%d: the program has a mistake, please report it\n",
             program_invocation_short_name, file, line);
    cb_stderr_last_words(text);
    abort();
}
