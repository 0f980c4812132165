/* SPDX-License-Identifier: MIT */
#include "hal/linux/stderr.h"

#include <poll.h>
#include <string.h>
#include <unistd.h>

bool cb_stderr_is_ready(void) {
    struct pollfd wait = {.fd = STDERR_FILENO, .events = POLLOUT};
    return poll(&wait, 1, 0) == 1 && (wait.revents & POLLOUT) != 0;
}

void cb_stderr_last_words(const char *text) {
    if (!cb_stderr_is_ready()) return;
    if (write(STDERR_FILENO, text, strlen(text)) < 0) return; /* no way is left to report it */
}
