/* SPDX-License-Identifier: MIT
 * Terms: functions of signals; and how a term fades when a signal of its is missing. */
#ifndef COMPBOX_FIRMWARE_TERMS_TERMS_H
#define COMPBOX_FIRMWARE_TERMS_TERMS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/config/config.h"
#include "firmware/signals/signals.h"
#include "models/direction.h"

struct cb_term_state {
    struct cb_direction direction; /* of a curve with two branches */
    bool directed;                 /* … which has been started */
    bool live;                     /* its signals are all fresh: values are computed */
    uint16_t span;                 /* of a B-spline or polyline: where it was last found */
};

struct cb_terms_verdict {
    bool degraded;     /* a term is not live, or a model weakened far outside its training range */
    bool extrapolated; /* a model has an input outside its training range */
};

/* in : config, complete but for what config.h calls derived of terms
 * out: that too. The loader ends with it, and cb_box_start() repeats it, as cb_config_derive(). */
void cb_terms_derive(struct cb_config *config);

/* out: *count indices of the signals that a term looks at, and of the outputs of other terms that
 * it uses; or CB_NONE */
const uint8_t *cb_term_signals(const struct cb_config *config, const struct cb_term_config *term,
                               unsigned *count);
const uint8_t *cb_term_used(const struct cb_term_config *term, unsigned *count);

/* true for a curve that has a branch for each direction. */
bool cb_term_has_branches(const struct cb_term_config *term);

/* in : signals aged; fade_um: how far an output of a term that is not live goes towards zero;
 *      outputs of the step before, 0 in the first
 * out: outputs[config->outputs_count], all finite
 * A term whose result is not finite, or that uses a term which is not live, is treated as one whose
 * signal is missing; the first is counted. */
struct cb_terms_verdict cb_terms_evaluate(const struct cb_config *config,
                                          const struct cb_signal_state *signals,
                                          struct cb_term_state *states,
                                          struct cb_counters *counters, float fade_um,
                                          float *outputs);

/* in : signals, states and outputs as cb_terms_evaluate() left them in this step
 * out: slopes[config->outputs_count]: d output / d signal, µm (µrad) per its unit, finite; 0 for a
 *      term that is not live, outside of a curve, and for whatever does not depend on the signal
 *      itself (a lag of it is another signal) */
void cb_terms_slopes(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *states, const float *outputs, uint8_t signal,
                     float *slopes);

#endif
