/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/reload.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/daemon/load.h"

static __attribute__((format(printf, 2, 3))) void say(struct cb_reload *reload, const char *format,
                                                      ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reload->last, sizeof reload->last, format, arguments);
    va_end(arguments);
}

static bool same_time(const struct timespec *a, const struct timespec *b) {
    return a->tv_sec == b->tv_sec && a->tv_nsec == b->tv_nsec;
}

/* The time of the last change of anything (ctime) tells of a file that was given its old time back.
 */
static bool same_file(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size &&
           same_time(&a->st_mtim, &b->st_mtim) && same_time(&a->st_ctim, &b->st_ctim);
}

/* A file that is away for a moment, while another is put in its place, did not change. */
static void look(const struct cb_reload *reload, struct stat *now) {
    if (stat(reload->path, now) != 0) *now = reload->known;
}

void cb_reload_start(struct cb_reload *reload, const char *path) {
    *reload = (struct cb_reload){.path = path};
    look(reload, &reload->known);
    reload->seen = reload->known;
}

bool cb_reload_file_changed(struct cb_reload *reload, int64_t now_us) {
    struct stat now;
    if (now_us - reload->looked_us < CB_RELOAD_LOOK_US) return false;
    reload->looked_us = now_us;
    look(reload, &now);
    const bool stays = same_file(&now, &reload->seen);
    reload->seen = now;
    return stays && !same_file(&now, &reload->known);
}

static bool serial_differs(const struct cb_serial_config *a, const struct cb_serial_config *b) {
    return strcmp(a->device, b->device) != 0 || a->line.baud != b->line.baud ||
           a->line.parity != b->line.parity || a->line.stop_bits != b->line.stop_bits ||
           a->slave_delay_us != b->slave_delay_us || a->rs485 != b->rs485;
}

/* What the connection and the ticks were made from cannot change under them. out: the first such
 * key that differs; NULL: none */
static const char *needs_restart(const struct cb_config *now, const struct cb_config *fresh) {
    const struct cb_plc_config *a = &now->plc, *b = &fresh->plc;
    if (a->transport != b->transport || a->unit != b->unit || a->port != b->port ||
        memcmp(a->host, b->host, sizeof a->host) != 0 || serial_differs(&a->serial, &b->serial))
        return "plc.transport";
    if (a->exchange != b->exchange) return "plc.exchange";
    if (a->read.start != b->read.start || a->read.count != b->read.count) return "plc.read";
    if (a->write.start != b->write.start || a->write.count != b->write.count) return "plc.write";
    return now->period_us != fresh->period_us ? "cycle.period_ms" : NULL;
}

static bool check(struct cb_reload *reload, const struct cb_config *now,
                  const struct cb_config *fresh) {
    const char *key = needs_restart(now, fresh);
    if (key == NULL) return true;
    say(reload, "%s: %s differs from the running file's, which takes a restart", reload->path, key);
    return false;
}

bool cb_reload_offer(struct cb_reload *reload, struct cb_loop *loop) {
    struct cb_box *spare = cb_loop_spare(loop);
    char why[CB_RELOAD_SAID];
    look(reload, &reload->known);
    reload->seen = reload->known;
    if (!cb_load_file(&spare->config, reload->path, why, sizeof why))
        say(reload, "%s", why);
    else if (check(reload, &loop->box->config, &spare->config)) {
        cb_box_start(spare);
        cb_loop_offer(loop);
        reload->offered = true;
        return true;
    }
    reload->refused++;
    return false;
}

enum cb_reload_answer cb_reload_answer(struct cb_reload *reload, struct cb_loop *loop) {
    bool taken = false;
    if (!reload->offered || !cb_loop_answered(loop, &taken)) return CB_RELOAD_NONE;
    reload->offered = false;
    if (taken) {
        reload->taken++;
        say(reload, "%s: revision %u is running now", reload->path,
            (unsigned)loop->box->config.revision);
        return CB_RELOAD_TAKEN;
    }
    reload->refused++;
    const struct cb_channel_config *channel = &loop->box->config.channels[loop->obstacle];
    say(reload,
        "%s: %s %s is gone, or has another register, type, scale or sign, while its output is not "
        "zero; let the outputs go to zero, then reload again; revision %u goes on",
        reload->path, channel->is_slope ? "the slope of channel" : "channel", channel->name,
        (unsigned)loop->box->config.revision);
    return CB_RELOAD_REFUSED;
}
