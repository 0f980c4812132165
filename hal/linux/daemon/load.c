/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/load.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/base/crc32.h"
#include "firmware/config/config.h"
#include "firmware/load/load.h"

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

/* out: bytes read, up to one more than a coefficient file may have, and *there of the file; -1 and
 *      *why when it cannot be read. O_NONBLOCK, which a regular file ignores, because a pipe would
 * wait for its writer. */
static long read_bytes(const char *path, char *text, size_t size, struct stat *there,
                       const char **why) {
    long length = -1;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd < 0 || fstat(fd, there) != 0) {
        *why = strerror(errno);
    } else if (S_ISDIR(there->st_mode)) {
        *why = strerror(EISDIR);
    } else if (!S_ISREG(there->st_mode)) {
        *why = "it is not a regular file; put the coefficient file itself there";
    } else {
        length = read_all(fd, text, size);
        if (length < 0) *why = strerror(errno);
    }
    if (fd >= 0) close(fd);
    return length;
}

static struct cb_file_facts facts_of(const char *text, size_t length, const struct stat *there) {
    struct cb_file_facts facts = {.was_read = true,
                                  .crc32 = cb_crc32(0, text, length),
                                  .owner = there->st_uid,
                                  .modified_unix_us = (int64_t)there->st_mtim.tv_sec * 1000000 +
                                                      there->st_mtim.tv_nsec / 1000};
    cb_sha256(text, length, facts.sha256);
    return facts;
}

static void describe(const char *path, const struct cb_message *message, char *text, size_t size) {
    if (message->line > 0)
        snprintf(text, size, "%s: %s, line %u, column %u", path, message->text,
                 (unsigned)message->line, (unsigned)message->column);
    else
        snprintf(text, size, "%s: %s", path, message->text);
}

bool cb_load_file(struct cb_config *config, const char *path, const struct cb_ceiling *ceiling,
                  struct cb_loaded *loaded) {
    static char text[CB_MAX_TEXT_BYTES + 1];
    static struct cb_load_scratch scratch;
    static const struct cb_target target = {
        .name = "compboxd",
        .sources =
            1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN | 1u << CB_SOURCE_BUS | 1u << CB_SOURCE_HAND,
        .transports = 1u << CB_TRANSPORT_TCP | 1u << CB_TRANSPORT_RTU,
        .lacks = CB_HAS_LIBMODBUS ? 0 : 1u << CB_CLIENT_LIBMODBUS};
    const char *why = "";
    struct stat there;
    struct cb_message message = {.line = 0};
    *loaded = (struct cb_loaded){.lowered = 0};
    const long length = read_bytes(path, text, sizeof text, &there, &why);
    if (length < 0) {
        snprintf(loaded->message, sizeof loaded->message, "%s: cannot be read: %s", path, why);
        return false;
    }
    loaded->facts = facts_of(text, (size_t)length, &there);
    if (cb_config_load(config, text, (size_t)length, &target, &scratch, &message) != CB_OK) {
        describe(path, &message, loaded->message, sizeof loaded->message);
        return false;
    }
    loaded->facts.revision = config->revision;
    loaded->lowered = cb_ceiling_apply(config, ceiling);
    return true;
}
