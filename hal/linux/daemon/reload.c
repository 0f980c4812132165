/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/reload.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/daemon/widening.h"
#include "hal/linux/enrolled.h"
#include "hal/linux/file_version.h"
#include "hal/linux/files/ceiling_words.h"

static __attribute__((format(printf, 2, 3))) void report(struct cb_reload *reload,
                                                         const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reload->last, sizeof reload->last, format, arguments);
    va_end(arguments);
}

/* A file that is missing for a moment, during its replacement, counts as unchanged. A missing
 * signature does not. */
static void look(const struct cb_reload *reload, struct cb_reload_look *now) {
    char signature[4300];
    if (stat(reload->path, &now->file) != 0) now->file = reload->known.file;
    snprintf(signature, sizeof signature, "%s" CB_SIGNATURE_SUFFIX, reload->path);
    if (reload->site.keys == NULL || stat(signature, &now->signature) != 0)
        now->signature = (struct stat){.st_size = 0};
}

static bool is_same_look(const struct cb_reload_look *a, const struct cb_reload_look *b) {
    return cb_same_version(&a->file, &b->file) && cb_same_version(&a->signature, &b->signature);
}

void cb_reload_start(struct cb_reload *reload, const char *path, const struct cb_site *site) {
    *reload = (struct cb_reload){.path = path, .site = *site};
    look(reload, &reload->known);
    reload->seen = reload->known;
}

bool cb_reload_file_changed(struct cb_reload *reload, int64_t now_us) {
    struct cb_reload_look now;
    if (now_us - reload->looked_us < CB_RELOAD_LOOK_US) return false;
    reload->looked_us = now_us;
    look(reload, &now);
    const bool stays = is_same_look(&now, &reload->seen);
    reload->seen = now;
    return stays && !is_same_look(&now, &reload->known);
}

static bool serial_differs(const struct cb_serial_config *a, const struct cb_serial_config *b) {
    return strcmp(a->device, b->device) != 0 || a->line.baud != b->line.baud ||
           a->line.parity != b->line.parity || a->line.stop_bits != b->line.stop_bits ||
           a->slave_delay_us != b->slave_delay_us || a->rs485 != b->rs485;
}

/* Connection and ticks cannot change during a run. out: the first key of theirs that differs; NULL:
 * none */
static const char *needs_restart(const struct cb_config *now, const struct cb_config *fresh) {
    const struct cb_plc_config *a = &now->plc, *b = &fresh->plc;
    if (a->transport != b->transport || a->unit != b->unit || a->port != b->port ||
        a->client != b->client || memcmp(a->host, b->host, sizeof a->host) != 0 ||
        serial_differs(&a->serial, &b->serial))
        return "plc.transport";
    if (a->exchange != b->exchange) return "plc.exchange";
    if (a->read.start != b->read.start || a->read.count != b->read.count) return "plc.read";
    if (a->write.start != b->write.start || a->write.count != b->write.count) return "plc.write";
    return now->period_us != fresh->period_us ? "cycle.period_ms" : NULL;
}

/* A signed file of another machine may be a good one, in the wrong place. Without keys the operator
 * decides. */
bool cb_reload_follows(struct cb_reload *reload, const char *machine, uint32_t revision,
                       const struct cb_config *fresh) {
    if (reload->loaded.is_signed && strcmp(machine, fresh->machine) != 0) {
        report(reload, "%s: is of machine \"%s\", but this box runs \"%s\"; bring its own file",
               reload->path, fresh->machine, machine);
        return false;
    }
    if (fresh->revision >= revision || reload->allow_older) return true;
    report(reload,
           "%s: revision %u is older than the running one, %u; raise it, or start compboxd with "
           "--allow-older",
           reload->path, (unsigned)fresh->revision, (unsigned)revision);
    return false;
}

static bool check(struct cb_reload *reload, const struct cb_config *now,
                  const struct cb_config *fresh) {
    const char *key = needs_restart(now, fresh);
    if (key != NULL) {
        report(reload, "%s: %s differs from the running file's, which takes a restart",
               reload->path, key);
        return false;
    }
    return cb_reload_follows(reload, now->machine, now->revision, fresh);
}

bool cb_reload_ready(struct cb_reload *reload, struct cb_loop *loop) {
    if (!reload->offered) return true;
    if ((!reload->pending && !cb_loop_is_corrupt(loop)) || !cb_loop_withdraw(loop)) return false;
    reload->offered = reload->pending = false;
    return true;
}

/* in : why: the limit that the file widens
 * out: PENDING, or SAME if the last line was about this very file */
static enum cb_reload_outcome keep_pending(struct cb_reload *reload, const struct cb_config *now,
                                           const struct cb_config *fresh, const char *why) {
    const bool same = reload->pending_logged && reload->pending_crc32 == reload->loaded.facts.crc32;
    reload->pending = reload->pending_logged = true;
    reload->pending_crc32 = reload->loaded.facts.crc32;
    report(reload,
           "%s: revision %u is pending: %s; it is taken with enable off and all outputs at zero; "
           "revision %u goes on",
           reload->path, (unsigned)fresh->revision, why, (unsigned)now->revision);
    return same ? CB_RELOAD_SAME : CB_RELOAD_PENDING;
}

/* Rejects any file, because it cannot be compared with a configuration that has changed in
 * memory. */
static enum cb_reload_outcome refuse_corrupt(struct cb_reload *reload) {
    report(reload,
           "%s: is not taken, because the running configuration has changed in memory; restart "
           "compboxd",
           reload->path);
    reload->loaded.facts.was_read = false;
    reload->refused++;
    reload->pending_logged = false;
    return CB_RELOAD_REFUSED;
}

/* Reads the file into `config`. out: whether it is a valid one */
static bool load(struct cb_reload *reload, struct cb_config *config) {
    const bool good = cb_load_file(config, reload->path, &reload->site, &reload->loaded);
    reload->loaded.facts.on_signal = reload->sender.known;
    reload->loaded.facts.sender_user = reload->sender.user;
    reload->loaded.facts.sender_pid = reload->sender.pid;
    reload->sender.known = false;
    if (!good) report(reload, "%s", reload->loaded.message);
    return good;
}

enum cb_reload_outcome cb_reload_offer(struct cb_reload *reload, struct cb_loop *loop) {
    struct cb_box *spare = cb_loop_spare(loop);
    const struct cb_config *now = &loop->box->config;
    char why[200];
    look(reload, &reload->known);
    reload->seen = reload->known;
    if (cb_loop_is_corrupt(loop)) return refuse_corrupt(reload);
    if (load(reload, &spare->config) && check(reload, now, &spare->config)) {
        const bool widens = cb_widening_find(now, &spare->config, why, sizeof why);
        cb_box_start(spare);
        reload->offered = true;
        const enum cb_reload_outcome offer =
            widens ? keep_pending(reload, now, &spare->config, why) : CB_RELOAD_OFFERED;
        cb_loop_offer(loop, widens);
        return offer;
    }
    reload->refused++;
    reload->pending_logged = false;
    return CB_RELOAD_REFUSED;
}

/* Appends the channels whose limits the site's ceiling lowers. */
static void add_lowered(struct cb_reload *reload, const struct cb_config *config) {
    char names[200];
    const size_t length = strlen(reload->last);
    if (reload->lowered == 0) return;
    cb_lowered_names(config, reload->lowered, names, sizeof names);
    snprintf(reload->last + length, sizeof reload->last - length,
             "; the site's ceiling lowers the limits of %s", names);
}

bool cb_reload_taken(struct cb_reload *reload, struct cb_loop *loop) {
    if (!reload->offered || !cb_loop_answered(loop)) return false;
    reload->offered = reload->pending = reload->pending_logged = false;
    reload->taken++;
    reload->lowered = reload->loaded.lowered;
    report(reload, "%s: revision %u is running now", reload->path,
           (unsigned)loop->box->config.revision);
    add_lowered(reload, &loop->box->config);
    return true;
}
