/* SPDX-License-Identifier: MIT
 * Terms: functions of signals. A term whose signal is missing fades to zero. */
#ifndef COMPBOX_FIRMWARE_TERMS_TERMS_H
#define COMPBOX_FIRMWARE_TERMS_TERMS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/signals/bank.h"
#include "firmware/signals/signals.h"
#include "models/direction.h"

struct cb_config;
struct cb_term_config;

/* Bias and gain of an adapted term: in use, and the ones that it moves to at the ramp. */
struct cb_adapted {
    float bias_um, gain;
    float to_bias_um, to_gain;
};

struct cb_term_state {
    union {
        struct cb_direction direction; /* of a curve with two branches */
        struct cb_adapted adapted;     /* of a term of type adapt */
    };
    bool directed; /* `direction` is initialised */
    bool live;     /* all its signals are fresh: its outputs are computed */
    uint16_t span; /* of a B-spline or polyline: that of the last x */
};

struct cb_terms_verdict {
    bool degraded;     /* a term is not live, or a model weakened far outside its training range */
    bool extrapolated; /* a model has an input outside its training range */
};

/* in : config, complete except for the fields of terms that config.h calls derived
 * out: these fields. The loader and cb_box_start() call it, after cb_config_derive(). */
void cb_terms_derive(struct cb_config *config);

/* out: *count indices of the signals that a term uses, of the outputs of other terms that it uses;
 *      an absent one is CB_NONE */
const uint8_t *cb_term_signals(const struct cb_config *config, const struct cb_term_config *term,
                               unsigned *count);
const uint8_t *cb_term_used(const struct cb_term_config *term, unsigned *count);

/* out: true for a curve with a branch for each direction */
bool cb_term_has_branches(const struct cb_term_config *term);

/* in : signals aged, and the lags of banks after them; fade_um >= 0, the step towards zero of an
 * output that is not live; outputs of the previous step, 0 in the first out:
 * outputs[config->outputs_count], all finite A term is not live if a signal is missing, a term that
 * it uses is not live, or its result is not finite; the last case is counted. */
struct cb_terms_verdict cb_terms_evaluate(const struct cb_config *config,
                                          const struct cb_signal_state *signals,
                                          const struct cb_bank_state *bank,
                                          struct cb_term_state *states,
                                          struct cb_counters *counters, float fade_um,
                                          float *outputs);

/* in : signals, states and outputs as cb_terms_evaluate() left them in this step
 * out: slopes[config->outputs_count]: d output / d signal, µm (µrad) per unit of the signal, finite
 * 0 for a term that is not live, outside of a curve, and for an output that does not depend on the
 * signal itself (a lag of it is another signal). */
void cb_terms_slopes(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *states, const float *outputs, uint8_t signal,
                     float *slopes);

#endif
