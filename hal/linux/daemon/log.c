/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/box/mode.h"
#include "hal/linux/daemon/exception_words.h"
#include "hal/linux/files/cause_words.h"
#include "hal/linux/files/output_file.h"
#include "hal/linux/serial_opener.h"
#include "hal/linux/stderr.h"

/* The allowance of a kind of line; it counts as quiet after two seconds without one. */
static const double BURST_LINES = 20, LINES_PER_S = 2, QUIET_LINES = 4;

enum {
    LINE_BYTES = 600, /* a sentence about a coefficient file, with its path */
    ERRORS_EVERY_US = 1000000
};

/* systemd publishes the device and file of stderr if that is its journal. */
static bool stderr_is_journal(void) {
    unsigned long long device = 0, file = 0;
    struct stat there;
    const char *stream = getenv("JOURNAL_STREAM");
    return stream != NULL && sscanf(stream, "%llu:%llu", &device, &file) == 2 &&
           fstat(STDERR_FILENO, &there) == 0 && there.st_dev == device && there.st_ino == file;
}

void cb_log_start(struct cb_log *log, const char *plc, int64_t now_us) {
    *log = (struct cb_log){.plc = plc, .journal = stderr_is_journal(), .start_us = now_us};
    for (unsigned kind = 0; kind < CB_LOG_KINDS_COUNT; kind++)
        log->limits[kind] = (struct cb_log_limit){.lines_left = BURST_LINES, .refill_us = now_us};
}

static void put(const struct cb_log *log, int64_t now_us, const char *text) {
    if (log->journal) /* has the time and the name */
        fprintf(stderr, "%s\n", text);
    else
        fprintf(stderr, "compboxd: %9.3f s: %s\n", (double)(now_us - log->start_us) * 1e-6, text);
}

static void report_left_out(struct cb_log *log, enum cb_log_kind kind, int64_t now_us) {
    static const char *const what[] = {
#define CB_X(name, word, what) [name] = what,
        CB_LOG_KINDS(CB_X)
#undef CB_X
    };
    uint32_t *left_out = &log->limits[kind].left_out;
    char text[80];
    if (*left_out == 0) return;
    snprintf(text, sizeof text, "(%u line%s about %s left out)", (unsigned)*left_out,
             *left_out == 1 ? "" : "s", what[kind]);
    put(log, now_us, text);
    *left_out = 0;
}

static __attribute__((format(printf, 4, 0))) void write_line(struct cb_log *log,
                                                             enum cb_log_kind kind, int64_t now_us,
                                                             const char *format,
                                                             va_list arguments) {
    static const char *const words[] = {
#define CB_X(name, word, what) [name] = word,
        CB_LOG_KINDS(CB_X)
#undef CB_X
    };
    char text[LINE_BYTES];
    vsnprintf(text, sizeof text, format, arguments);
    cb_events_add(log->events, words[kind], text, kind == CB_LOG_MODE ? log->row : NULL);
    if (!cb_stderr_is_ready()) {
        log->limits[kind].left_out++;
        return;
    }
    report_left_out(log, kind, now_us);
    put(log, now_us, text);
}

void cb_log_line(struct cb_log *log, int64_t now_us, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    write_line(log, CB_LOG_START, now_us, format, arguments);
    va_end(arguments);
}

/* out: the limit, with the allowance refilled for the elapsed time. Rows behind a stall come with
 * earlier times, which take nothing back. */
static struct cb_log_limit *refilled(struct cb_log *log, enum cb_log_kind kind, int64_t now_us) {
    struct cb_log_limit *limit = &log->limits[kind];
    if (now_us <= limit->refill_us) return limit;
    limit->lines_left += (double)(now_us - limit->refill_us) * 1e-6 * LINES_PER_S;
    if (limit->lines_left > BURST_LINES) limit->lines_left = BURST_LINES;
    limit->refill_us = now_us;
    return limit;
}

static bool is_quiet(struct cb_log *log, enum cb_log_kind kind, int64_t now_us) {
    return refilled(log, kind, now_us)->lines_left >= QUIET_LINES;
}

bool cb_log_limited(struct cb_log *log, enum cb_log_kind kind, int64_t now_us, const char *format,
                    ...) {
    struct cb_log_limit *limit = refilled(log, kind, now_us);
    if (limit->lines_left < 1) {
        limit->left_out++;
        if (log->events != NULL) log->events->lost++;
        return false;
    }
    limit->lines_left -= 1;
    va_list arguments;
    va_start(arguments, format);
    write_line(log, kind, now_us, format, arguments);
    va_end(arguments);
    return true;
}

void cb_log_file(struct cb_log *log, const char *path, int error, int *reported, int64_t now_us) {
    if (error == *reported) return;
    *reported = error;
    if (error == 0)
        cb_log_limited(log, CB_LOG_FILES, now_us, "%s: is written again", path);
    else
        cb_log_limited(log, CB_LOG_FILES, now_us, "%s: cannot be written: %s", path,
                       cb_output_error(error));
}

void cb_log_catch_up(struct cb_log *log, int64_t now_us, bool at_end) {
    for (enum cb_log_kind kind = 0; kind < CB_LOG_KINDS_COUNT; kind++) {
        if (log->limits[kind].left_out == 0) continue;
        const bool due = is_quiet(log, kind, now_us) || at_end;
        if (due && cb_stderr_is_ready()) report_left_out(log, kind, now_us);
    }
}

/* out: cause of a lost connection, one clause; "not tried yet" without a cause */
static const char *cause_text(const struct cb_row_link *link) {
    switch ((enum cb_link_cause)link->cause) {
        case CB_LINK_CAUSE_NONE:
            break;
        case CB_LINK_CAUSE_ERRNO:
            return cb_serial_error(link->error_number);
        case CB_LINK_CAUSE_PEER:
            return "the PLC closed it";
        case CB_LINK_CAUSE_SILENT:
            return "no valid reply for several cycles";
        case CB_LINK_CAUSE_FRAMING:
            return "the received bytes are no Modbus/TCP frame";
        case CB_LINK_CAUSE_LEFT:
            return "closed by the box behind its last write, as no write was confirmed";
    }
    return "not tried yet";
}

/* Another missing signal deserves a line; another channel at its limit does not. */
static bool other_signal(const struct cb_cause *a, const struct cb_cause *b) {
    return a->kind != b->kind || a->index != b->index;
}

static void log_mode(struct cb_log *log, const struct cb_row *row) {
    const struct cb_cause *cause = &row->cause.cause;
    const bool same = row->mode == log->mode && row->reason == log->reason;
    const bool moved = row->reason == CB_REASON_SIGNAL && other_signal(cause, &log->cause);
    const bool due = log->mode_is_untold && is_quiet(log, CB_LOG_MODE, row->time_us);
    char text[CB_CAUSE_TEXT];
    if (log->begun && same && !moved && !due) return;
    cb_cause_text(&row->cause, text);
    log->mode_is_untold =
        !cb_log_limited(log, CB_LOG_MODE, row->time_us, "%s: %s%s%s", cb_mode_name(row->mode),
                        cb_reason_text(row->reason), text[0] == '\0' ? "" : ": ", text);
    log->mode = row->mode;
    log->reason = row->reason;
    log->cause = *cause;
}

/* Another client writes to the PLC: logs its value in the register of a channel. */
static void log_foreign(struct cb_log *log, const struct cb_config *config,
                        const struct cb_row *row) {
    const uint8_t channel = row->foreign.channel;
    if (row->box.registers_foreign == log->registers_foreign) return;
    log->registers_foreign = row->box.registers_foreign;
    if (channel >= cb_all_channels(config)) return;
    cb_log_limited(
        log, CB_LOG_WIRE, row->time_us,
        "another client writes to %s: the register of %s%s holds %.6g, not the %.6g µm%s "
        "that the box wrote; give it another block or end it",
        log->plc, config->channels[channel].is_slope ? "the slope of channel " : "channel ",
        config->channels[channel].name, (double)row->foreign.value_um, (double)row->foreign.sent_um,
        config->channels[channel].is_slope ? "/m" : "");
}

static void log_link(struct cb_log *log, const struct cb_row *row) {
    const struct cb_row_link *now = &row->link, *before = &log->link;
    if (now->disconnects != before->disconnects)
        cb_log_limited(log, CB_LOG_LINK, row->time_us, "connection to %s lost: %s", log->plc,
                       cause_text(now));
    if (now->connects != before->connects)
        cb_log_limited(log, CB_LOG_LINK, row->time_us, "connected to %s", log->plc);
    if (before->failures == 0 && now->failures > 0)
        cb_log_limited(log, CB_LOG_LINK, row->time_us, "cannot connect to %s: %s; trying again",
                       log->plc, cause_text(now));
    log->link = *now;
}

/* Lists the errors on the wire since the last line about them: "timeouts: 3, exceptions: 2;
 * exception 2 (illegal data address)", or "". */
#define CB_X(name) cb_add_counter(#name, now->name - before->name, text, size);

static void describe_tcp(const struct cb_tcp_counters *before, const struct cb_tcp_counters *now,
                         char *text, size_t size) {
    CB_TCP_ERRORS(CB_X)
    cb_add_exceptions(before->exceptions_by_code, now->exceptions_by_code, CB_TCP_EXCEPTIONS, text,
                      size);
}

static void describe_rtu(const struct cb_rtu_counters *before, const struct cb_rtu_counters *now,
                         char *text, size_t size) {
    CB_RTU_ERRORS(CB_X)
    cb_add_exceptions(before->exceptions_by_code, now->exceptions_by_code, CB_RTU_EXCEPTIONS, text,
                      size);
}
#undef CB_X

/* Exceptions 1 come in every cycle and have a line of their own (log_peer.c). */
static void pass_over_refused(uint32_t *exceptions, uint32_t *by_code, const uint32_t *now) {
    *exceptions += now[1] - by_code[1];
    by_code[1] = now[1];
}

/* At most once a second, so that a series of errors is one line. */
static void log_errors(struct cb_log *log, const struct cb_row *row) {
    if (row->time_us - log->errors_us < ERRORS_EVERY_US) return;
    char text[400] = "";
    pass_over_refused(&log->tcp_errors.exceptions, log->tcp_errors.exceptions_by_code,
                      row->tcp.exceptions_by_code);
    pass_over_refused(&log->rtu_errors.exceptions, log->rtu_errors.exceptions_by_code,
                      row->rtu.exceptions_by_code);
    if (row->transport == CB_TRANSPORT_RTU)
        describe_rtu(&log->rtu_errors, &row->rtu, text, sizeof text);
    else
        describe_tcp(&log->tcp_errors, &row->tcp, text, sizeof text);
    if (text[0] == '\0') return;
    cb_log_limited(log, CB_LOG_WIRE, row->time_us, "%s: %s", log->plc, text);
    log->errors_us = row->time_us;
    log->tcp_errors = row->tcp;
    log->rtu_errors = row->rtu;
}

void cb_log_row(struct cb_log *log, const struct cb_config *config, const struct cb_row *row) {
    log->row = row;
    cb_log_peer(log, config, row);
    log_link(log, row);
    log_mode(log, row);
    log_foreign(log, config, row);
    log_errors(log, row);
    log->row = NULL;
    log->begun = true;
}
