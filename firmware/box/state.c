/* SPDX-License-Identifier: MIT */
#include "firmware/box/state.h"

void cb_state_take(struct cb_state *state, const struct cb_box *box) {
    for (unsigned i = 0; i < CB_MAX_SIGNALS; i++) {
        const struct cb_signal_state *signal = &box->signals[i];
        state->lags[i] = (struct cb_lag_state){signal->lag, signal->time_us, signal->settled};
    }
    state->bank = box->bank;
    for (unsigned i = 0; i < CB_MAX_ADAPTS; i++) state->probes[i] = box->probes[i];
    state->beat_us = box->plc.read_us;
    state->plc_heartbeat = box->plc.plc_heartbeat;
    state->beat = box->plc.beat;
    state->stopped = false;
}

bool cb_state_ended_stopped(const struct cb_box *box) {
    return box->life.wrote ? box->life.stop_confirmed : box->life.stopped_before;
}

/* The terms continue with their bias and gain at once: the outputs begin at what the PLC has. */
static void give_probes(const struct cb_state *state, struct cb_box *box) {
    for (unsigned i = 0; i < box->config.adapts_count; i++) {
        struct cb_adapted *adapted = &box->terms[box->config.adapts[i]].adapted;
        if (!state->probes[i].timed) continue;
        cb_probe_resume(&box->config, i, &state->probes[i], &box->probes[i]);
        adapted->bias_um = adapted->to_bias_um = box->probes[i].filter.bias_um;
        adapted->gain = adapted->to_gain = box->probes[i].filter.gain;
    }
}

void cb_state_give(const struct cb_state *state, struct cb_box *box) {
    for (unsigned i = 0; i < box->config.signals_count; i++) {
        const struct cb_lag_state *lag = &state->lags[i];
        if (!lag->settled) continue;
        box->signals[i].lag = lag->lag;
        box->signals[i].time_us = lag->time_us;
        box->signals[i].settled = true;
    }
    box->bank = state->bank;
    give_probes(state, box);
    box->life.stopped_before = state->stopped;
    if (!state->beat) return;
    box->plc.beat = true;
    box->plc.plc_heartbeat = state->plc_heartbeat;
    box->plc.read_us = state->beat_us;
}
