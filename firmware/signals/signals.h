/* SPDX-License-Identifier: MIT
 * Signals: from raw numbers to plausible values of known age, and the lead. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_SIGNALS_H
#define COMPBOX_FIRMWARE_SIGNALS_SIGNALS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/cause.h"
#include "firmware/base/counters.h"
#include "firmware/base/io.h"
#include "firmware/config/config.h"
#include "models/lag.h"

struct cb_signal_state {
    float value;       /* last accepted value, unit of the signal */
    float velocity;    /* unit/s, of signals that lead: filtered differences of their readings */
    float used;        /* what the terms see in this step: value, or value with its lead */
    struct cb_lag lag; /* of signals that are lags */
    int64_t time_us;   /* when it was accepted; of PLC signals: read_us; of lags: their signal's */
    bool known;        /* a value was ever accepted since start or clock jump */
    bool fresh;        /* known and not older than its maximum age, in this step */
    bool settled;      /* of lags: it has begun, in the steady state of its first value */
    uint8_t streak;    /* bits below; none: the last good reading brought nothing for it */
    uint8_t refusal;   /* enum cb_cause_kind: why the last number was refused; NONE: it was not */
    float refused;     /* … and that number, unit of the signal */
    uint32_t implausible, stale; /* its share of samples_implausible and signals_stale */
};

/* It is not fresh in this step. Counted when it was in the one before. */
static inline void cb_signal_goes_stale(struct cb_signal_state *state,
                                        struct cb_counters *counters) {
    counters->signals_stale += state->fresh;
    state->stale += state->fresh;
    state->fresh = false;
}

enum {
    CB_STREAK_BEGUN = 1, /* of PLC signals: accepted in the last good reading … */
    CB_STREAK_GOES = 2,  /* … and in the one before; of lags: it has gone along with the last good
                            reading, and is inside min … max */
};

/* A velocity from readings further apart than this many periods means nothing. */
enum { CB_LEAD_PERIODS = 3 };

/* What the PLC signals of one step have in common. */
struct cb_reading {
    int64_t since_us; /* > 0: from the good reading before to this one; else 0, or no such pair */
    bool plain;       /* every plain signal is fresh and has its value of this step */
};

/* Forgets all values: nothing is known, every velocity is 0. Counts the fresh ones as stale. Lags
 * keep their memory: the next value takes them over the time between. */
void cb_signals_forget(const struct cb_config *config, struct cb_signal_state *states,
                       struct cb_counters *counters);

/* Of two good readings in a row, at most three periods apart. */
struct cb_apart {
    int64_t elapsed_us; /* between them; 0: there are no such two */
    float per_s;        /* one over the time between the positions that they show; 0: they show the
                           same */
    bool counted;       /* by the PLC's heartbeat (lead.h), else by the clock */
};

/* Takes what *in brings: the samples, and the PLC signals where `read` says that the reading is
 * good. A value that is not finite, outside min … max by more than rounding explains, or too far
 * from the last accepted one for max_rate and the time between (one raw unit is allowed for
 * quantisation) is counted and not accepted: the last one serves on. apart: of this reading and the
 * one before, for velocities.
 * out: values within min … max */
struct cb_reading cb_signals_accept(const struct cb_config *config, struct cb_signal_state *states,
                                    struct cb_counters *counters, const struct cb_inputs *in,
                                    bool read, struct cb_apart apart, int64_t now_us);

/* in : *reading as cb_signals_accept() has said in this step; lead_us: how far ahead positions are
 * to be evaluated Sets fresh and used of every signal for now_us, after its lags have followed
 * (lags.h); what went stale is counted once. out: true when every essential signal is fresh */
bool cb_signals_age(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, const struct cb_reading *reading,
                    uint32_t lead_us, int64_t now_us);

#endif
