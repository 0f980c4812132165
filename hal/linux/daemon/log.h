/* SPDX-License-Identifier: MIT
 * What a person reads on stderr: changes of mode, of the connection, and errors on the wire. Not
 * more than a few lines a second, whatever happens; what is left out is said. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_LOG_H
#define COMPBOX_HAL_LINUX_DAEMON_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/linux/daemon/row.h"

struct cb_log {
    const char *plc;   /* its address, for the lines */
    bool journal;      /* stderr is systemd's journal */
    int64_t start_us;  /* time 0 of the lines */
    double lines_left; /* may be written now; grows with time */
    int64_t refill_us; /* when lines_left was brought up to date */
    uint32_t left_out; /* lines suppressed since the last one written */
    bool begun;        /* a row was seen: the fields below are valid */
    uint8_t mode, reason;
    struct cb_row_link link;
    int64_t errors_us;                 /* when errors on the wire were last written about … */
    struct cb_tcp_counters tcp_errors; /* … and up to what counts */
    struct cb_rtu_counters rtu_errors;
    struct cb_can_config can_config; /* whose nodes these are */
    struct cb_row_can can;           /* the bus in the row before … */
    int64_t can_errors_us;           /* … and likewise its errors */
    struct cb_can_counters can_errors;
};

void cb_log_start(struct cb_log *log, const char *plc, int64_t now_us);

/* A line that is left out only when nobody reads stderr; printf format, no newline. */
void cb_log_say(struct cb_log *log, int64_t now_us, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A line that may also be left out when there are too many. */
void cb_log_limited(struct cb_log *log, int64_t now_us, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Lines about what changed since the row before. */
void cb_log_row(struct cb_log *log, const struct cb_row *row);

/* Likewise about the CAN bus (log_can.c). */
void cb_log_can(struct cb_log *log, const struct cb_can_config *can, const struct cb_row *row);

#endif
