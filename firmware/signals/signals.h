/* SPDX-License-Identifier: MIT
 * Signals: from raw numbers to plausible values of known age, and the lead. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_SIGNALS_H
#define COMPBOX_FIRMWARE_SIGNALS_SIGNALS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/cause.h"
#include "firmware/base/counters.h"
#include "firmware/base/io.h"
#include "firmware/config/signal.h"
#include "models/lag.h"

struct cb_config;

struct cb_signal_state {
    float value;       /* last accepted value, unit of the signal */
    float velocity;    /* unit/s, of leading signals: filtered differences of their readings */
    float used;        /* value for the terms in this step: with its lead, if it leads */
    struct cb_lag lag; /* of signals that are lags */
    int64_t time_us;   /* time of acceptance; of PLC signals: read_us; of lags: their signal's */
    bool known;        /* a value was accepted since start or clock jump */
    bool fresh;        /* known and not older than its maximum age, in this step */
    bool doubted;      /* contradicts the other sensors (sensors.h): not fresh, whatever its age */
    bool settled;      /* of lags: started, in the steady state of the first value */
    uint8_t streak;    /* bits below; none: the last good reading had no value for it */
    uint8_t refusal;   /* enum cb_cause_kind: reason for the last rejection; NONE: accepted */
    float refused;     /* the rejected number, unit of the signal */
    uint32_t implausible, stale; /* its share of samples_implausible and signals_stale */
    float expected;              /* of a doubted one, by the other sensors, within its range */
};

/* out: the value that its lags follow. What a doubted sensor reads would stay in them for hours
 * after it is trusted again. */
static inline float cb_signal_remembered(const struct cb_signal_state *state) {
    return state->doubted ? state->expected : state->value;
}

/* out: whether it has a plausible value that is not older than its maximum age */
static inline bool cb_signal_is_recent(const struct cb_signal_config *signal,
                                       const struct cb_signal_state *state, int64_t now_us) {
    return state->known && now_us - state->time_us <= (int64_t)signal->max_age_ms * 1000;
}

/* Marks it as not fresh in this step. Counts it if it was fresh in the previous one. */
static inline void cb_signal_goes_stale(struct cb_signal_state *state,
                                        struct cb_counters *counters) {
    counters->signals_stale += state->fresh;
    state->stale += state->fresh;
    state->fresh = false;
}

enum {
    CB_STREAK_BEGUN = 1, /* of PLC signals: accepted in the last good reading … */
    CB_STREAK_GOES = 2, /* … and in the one before; of lags: it has followed the last good reading,
                           and is inside min … max */
};

/* Beyond this many periods between readings, their velocity is meaningless. */
enum { CB_LEAD_PERIODS = 3 };

/* Common facts of the PLC signals in one step. */
struct cb_reading {
    int64_t since_us; /* > 0: time between the previous good reading and this one; else no such
                         pair */
    bool plain;       /* every plain signal is fresh and has its value of this step */
};

/* Forgets all values and velocities. Counts the fresh signals as stale. Lags keep their memory: the
 * next value moves them over the time between. */
void cb_signals_forget(const struct cb_config *config, struct cb_signal_state *states,
                       struct cb_counters *counters);

/* Two consecutive good readings, at most three periods apart. */
struct cb_apart {
    int64_t elapsed_us; /* between them; 0: no such pair */
    float per_s;        /* 1 / time between their positions; 0: the positions are the same */
    bool counted;       /* measured by the PLC's heartbeat (lead.h), else by the clock */
};

/* Accepts the samples of *in, and the PLC signals if `read` marks the reading as good. A value is
 * counted and rejected if it is not finite, outside min … max by more than rounding, or too far
 * from the last accepted one for max_rate and the elapsed time (plus one raw unit for
 * quantisation). The last accepted value then remains in use. apart: of this reading and the one
 * before, for velocities.
 * out: values within min … max */
struct cb_reading cb_signals_accept(const struct cb_config *config, struct cb_signal_state *states,
                                    struct cb_counters *counters, const struct cb_inputs *in,
                                    bool read, struct cb_apart apart, int64_t now_us);

/* in : *reading from cb_signals_accept() of this step; lead_us: lead of positions
 * out: fresh and used of every signal at now_us, after its lags have followed (lags.h); each signal
 *      that went stale is counted once. Result: true when every essential signal is fresh */
bool cb_signals_age(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, const struct cb_reading *reading,
                    uint32_t lead_us, int64_t now_us);

#endif
