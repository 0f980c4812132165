/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/load.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "firmware/config_load.h"

/* out: bytes read, up to one more than a coefficient file may have; -1 with errno when it cannot
 * be read. */
static long read_bytes(const char *path, char *text, size_t size) {
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return -1;
    size_t length = fread(text, 1, size, file);
    int error = ferror(file) ? errno : 0;
    fclose(file);
    errno = error;
    return error != 0 ? -1 : (long)length;
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
    long length = read_bytes(path, text, sizeof text);
    if (length < 0) {
        snprintf(said, size, "%s: cannot be read: %s", path, strerror(errno));
        return false;
    }
    struct cb_message message = {.line = 0};
    if (cb_config_load(config, text, (size_t)length, &target, &scratch, &message) == CB_OK)
        return true;
    say(path, &message, said, size);
    return false;
}
