/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/load.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/config_load.h"

/* in : fd of a regular file
 * out: bytes read, at most `size`; -1 with errno */
static long read_all(int fd, char *text, size_t size) {
    size_t length = 0;
    while (length < size) {
        const ssize_t got = read(fd, text + length, size - length);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return -1;
        if (got == 0) break;
        length += (size_t)got;
    }
    return (long)length;
}

/* out: bytes read, up to one more than a coefficient file may have; -1 and *why when it cannot be
 * read. A pipe would wait for its writer, hence O_NONBLOCK, which a regular file ignores. */
static long read_bytes(const char *path, char *text, size_t size, const char **why) {
    struct stat there;
    long length = -1;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd < 0 || fstat(fd, &there) != 0) {
        *why = strerror(errno);
    } else if (S_ISDIR(there.st_mode)) {
        *why = strerror(EISDIR);
    } else if (!S_ISREG(there.st_mode)) {
        *why = "it is not a regular file; put the coefficient file itself there";
    } else {
        length = read_all(fd, text, size);
        if (length < 0) *why = strerror(errno);
    }
    if (fd >= 0) close(fd);
    return length;
}

static void say(const char *path, const struct cb_message *message, char *said, size_t size) {
    if (message->line > 0)
        snprintf(said, size, "%s: %s, line %u, column %u", path, message->text,
                 (unsigned)message->line, (unsigned)message->column);
    else
        snprintf(said, size, "%s: %s", path, message->text);
}

bool cb_load_file(struct cb_config *config, const char *path, char *said, size_t size) {
    static char text[CB_MAX_TEXT_BYTES + 1];
    static struct cb_load_scratch scratch;
    static const struct cb_target target = {
        .name = "compboxd",
        .sources = 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN | 1u << CB_SOURCE_BUS,
        .transports = 1u << CB_TRANSPORT_TCP | 1u << CB_TRANSPORT_RTU};
    const char *why = "";
    const long length = read_bytes(path, text, sizeof text, &why);
    if (length < 0) {
        snprintf(said, size, "%s: cannot be read: %s", path, why);
        return false;
    }
    struct cb_message message = {.line = 0};
    if (cb_config_load(config, text, (size_t)length, &target, &scratch, &message) == CB_OK)
        return true;
    say(path, &message, said, size);
    return false;
}
