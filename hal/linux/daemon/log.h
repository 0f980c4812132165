/* SPDX-License-Identifier: MIT
 * Lines on stderr for a person: changes of mode, of the connection, and errors on the wire. Each
 * kind is limited to a few lines a second, so that a flickering bus hides no change of mode; the
 * number of dropped lines is reported. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOG_H
#define COMPBOX_HAL_LINUX_DAEMON_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/linux/files/events.h"
#include "hal/linux/files/row.h"

struct cb_bus;

/* X(name, word, what): kinds of lines; `word` names the event, "lines about WHAT" are left out. The
 * first kind is not limited. */
#define CB_LOG_KINDS(X)                          \
    X(CB_LOG_START, "run", "start and end")      \
    X(CB_LOG_MODE, "mode", "the mode")           \
    X(CB_LOG_LINK, "link", "the connection")     \
    X(CB_LOG_WIRE, "wire", "errors on the wire") \
    X(CB_LOG_CAN, "can", "the CAN bus")          \
    X(CB_LOG_BUS, "bus", "the bus")              \
    X(CB_LOG_FILES, "file", "files")

enum cb_log_kind {
#define CB_X(name, word, what) name,
    CB_LOG_KINDS(CB_X)
#undef CB_X
        CB_LOG_KINDS_COUNT
};

struct cb_log_limit {
    double lines_left; /* current allowance of lines; grows with time */
    int64_t refill_us; /* time of the last update of lines_left */
    uint32_t left_out; /* lines suppressed since the last report of them */
};

/* Last observation and last line about one kind of odd reply. */
struct cb_log_odd {
    struct cb_odd_reply seen, logged;
    uint32_t connects; /* connection of the last line */
    int64_t logged_us;
};

struct cb_log {
    struct cb_events *events; /* has every line too; NULL: none */
    const char *plc;          /* its address, for the lines */
    bool journal;             /* stderr is systemd's journal */
    int64_t start_us;         /* time 0 of the lines */
    struct cb_log_limit limits[CB_LOG_KINDS_COUNT];
    const struct cb_row *row; /* during cb_log_row() */
    bool begun;               /* a row was processed: the fields below are valid */
    uint8_t mode, reason;
    bool mode_is_untold; /* its line was left out; it is written when the kind is quiet again */
    struct cb_cause cause;
    uint32_t registers_foreign; /* count at the last line */
    struct cb_row_link link;
    struct cb_log_odd odd[CB_ODD_COUNT];
    uint32_t refused_functions;        /* functions that lines were written about */
    bool slow;                         /* a line about slow replies was written since the loss of
                                          contact */
    int64_t errors_us;                 /* time of the last line about errors on the wire … */
    struct cb_tcp_counters tcp_errors; /* … and the counts at that time */
    struct cb_rtu_counters rtu_errors;
    struct cb_can_config can_config; /* configuration of these nodes */
    struct cb_row_can can;           /* the bus in the previous row */
    int64_t can_errors_us;           /* time of the last line about its errors */
    struct cb_can_counters can_errors;
};

void cb_log_start(struct cb_log *log, const char *plc, int64_t now_us);

/* A line of CB_LOG_START: dropped only if stderr is not read; printf format, no newline. */
void cb_log_line(struct cb_log *log, int64_t now_us, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A line that is left out when there are too many. out: false: it was */
bool cb_log_limited(struct cb_log *log, enum cb_log_kind kind, int64_t now_us, const char *format,
                    ...) __attribute__((format(printf, 4, 5)));

/* Logs the write status of a periodically written file only when it changes.
 * in : *reported: last reported errno */
void cb_log_file(struct cb_log *log, const char *path, int error, int *reported, int64_t now_us);

/* Call it regularly: reports the dropped lines of kinds that are quiet again; at the end, of all
 * kinds. */
void cb_log_catch_up(struct cb_log *log, int64_t now_us, bool at_end);

/* Logs the changes since the previous row.
 * in : config: of the row's generation */
void cb_log_row(struct cb_log *log, const struct cb_config *config, const struct cb_row *row);

/* Logs abilities and faults of the PLC that its replies show (log_peer.c); part of cb_log_row. */
void cb_log_peer(struct cb_log *log, const struct cb_config *config, const struct cb_row *row);

/* Logs changes on the CAN bus (log_can.c). */
void cb_log_can(struct cb_log *log, const struct cb_can_config *can, const struct cb_row *row);

/* Logs the changes on the slow bus since the last call (log_bus.c). */
void cb_log_bus(struct cb_log *log, struct cb_bus *bus, int64_t now_us);

#endif
