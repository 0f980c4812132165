/* SPDX-License-Identifier: MIT
 * One term by itself, of any type; for terms.c alone. */
#ifndef COMPBOX_FIRMWARE_TERMS_COMPUTE_H
#define COMPBOX_FIRMWARE_TERMS_COMPUTE_H

#include "firmware/terms/terms.h"

/* What a term says about its inputs; none of it: all is well. */
enum {
    CB_TERM_MISSING = 1,      /* a signal or a term that it looks at is not there: no value */
    CB_TERM_OUTSIDE = 2,      /* a curve is held at its end */
    CB_TERM_EXTRAPOLATED = 4, /* a model has an input outside its training range */
    CB_TERM_WEAKENED = 8,     /* … so far outside that its weight is below 1 */
};

/* What one step of all terms works with. */
struct cb_evaluation {
    const struct cb_config *config;
    const struct cb_signal_state *signals;
    const struct cb_term_state *states; /* of the terms before this one: of this step */
    const float *outputs;               /* likewise */
    bool all_live;                      /* so far every term of this step is live */
};

/* out: value[term->outputs], unless it says CB_TERM_MISSING; and remarks on it */
uint8_t cb_term_compute(const struct cb_evaluation *e, const struct cb_term_config *term,
                        struct cb_term_state *state, float *value);

#endif
