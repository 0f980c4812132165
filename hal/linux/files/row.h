/* SPDX-License-Identifier: MIT
 * The loop's report of each cycle to the normal thread. */
#ifndef COMPBOX_HAL_LINUX_FILES_ROW_H
#define COMPBOX_HAL_LINUX_FILES_ROW_H

#include <stdint.h>

#include "firmware/box/box.h"
#include "hal/linux/can_source.h"
#include "hal/linux/rtu.h"
#include "hal/linux/tcp.h"

struct cb_row_link {
    uint8_t state; /* enum cb_link_state */
    uint8_t cause; /* enum cb_link_cause */
    int error_number;
    uint32_t connects, failures, disconnects;
};

struct cb_row_can {
    uint8_t state;     /* enum cb_can_state */
    uint32_t short_id; /* of the last frame that was too short */
    struct cb_can_counters counters;
    struct cb_canopen_node nodes[CB_MAX_CAN_NODES]; /* in the order of the coefficient file */
};

/* Signal, term or channel behind the reason, with its name and unit. */
struct cb_row_cause {
    struct cb_cause cause;
    char name[CB_NAME_SIZE];
    char unit[8]; /* of a signal's value; otherwise "" */
};

/* X(name, word): what a signal's value is worth in this cycle. */
#define CB_ROW_SIGNAL_STATES(X)                                                                   \
    X(CB_ROW_SIGNAL_NEVER, "never")     /* none was accepted since the start */                   \
    X(CB_ROW_SIGNAL_FRESH, "fresh")     /* the newest reading is in use */                        \
    X(CB_ROW_SIGNAL_REFUSED, "refused") /* the newest was implausible; one before it is in use */ \
    X(CB_ROW_SIGNAL_STALE, "stale")     /* older than max_age_ms: not used */

enum cb_row_signal_state {
#define CB_X(name, word) name,
    CB_ROW_SIGNAL_STATES(CB_X)
#undef CB_X
};

/* The two counts are its share of the box's counters. */
struct cb_row_signal {
    float value;     /* the last accepted one */
    uint8_t state;   /* enum cb_row_signal_state */
    int64_t time_us; /* of its acceptance, clock of step_at_us */
    uint32_t implausible, stale;
};
struct cb_row_channel {
    float wanted_um, output_um;
    float applied_um; /* newest one of the PLC, of a channel with `applied` */
    uint32_t limited, excessive;
};

struct cb_row {
    int64_t time_us;     /* wake-up, CLOCK_BOOTTIME */
    int64_t tick;        /* index of the tick, skipped ones included */
    int64_t late_ns;     /* largest lateness in the wait, skipped ticks included: worst_ns */
    int64_t interval_ns; /* since the previous wake-up; 0 in the first row */
    int64_t exchange_us, step_us;
    uint32_t generation; /* of the coefficient file behind these signals, terms and channels */
    uint32_t lead_us;    /* lead of positions */
    uint8_t read, write; /* enum cb_transfer */
    uint8_t mode, reason;
    struct cb_row_cause cause;
    struct cb_foreign_register foreign; /* found by the last read-back */
    struct cb_counters box;
    uint8_t transport;          /* enum cb_transport */
    struct cb_tcp_counters tcp; /* of the transport in use; the other one has zeros */
    struct cb_rtu_counters rtu;
    struct cb_peer peer;
    struct cb_row_link link;
    struct cb_row_can can;
    uint64_t number;     /* of the cycle, from 0 */
    int64_t step_at_us;  /* now_us of the step … */
    struct cb_inputs in; /* its inputs and its write block */
    uint16_t written[CB_MAX_WRITE_REGISTERS];
    struct cb_row_signal signals[CB_MAX_SIGNALS];
    struct cb_row_channel channels[CB_MAX_CHANNELS];
    float outputs[CB_MAX_OUTPUTS]; /* of the terms */
    struct cb_probe_state probes[CB_MAX_ADAPTS];
    float sigma_um[CB_MAX_OUTPUTS]; /* of each output; NaN: none (row_sigma.h) */
};

#endif
