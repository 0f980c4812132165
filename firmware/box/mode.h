/* SPDX-License-Identifier: MIT
 * Modes of the box and their reasons (docs/DESIGN.md §5; picture: docs/mode.dot). */
#ifndef COMPBOX_FIRMWARE_BOX_MODE_H
#define COMPBOX_FIRMWARE_BOX_MODE_H

#include <stdbool.h>
#include <stdint.h>

/* X(name, value, text): the low byte of the status register. */
#define CB_MODES(X)                  \
    X(CB_MODE_STANDBY, 0, "STANDBY") \
    X(CB_MODE_ACTIVE, 1, "ACTIVE")   \
    X(CB_MODE_HOLD, 2, "HOLD")       \
    X(CB_MODE_RAMP, 3, "RAMP")       \
    X(CB_MODE_FAULT, 4, "FAULT")     \
    X(CB_MODE_STOPPED, 5, "STOPPED")

/* X(name, value, text): the high byte of the status register; 16 to 21 are faults. */
#define CB_REASONS(X)                                                                           \
    X(CB_REASON_NONE, 0, "all is well")                                                         \
    X(CB_REASON_NO_PLC, 1, "the PLC does not reply")                                            \
    X(CB_REASON_NOT_ENABLED, 2, "the PLC has not set enable")                                   \
    X(CB_REASON_NOT_REFERENCED, 3, "an axis is not referenced")                                 \
    X(CB_REASON_HEARTBEAT, 4, "the PLC's heartbeat does not change")                            \
    X(CB_REASON_SIGNAL, 5, "an essential signal is missing or implausible")                     \
    X(CB_REASON_CLOCK, 6, "time went backward or jumped")                                       \
    X(CB_REASON_WAIT_ENABLE, 7, "after a loss: waiting for permit resume or a new enable edge") \
    X(CB_REASON_DEGRADED, 8, "a term is faded out: a signal is missing or far out of range")    \
    X(CB_REASON_LIMITED, 9, "a channel is at its limit")                                        \
    X(CB_REASON_STOP, 10, "a stop was requested")                                               \
    X(CB_REASON_EXTRAPOLATED, 11, "a model is used outside the range it was trained in")        \
    X(CB_REASON_UNCONFIRMED, 12, "the PLC answers readings but confirms no write")              \
    X(CB_REASON_UNAPPLIED, 13, "the PLC applies another value than was written")                \
    X(CB_REASON_NC, 14, "the NC is in alarm")                                                   \
    X(CB_REASON_NO_FILE, 15, "there is no coefficient file that the box can run")               \
    X(CB_REASON_DEMAND, 16, "a channel's demand is beyond its error limit")                     \
    X(CB_REASON_CONFIG_CORRUPT, 17,                                                             \
      "the configuration in memory has changed: nothing is written until a restart")            \
    X(CB_REASON_WRITE_REFUSED, 18, "the PLC refuses the writes")                                \
    X(CB_REASON_OVERRUN, 19, "the box misses its period repeatedly")                            \
    X(CB_REASON_NC_ALARM, 20, "an NC alarm occurred during compensation")                       \
    X(CB_REASON_FOREIGN, 21, "the PLC applies a value that is not the box's, beyond error_um")  \
    X(CB_REASON_MODEL_DRIFTED, 22, "a model no longer fits: its probes differ to one side")

enum cb_mode {
#define CB_X(name, value, text) name = value,
    CB_MODES(CB_X)
#undef CB_X
};

enum cb_reason {
#define CB_X(name, value, text) name = value,
    CB_REASONS(CB_X)
#undef CB_X
};

/* Events of one step, on which the mode depends. */
struct cb_mode_events {
    bool plc_ok;        /* the last good reading is younger than its maximum age */
    bool writes_ok;     /* the PLC returned its write block or refused to, and confirms writes */
    bool heartbeat_ok;  /* the PLC's heartbeat moved within its timeout */
    bool essentials_ok; /* every essential signal is valid and young enough */
    bool loss;          /* a loss was found in this step: an earlier run was interrupted, or the
                           PLC does not return its write block */
    bool clock_ok;      /* time went forward by no more than five periods */
    bool enable;        /* control bit 0 */
    bool referenced;    /* control bit 1, or all configured bits */
    bool reset_edge;    /* control bit 2 went from 0 to 1 */
    bool permit_resume; /* control bit 3 */
    bool stop;          /* a stop was requested */
    bool all_zero;      /* every output is zero */
    bool zero_written;  /* … and the PLC confirmed it, or nothing was ever written */
    bool excessive;     /* a channel's demand is beyond its error limit: a fault when ACTIVE */
    bool foreign;       /* the PLC applies a value far beyond those sent: a fault when ACTIVE */
    bool nc_alarm;      /* the NC is in alarm: a fault when ACTIVE */
    bool unapplied;     /* the PLC applies another value than was written */
    bool degraded;      /* a term is not live, or weakened outside its training range */
    bool extrapolated;  /* a model is outside its training range */
    bool drifted;       /* the probes of an adapted term differ from it to one side */
    bool limited;       /* a channel is at its limit */
    uint8_t fault;      /* enum cb_reason: a fault found in this step, or CB_REASON_NONE */
};

struct cb_mode_state {
    uint8_t mode;     /* enum cb_mode */
    uint8_t reason;   /* enum cb_reason; of a latched fault until it is reset */
    bool enable_was;  /* enable of the previous step */
    bool withheld;    /* the PLC, readable and alive, has not set enable */
    bool lost;        /* a loss happened: permit resume or a new enable edge is needed */
    uint32_t hold_us; /* time spent in HOLD */
};

/* out: as after power-on: STANDBY, nothing lost */
void cb_mode_start(struct cb_mode_state *state);

/* in : elapsed_us since the last step; max_hold_us
 * out: the new mode and reason in *state
 * One pure function for each state; a fault precedes all but STOPPED. Losses and the permission
 * after a loss: docs/decisions/0004-enable.md. */
void cb_mode_step(struct cb_mode_state *state, const struct cb_mode_events *events,
                  uint32_t elapsed_us, uint32_t max_hold_us);

const char *cb_mode_name(uint8_t mode);
const char *cb_reason_text(uint8_t reason);

#endif
