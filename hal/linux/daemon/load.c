/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/load.h"

#include <stdio.h>
#include <sys/stat.h>

#include "firmware/base/crc32.h"
#include "firmware/config/config.h"
#include "firmware/load/load.h"
#include "hal/linux/enrolled.h"
#include "hal/linux/whole_file.h"

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

/* Judges the signature of these bytes. out: false: refused, with the sentence */
static bool is_trusted(const char *path, const char *text, size_t length, const char *keys,
                       struct cb_loaded *loaded) {
#if CB_HAS_LIBSODIUM
    if (keys == NULL) return true;
    const enum cb_enrolled verdict =
        cb_enrolled_judge(keys, path, text, length, loaded->message, sizeof loaded->message);
    loaded->is_signed = verdict == CB_ENROLLED_SIGNED;
    return verdict != CB_ENROLLED_REFUSED;
#else
    (void)path, (void)text, (void)length, (void)keys, (void)loaded; /* options.c refuses --keys */
    return true;
#endif
}

bool cb_load_file(struct cb_config *config, const char *path, const struct cb_site *site,
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
    const long length = cb_whole_file_read(path, text, sizeof text, &there, &why);
    if (length < 0) {
        snprintf(loaded->message, sizeof loaded->message, "%s: cannot be read: %s", path, why);
        return false;
    }
    loaded->facts = facts_of(text, (size_t)length, &there);
    if (!is_trusted(path, text, (size_t)length, site->keys, loaded)) return false;
    if (cb_config_load(config, text, (size_t)length, &target, &scratch, &message) != CB_OK) {
        describe(path, &message, loaded->message, sizeof loaded->message);
        return false;
    }
    loaded->facts.revision = config->revision;
    loaded->lowered = cb_ceiling_apply(config, &site->ceiling);
    return true;
}
