/* SPDX-License-Identifier: MIT
 * A kind of term as a value: its keys in the file, and functions that load it and compute its value
 * and slope. Each kind has one file of this folder and one line in kinds.h. */
#ifndef COMPBOX_FIRMWARE_TERMS_KIND_H
#define COMPBOX_FIRMWARE_TERMS_KIND_H

#include "firmware/config/config.h"
#include "firmware/json/reader.h"
#include "firmware/terms/terms.h"

/* First slots and fields of every kind of term; its own follow. */
enum { CB_TERM_NAME, CB_TERM_TYPE, CB_TERM_COMMON_KEYS };
#define CB_TERM_COMMON_FIELDS                                                                     \
    [CB_TERM_NAME] = {"name", CB_FIELD_STRING, true, CB_NOT_STORED}, [CB_TERM_TYPE] = {           \
                                                                         "type", CB_FIELD_STRING, \
                                                                         true, CB_NOT_STORED}

/* Remarks on a value; 0: none. */
enum {
    CB_TERM_MISSING = 1,      /* a signal or a term that it uses is missing: no value */
    CB_TERM_OUTSIDE = 2,      /* x is outside of a curve, whose value is that at its end */
    CB_TERM_EXTRAPOLATED = 4, /* a model has an input outside its training range */
    CB_TERM_WEAKENED = 8,     /* … so far outside that its weight is below 1 */
};

/* The parts of a box that a term reads in one step. */
struct cb_evaluation {
    const struct cb_config *config;
    const struct cb_signal_state *signals;
    const struct cb_bank_state *bank;
    const struct cb_term_state *states; /* earlier terms: of this step; others: of the last */
    const float *outputs;               /* likewise */
    bool all_live;                      /* every earlier term of this step is live */
    float fade_um; /* the way of an output that fades or ramps in this step, >= 0 */
};

/* Slopes by one signal, after all terms of the step. */
struct cb_slope_pass {
    struct cb_evaluation e;
    uint8_t signal;      /* the variable of differentiation */
    const float *slopes; /* of the outputs of earlier terms */
};

/* `count` indices at `offset` in struct cb_term_config; an absent one is CB_NONE. */
struct cb_term_list {
    uint16_t offset;
    uint8_t count;
};
#define CB_TERM_LIST(member) \
    { offsetof(struct cb_term_config, member), sizeof((struct cb_term_config){0}.member) }

/* An object inside the term's object. */
struct cb_term_part {
    const char *name; /* in "$defs" of docs/coefficients.schema.json; NULL ends a list */
    const struct cb_object *object;
};

struct cb_term_kind {
    struct cb_object object;           /* its keys; simple fields are stored in term->as */
    const struct cb_term_part *parts;  /* NULL: none */
    const struct cb_curve_kind *curve; /* of a curve of one signal (curves.h), else NULL */
    struct cb_term_list signals;       /* that its value uses; offset 0: none; count 0: a struct
                                          cb_term_inputs */
    struct cb_term_list uses;          /* outputs of other terms; count 0: none */
    const char *uses_key;              /* names these outputs */
    uint8_t outputs; /* slot of the list of its outputs' names; 0, or an absent list: one output,
                        named as the term */

    /* in : at, the term, its outputs named; slots of its keys, simple fields stored
     * out: *term complete but for links; or false and a message */
    bool (*load)(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term);
    /* Finds the outputs that it uses, after all terms are loaded. NULL: it uses none.
     * in : at, the value of uses_key */
    bool (*link)(struct cb_loader *loader, uint32_t at, struct cb_term_config *term);
    /* out: remarks, and value[term->outputs] unless they contain CB_TERM_MISSING */
    uint8_t (*value)(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value);
    /* Keeps the outputs of a term that fades inside of its own bounds. NULL: it has none.
     * in : output[term->outputs], after this step's way to zero */
    void (*hold)(const struct cb_evaluation *e, const struct cb_term_config *term, float *output);
    /* in : a live term; slope[term->outputs], all 0
     * out: d output / d signal, as cb_terms_slopes() */
    void (*slope)(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope);
};

/* out: true if the output was computed in this step */
static inline bool cb_output_is_live(const struct cb_evaluation *e, uint8_t output) {
    return e->states[e->config->output_terms[output]].live;
}

/* out: index of pass->signal among the inputs; their count if it is none of them */
static inline unsigned cb_input_of(const struct cb_slope_pass *pass,
                                   const struct cb_term_inputs *inputs) {
    unsigned i = 0;
    while (i < inputs->count && pass->e.config->links[inputs->link + i] != pass->signal) ++i;
    return i;
}

#endif
