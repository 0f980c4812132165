/* SPDX-License-Identifier: MIT
 * What a person reads on stderr: changes of mode, of the connection, and errors on the wire. Not
 * more than a few lines a second of each kind, whatever happens, so that a bus that flickers hides
 * no change of mode; what is left out is said. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOG_H
#define COMPBOX_HAL_LINUX_DAEMON_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/linux/daemon/row.h"

/* Kinds of lines, with what "lines about …" are left out. The first one is not limited. */
#define CB_LOG_KINDS(X)                  \
    X(CB_LOG_START, "start and end")     \
    X(CB_LOG_MODE, "the mode")           \
    X(CB_LOG_LINK, "the connection")     \
    X(CB_LOG_WIRE, "errors on the wire") \
    X(CB_LOG_CAN, "the CAN bus")         \
    X(CB_LOG_BUS, "the bus")             \
    X(CB_LOG_FILES, "files")

enum cb_log_kind {
#define CB_X(name, what) name,
    CB_LOG_KINDS(CB_X)
#undef CB_X
        CB_LOG_KINDS_COUNT
};

struct cb_log_limit {
    double lines_left; /* may be written now; grows with time */
    int64_t refill_us; /* when lines_left was brought up to date */
    uint32_t left_out; /* lines suppressed since that was last said */
};

/* What was last seen and written about one kind of odd reply. */
struct cb_log_odd {
    struct cb_odd_reply seen, told;
    uint32_t connects; /* on which connection it was written */
    int64_t told_us;
};

struct cb_log {
    const char *plc;  /* its address, for the lines */
    bool journal;     /* stderr is systemd's journal */
    int64_t start_us; /* time 0 of the lines */
    struct cb_log_limit limits[CB_LOG_KINDS_COUNT];
    bool begun; /* a row was seen: the fields below are valid */
    uint8_t mode, reason;
    struct cb_cause cause;
    uint32_t registers_foreign; /* that a line was written about */
    struct cb_row_link link;
    struct cb_log_odd odd[CB_ODD_COUNT];
    uint32_t refused_functions; /* that lines were written about */
    bool slow;                  /* a line was written about slow replies, since contact is lost */
    int64_t errors_us;          /* when errors on the wire were last written about … */
    struct cb_tcp_counters tcp_errors; /* … and up to what counts */
    struct cb_rtu_counters rtu_errors;
    struct cb_can_config can_config; /* whose nodes these are */
    struct cb_row_can can;           /* the bus in the row before … */
    int64_t can_errors_us;           /* … and likewise its errors */
    struct cb_can_counters can_errors;
};

void cb_log_start(struct cb_log *log, const char *plc, int64_t now_us);

/* A line of CB_LOG_START: left out only when nobody reads stderr; printf format, no newline. */
void cb_log_say(struct cb_log *log, int64_t now_us, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A line that may also be left out when there are too many. */
void cb_log_limited(struct cb_log *log, enum cb_log_kind kind, int64_t now_us, const char *format,
                    ...) __attribute__((format(printf, 4, 5)));

/* To be called now and then: says what was left out of kinds that are quiet again; or, at the end,
 * of all. */
void cb_log_catch_up(struct cb_log *log, int64_t now_us, bool at_end);

/* Lines about what changed since the row before.
 * in : config: of the row's generation */
void cb_log_row(struct cb_log *log, const struct cb_config *config, const struct cb_row *row);

/* Likewise about what its replies show of the PLC (log_peer.c); part of cb_log_row. */
void cb_log_peer(struct cb_log *log, const struct cb_config *config, const struct cb_row *row);

/* Likewise about the CAN bus (log_can.c). */
void cb_log_can(struct cb_log *log, const struct cb_can_config *can, const struct cb_row *row);

#endif
