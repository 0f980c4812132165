/* SPDX-License-Identifier: MIT
 * State of a box that outlives a restart: the lags, those of banks too, what the probes adapted,
 * the PLC's last heartbeat, and how the run ended. compboxd stores it in a file
 * (hal/linux/daemon/state.h), and its recording of inputs begins with it. */
#ifndef COMPBOX_FIRMWARE_BOX_STATE_H
#define COMPBOX_FIRMWARE_BOX_STATE_H

#include "firmware/box/box.h"

/* One lag at one moment. */
struct cb_lag_state {
    struct cb_lag lag;
    int64_t time_us; /* of its last value; the clock of cb_box_step() */
    bool settled;    /* it has started: `lag` is valid */
};

/* All zero: a start without a state. */
struct cb_state {
    struct cb_lag_state lags[CB_MAX_SIGNALS]; /* by the index of their signal */
    struct cb_bank_state bank;
    struct cb_probe_state probes[CB_MAX_ADAPTS]; /* by config->adapts; not `timed`: no state */
    int64_t beat_us; /* time of plc_heartbeat; the clock of cb_box_step() */
    uint16_t plc_heartbeat;
    bool beat;    /* plc_heartbeat and beat_us are valid */
    bool stopped; /* the run ended STOPPED, and the PLC confirmed it */
};

/* Copies the box's lags, probes and the PLC's heartbeat during a run: `stopped` is false. */
void cb_state_take(struct cb_state *state, const struct cb_box *box);

/* in : the box of a run that has ended
 * out: true if the PLC holds STOPPED: from this run's last confirmed write, or from the previous
 *      run if this run wrote nothing */
bool cb_state_ended_stopped(const struct cb_box *box);

/* Restores the state into a box that was just started. A lag that is not settled stays
 * unchanged. */
void cb_state_give(const struct cb_state *state, struct cb_box *box);

#endif
