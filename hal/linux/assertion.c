/* SPDX-License-Identifier: MIT
 * A failed assertion in a Linux program: one line, then SIGABRT. */
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "firmware/base/assert.h"

/* The loop may be the one that fails: a reader of the log that does not read must not keep the
 * program alive with its heartbeat standing. */
static void report(const char *text, int length) {
    struct pollfd log = {.fd = STDERR_FILENO, .events = POLLOUT};
    if (poll(&log, 1, 0) != 1 || !(log.revents & POLLOUT)) return;
    if (write(STDERR_FILENO, text, (size_t)length) != length) return; /* nobody reads: it ends */
}

void cb_assertion_failed(const char *file, int line) {
    char text[200];
    const int length =
        snprintf(text, sizeof text,
                 "%s: assertion failed at %s:%d: the program has a mistake, please report it\n",
                 program_invocation_short_name, file, line);
    if (length > 0 && length < (int)sizeof text) report(text, length);
    abort();
}
