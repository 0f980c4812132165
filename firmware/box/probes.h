/* SPDX-License-Identifier: MIT
 * Probes: from a new count of a probe to one measurement of the model that it adapts.
 *
 * A probe of the control measures the error with the compensation as it was. What its term has to
 * explain is
 *
 *     probed value - output of the channel - other terms of its sum
 *
 * because errors are tool relative to workpiece and an output is the displacement of the tool. So
 * limits, RAMP and STANDBY need no special case. The output is the applied value, where the PLC
 * returns it, else the one that the PLC certainly holds. A term with "measures": "whole" leaves the
 * output out. */
#ifndef COMPBOX_FIRMWARE_BOX_PROBES_H
#define COMPBOX_FIRMWARE_BOX_PROBES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/box/applied.h"
#include "firmware/box/limiter.h"
#include "firmware/signals/signals.h"
#include "firmware/terms/sigma.h"
#include "firmware/terms/terms.h"
#include "models/adapt.h"

struct cb_config;

/* The probe of one term of type adapt. Counts wrap. */
struct cb_probe_state {
    int64_t grown_us; /* the time up to which the covariance has grown, where `timed` */
    struct cb_adapt filter;
    uint32_t taken;   /* probes that changed b and g */
    uint32_t asked;   /* probes outside of the gate, which ask for another one */
    uint32_t refused; /* probes that were early, implausible or not comparable */
    uint32_t skipped; /* counts without a measurement of their own: the count rose by more than
                         one */
    uint16_t count;   /* the last one, where `counted` */
    bool counted;     /* the signal `count` was fresh in the last step */
    bool timed;       /* grown_us is valid */
};

/* At the start: no probe, b = g = 0. */
void cb_probes_start(struct cb_probe_state *probes);

/* What a box knows of its outputs at a probe. */
struct cb_probe_outputs {
    const float *terms;                       /* of this step */
    const struct cb_channel_state *channels;  /* with the last outputs, before they move */
    const struct cb_sigma_state *sigma;       /* of this step */
    const struct cb_applied_channel *applied; /* what the PLC reports of them */
    bool known;    /* the PLC has the last outputs (limiter.h: between possible_min and _max) */
    bool reported; /* its readings are recent */
};

/* Call once in each step, after the terms and before the outputs move. A new count is one
 * measurement, also if it rose by more than one. The first count since the signal was missing is
 * only a reference.
 * in : signals, states of this step; probes[CB_MAX_ADAPTS], by the order of config->adapts
 * out: probes, and the targets of b and g in states. A probe is refused if its value is not fresh
 *      and plausible, its model or another term of the channel's sum is not live, or the output is
 *      not known within sigma_um: an applied value that is old or implausible is not. */
void cb_probes_step(const struct cb_config *config, const struct cb_signal_state *signals,
                    const struct cb_probe_outputs *outputs, struct cb_term_state *states,
                    struct cb_probe_state *probes, struct cb_counters *counters, int64_t now_us);

/* out: index in config->adapts of the first term whose probes differ from it to one side
 *      (cb_adapt_cusum); CB_NONE: there is none */
unsigned cb_probes_drifted(const struct cb_config *config, const struct cb_probe_state *probes);

/* in : the probe, sigma and outputs of one step; index in config->adapts; now_us, since that step
 * out: standard deviation of the term's value now, µm, by what its probe has not shown and by the
 *      model's own sigma */
float cb_probe_sigma(const struct cb_config *config, unsigned index,
                     const struct cb_probe_state *probe, const struct cb_sigma_state *sigma,
                     const float *outputs, int64_t now_us);

/* out: true if a probe waits for its repetition */
bool cb_probes_ask(const struct cb_config *config, const struct cb_probe_state *probes);

/* After a restart or reload.
 * in : state from a stored copy or another box, any bits, of the term with this index in
 *      config->adapts
 * out: *probe continues it, valid and inside of the term's bounds; the first count is a
 *      reference again */
void cb_probe_resume(const struct cb_config *config, unsigned index,
                     const struct cb_probe_state *state, struct cb_probe_state *probe);

#endif
