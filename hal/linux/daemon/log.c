/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/log.h"

#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/mode.h"

enum { BURST_LINES = 20, LINES_PER_S = 2, ERRORS_EVERY_US = 1000000 };

/* systemd names the device and file that it gave as stderr when that is its journal. */
static bool stderr_is_journal(void) {
    unsigned long long device = 0, file = 0;
    struct stat there;
    const char *stream = getenv("JOURNAL_STREAM");
    return stream != NULL && sscanf(stream, "%llu:%llu", &device, &file) == 2 &&
           fstat(STDERR_FILENO, &there) == 0 && there.st_dev == device && there.st_ino == file;
}

void cb_log_start(struct cb_log *log, const char *plc, int64_t now_us) {
    *log = (struct cb_log){.plc = plc,
                           .journal = stderr_is_journal(),
                           .start_us = now_us,
                           .lines_left = BURST_LINES,
                           .refill_us = now_us};
}

/* Whoever reads stderr may have stopped to; a line must not keep this thread from its work. */
static bool reader_is_there(void) {
    struct pollfd wait = {.fd = STDERR_FILENO, .events = POLLOUT};
    return poll(&wait, 1, 0) == 1 && (wait.revents & POLLOUT) != 0;
}

static void write_line(struct cb_log *log, int64_t now_us, const char *text) {
    if (!reader_is_there()) {
        log->left_out++;
        return;
    }
    if (log->left_out > 0)
        fprintf(stderr, "compboxd: (%u line%s left out)\n", (unsigned)log->left_out,
                log->left_out == 1 ? "" : "s");
    log->left_out = 0;
    if (log->journal) /* has the time and the name */
        fprintf(stderr, "%s\n", text);
    else
        fprintf(stderr, "compboxd: %9.3f s: %s\n", (double)(now_us - log->start_us) * 1e-6, text);
}

void cb_log_say(struct cb_log *log, int64_t now_us, const char *format, ...) {
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    write_line(log, now_us, text);
}

void cb_log_limited(struct cb_log *log, int64_t now_us, const char *format, ...) {
    log->lines_left += (double)(now_us - log->refill_us) * 1e-6 * LINES_PER_S;
    if (log->lines_left > BURST_LINES) log->lines_left = BURST_LINES;
    log->refill_us = now_us;
    if (log->lines_left < 1) {
        log->left_out++;
        return;
    }
    log->lines_left -= 1;
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    write_line(log, now_us, text);
}

static const char *cause_text(const struct cb_row_link *link) {
    switch ((enum cb_link_cause)link->cause) {
        case CB_LINK_CAUSE_NONE:
            break;
        case CB_LINK_CAUSE_ERRNO:
            return strerror(link->error_number);
        case CB_LINK_CAUSE_PEER:
            return "the PLC closed it";
        case CB_LINK_CAUSE_SILENT:
            return "no valid reply for several cycles";
        case CB_LINK_CAUSE_FRAMING:
            return "what came is not a whole Modbus/TCP frame";
    }
    return "not tried yet";
}

static void log_mode(struct cb_log *log, const struct cb_row *row) {
    if (log->begun && row->mode == log->mode && row->reason == log->reason) return;
    cb_log_limited(log, row->time_us, "%s: %s", cb_mode_name(row->mode),
                   cb_reason_text(row->reason));
    log->mode = row->mode;
    log->reason = row->reason;
}

static void log_link(struct cb_log *log, const struct cb_row *row) {
    const struct cb_row_link *now = &row->link, *before = &log->link;
    if (now->disconnects != before->disconnects)
        cb_log_limited(log, row->time_us, "connection to %s lost: %s", log->plc, cause_text(now));
    if (now->connects != before->connects)
        cb_log_limited(log, row->time_us, "connected to %s", log->plc);
    if (before->failures == 0 && now->failures > 0)
        cb_log_limited(log, row->time_us, "cannot connect to %s: %s; trying again", log->plc,
                       cause_text(now));
    log->link = *now;
}

/* Errors on the wire since they were last written about: "3 timeouts, 1 wrong_ids", or "". */
#define CB_X(name)                                                                           \
    if (used < size && now->name != told->name)                                              \
        used += (size_t)snprintf(text + used, size - used, "%s%u %s", used == 0 ? "" : ", ", \
                                 (unsigned)(now->name - told->name), #name);

static void describe_tcp(const struct cb_tcp_counters *told, const struct cb_tcp_counters *now,
                         char *text, size_t size) {
    size_t used = 0;
    CB_TCP_ERRORS(CB_X)
}

static void describe_rtu(const struct cb_rtu_counters *told, const struct cb_rtu_counters *now,
                         char *text, size_t size) {
    size_t used = 0;
    CB_RTU_ERRORS(CB_X)
}
#undef CB_X

/* At most once a second, so that a row of errors is one line. */
static void log_errors(struct cb_log *log, const struct cb_row *row) {
    if (row->time_us - log->errors_us < ERRORS_EVERY_US) return;
    char text[200] = "";
    if (row->transport == CB_TRANSPORT_RTU)
        describe_rtu(&log->rtu_errors, &row->rtu, text, sizeof text);
    else
        describe_tcp(&log->tcp_errors, &row->tcp, text, sizeof text);
    if (text[0] == '\0') return;
    cb_log_limited(log, row->time_us, "%s: %s", log->plc, text);
    log->errors_us = row->time_us;
    log->tcp_errors = row->tcp;
    log->rtu_errors = row->rtu;
}

void cb_log_row(struct cb_log *log, const struct cb_row *row) {
    log_link(log, row);
    log_mode(log, row);
    log_errors(log, row);
    log->begun = true;
}
