/* SPDX-License-Identifier: MIT
 * Log of CAN: the state of the bus, nodes that start or fall silent, errors. */
#include <stdio.h>
#include <string.h>

#include "hal/linux/daemon/exception_words.h"
#include "hal/linux/daemon/log.h"
#include "hal/linux/files/can_words.h"

enum { ERRORS_EVERY_US = 1000000 };

static void log_state(struct cb_log *log, const char *interface, const struct cb_row *row) {
    if (row->can.state == log->can.state) return;
    cb_log_limited(log, CB_LOG_CAN, row->time_us, "%s: CAN bus is %s", interface,
                   cb_can_state_word(row->can.state));
}

static void log_node(struct cb_log *log, const struct cb_can_config *can, unsigned i,
                     const struct cb_row *row) {
    const struct cb_canopen_node *now = &row->can.nodes[i], *before = &log->can.nodes[i];
    if (now->losses != before->losses)
        cb_log_limited(log, CB_LOG_CAN, row->time_us, "%s: node %u: no heartbeat for %u ms",
                       can->interface, (unsigned)can->nodes[i].node,
                       (unsigned)can->nodes[i].heartbeat_timeout_ms);
    else if (now->state != before->state)
        cb_log_limited(log, CB_LOG_CAN, row->time_us, "%s: node %u is %s", can->interface,
                       (unsigned)can->nodes[i].node, cb_canopen_state_word(now->state));
}

/* At most once a second, so that a series of errors is one line. */
static void log_errors(struct cb_log *log, const char *interface, const struct cb_row *row) {
    if (row->time_us - log->can_errors_us < ERRORS_EVERY_US) return;
    const struct cb_can_counters *now = &row->can.counters, *before = &log->can_errors;
    char text[200] = "";
#define CB_X(name) cb_add_counter(#name, now->name - before->name, text, sizeof text);
    CB_CAN_ERRORS(CB_X)
#undef CB_X
    const size_t used = strlen(text);
    if (now->short_frames != before->short_frames)
        snprintf(text + used, sizeof text - used, " (the last of 0x%x)",
                 (unsigned)(row->can.short_id & CB_CAN_ID_BITS));
    if (used == 0) return;
    cb_log_limited(log, CB_LOG_CAN, row->time_us, "%s: %s", interface, text);
    log->can_errors_us = row->time_us;
    log->can_errors = *now;
}

/* Another file may name other nodes, whose state is unknown, as in can_source.c. */
static void follow_nodes(struct cb_log *log, const struct cb_can_config *can) {
    if (memcmp(&log->can_config, can, sizeof *can) == 0) return;
    log->can_config = *can;
    cb_canopen_start(log->can.nodes);
}

void cb_log_can(struct cb_log *log, const struct cb_can_config *can, const struct cb_row *row) {
    follow_nodes(log, can);
    log_state(log, can->interface, row);
    for (unsigned i = 0; i < can->nodes_count; i++) log_node(log, can, i, row);
    log_errors(log, can->interface, row);
    log->can = row->can;
}
