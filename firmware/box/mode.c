/* SPDX-License-Identifier: MIT
 * The picture of this state machine is docs/mode.dot. */
#include "firmware/box/mode.h"

#include "firmware/base/assert.h"
#include "firmware/base/duration.h"

/* out: true if the PLC is readable, writable and alive, and every essential signal is fresh */
static bool healthy(const struct cb_mode_events *e) {
    return !e->loss && e->clock_ok && e->plc_ok && e->writes_ok && e->heartbeat_ok &&
           e->essentials_ok;
}

/* out: true if the PLC requests compensation; meaningless unless plc_ok */
static bool wanted(const struct cb_mode_events *e) {
    return e->enable && e->referenced;
}

/* out: true if the PLC is readable and no longer requests compensation */
static bool withdrawn(const struct cb_mode_events *e) {
    return e->plc_ok && !wanted(e);
}

/* out: true if all conditions of ACTIVE hold, after a loss with permission */
static bool may_run(const struct cb_mode_state *state, const struct cb_mode_events *e) {
    return healthy(e) && wanted(e) && !e->nc_alarm && !e->stop &&
           (!state->lost || e->permit_resume);
}

static bool may_end(const struct cb_mode_events *e) {
    return e->stop && e->all_zero && e->zero_written;
}

/* out: the first condition of ACTIVE that does not hold, in the order of a person's search */
static enum cb_reason missing(const struct cb_mode_state *state, const struct cb_mode_events *e) {
    if (e->stop) return CB_REASON_STOP;
    if (!e->clock_ok) return CB_REASON_CLOCK;
    if (!e->writes_ok) return CB_REASON_UNCONFIRMED;
    if (!e->plc_ok) return CB_REASON_NO_PLC;
    if (!e->heartbeat_ok) return CB_REASON_HEARTBEAT;
    if (!e->enable) return CB_REASON_NOT_ENABLED;
    if (!e->referenced) return CB_REASON_NOT_REFERENCED;
    if (!e->essentials_ok) return CB_REASON_SIGNAL;
    if (e->nc_alarm) return CB_REASON_NC;
    return state->lost ? CB_REASON_WAIT_ENABLE : CB_REASON_NONE;
}

static enum cb_reason remark(const struct cb_mode_events *e) {
    if (e->unapplied) return CB_REASON_UNAPPLIED;
    if (e->degraded) return CB_REASON_DEGRADED;
    if (e->limited) return CB_REASON_LIMITED;
    if (e->extrapolated) return CB_REASON_EXTRAPOLATED;
    return e->drifted ? CB_REASON_MODEL_DRIFTED : CB_REASON_NONE;
}

static enum cb_mode fault(struct cb_mode_state *state, uint8_t reason) {
    state->reason = reason;
    state->lost = true;
    return CB_MODE_FAULT;
}

static enum cb_mode active(struct cb_mode_state *state, const struct cb_mode_events *e) {
    if (e->foreign) return fault(state, CB_REASON_FOREIGN);
    if (e->excessive) return fault(state, CB_REASON_DEMAND);
    state->reason = (uint8_t)remark(e);
    state->lost = false;
    return CB_MODE_ACTIVE;
}

/* Enters or keeps a mode other than ACTIVE. out: the mode; state->reason, the missing condition */
static enum cb_mode wait_in(enum cb_mode mode, struct cb_mode_state *state,
                            const struct cb_mode_events *e) {
    state->reason = (uint8_t)missing(state, e);
    return mode;
}

static enum cb_mode step_standby(struct cb_mode_state *state, const struct cb_mode_events *e) {
    if (may_end(e)) return wait_in(CB_MODE_STOPPED, state, e);
    if (may_run(state, e)) return active(state, e);
    return wait_in(e->all_zero ? CB_MODE_STANDBY : CB_MODE_RAMP, state, e);
}

static enum cb_mode step_active(struct cb_mode_state *state, const struct cb_mode_events *e,
                                uint32_t max_hold_us) {
    /* an axis that is no longer referenced is a loss; a cleared enable is not */
    state->lost = !healthy(e) || (e->enable && !e->referenced);
    if (e->nc_alarm) return fault(state, CB_REASON_NC_ALARM);
    if (e->stop || withdrawn(e)) return wait_in(CB_MODE_RAMP, state, e);
    if (healthy(e)) return active(state, e);
    state->hold_us = 0;
    return wait_in(max_hold_us > 0 ? CB_MODE_HOLD : CB_MODE_RAMP, state, e);
}

static enum cb_mode step_hold(struct cb_mode_state *state, const struct cb_mode_events *e,
                              uint32_t elapsed_us, uint32_t max_hold_us) {
    state->hold_us = cb_add_us(state->hold_us, elapsed_us);
    if (may_run(state, e)) return active(state, e);
    const bool leave = e->stop || withdrawn(e) || state->hold_us >= max_hold_us;
    return wait_in(leave ? CB_MODE_RAMP : CB_MODE_HOLD, state, e);
}

static enum cb_mode step_ramp(struct cb_mode_state *state, const struct cb_mode_events *e) {
    state->lost = state->lost || !healthy(e);
    if (may_end(e)) return wait_in(CB_MODE_STOPPED, state, e);
    if (may_run(state, e)) return active(state, e);
    return wait_in(e->all_zero ? CB_MODE_STANDBY : CB_MODE_RAMP, state, e);
}

/* Keeps the reason of the fault until the PLC resets it. */
static enum cb_mode step_fault(struct cb_mode_state *state, const struct cb_mode_events *e) {
    const bool gone = e->fault == CB_REASON_NONE &&
                      !(state->reason == CB_REASON_DEMAND && e->excessive) &&
                      !(state->reason == CB_REASON_FOREIGN && e->foreign) &&
                      !(state->reason == CB_REASON_NC_ALARM && e->nc_alarm);
    state->lost = true;
    if (may_end(e)) return wait_in(CB_MODE_STOPPED, state, e);
    if (gone && e->plc_ok && e->reset_edge)
        return wait_in(e->all_zero ? CB_MODE_STANDBY : CB_MODE_RAMP, state, e);
    return CB_MODE_FAULT;
}

/* Contact may be lost before STOPPED is confirmed; then the outputs start from the PLC's value. */
static enum cb_mode step_stopped(struct cb_mode_state *state, const struct cb_mode_events *e) {
    if (e->all_zero) return CB_MODE_STOPPED;
    state->reason = CB_REASON_STOP;
    return CB_MODE_RAMP;
}

/* in : events of this step, elapsed_us since the previous one
 * out: the next mode; *state has its reason. A new fault precedes the functions of the states. */
static enum cb_mode next_mode(struct cb_mode_state *state, const struct cb_mode_events *e,
                              uint32_t elapsed_us, uint32_t max_hold_us) {
    const enum cb_mode mode = (enum cb_mode)state->mode;
    if (e->fault == CB_REASON_CONFIG_CORRUPT && mode != CB_MODE_STOPPED)
        return fault(state, e->fault); /* replaces the reason of an earlier fault */
    if (e->fault != CB_REASON_NONE && mode != CB_MODE_FAULT && mode != CB_MODE_STOPPED)
        return fault(state, e->fault);
    switch (mode) {
        case CB_MODE_STANDBY:
            return step_standby(state, e);
        case CB_MODE_ACTIVE:
            return step_active(state, e, max_hold_us);
        case CB_MODE_HOLD:
            return step_hold(state, e, elapsed_us, max_hold_us);
        case CB_MODE_RAMP:
            return step_ramp(state, e);
        case CB_MODE_FAULT:
            return step_fault(state, e);
        case CB_MODE_STOPPED:
            break;
    }
    return step_stopped(state, e);
}

void cb_mode_start(struct cb_mode_state *state) {
    *state = (struct cb_mode_state){.mode = CB_MODE_STANDBY, .reason = CB_REASON_NO_PLC};
}

void cb_mode_step(struct cb_mode_state *state, const struct cb_mode_events *events,
                  uint32_t elapsed_us, uint32_t max_hold_us) {
    CB_ASSERT(state->mode <= CB_MODE_STOPPED);
    state->lost = state->lost || events->loss;
    /* after a loss, when all is healthy again, a rising enable is the permission */
    if (healthy(events) && events->enable && !state->enable_was) state->lost = false;
    state->mode = (uint8_t)next_mode(state, events, elapsed_us, max_hold_us);
    state->enable_was = events->enable;
    /* with enable set nothing has to be searched */
    state->withheld = !events->enable && missing(state, events) == CB_REASON_NOT_ENABLED;
}

const char *cb_mode_name(uint8_t mode) {
    switch ((enum cb_mode)mode) {
#define CB_X(name, value, text) \
    case name:                  \
        return text;
        CB_MODES(CB_X)
#undef CB_X
    }
    return "a mode this version does not know";
}

const char *cb_reason_text(uint8_t reason) {
    switch ((enum cb_reason)reason) {
#define CB_X(name, value, text) \
    case name:                  \
        return text;
        CB_REASONS(CB_X)
#undef CB_X
    }
    return "a reason this version does not know";
}
