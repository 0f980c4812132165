/* SPDX-License-Identifier: MIT
 * A kind of term is a value: its keys in the file, how it is loaded, its value and its slope. Each
 * has one file of this folder, and its line in kinds.h. */
#ifndef COMPBOX_FIRMWARE_TERMS_KIND_H
#define COMPBOX_FIRMWARE_TERMS_KIND_H

#include "firmware/json/reader.h"
#include "firmware/terms/terms.h"

/* First slots and fields of every kind of term; its own follow. */
enum { CB_TERM_NAME, CB_TERM_TYPE, CB_TERM_COMMON_KEYS };
#define CB_TERM_COMMON_FIELDS                                                                     \
    [CB_TERM_NAME] = {"name", CB_FIELD_STRING, true, CB_NOT_STORED}, [CB_TERM_TYPE] = {           \
                                                                         "type", CB_FIELD_STRING, \
                                                                         true, CB_NOT_STORED}

/* Remarks on a value; none of them: all is well. */
enum {
    CB_TERM_MISSING = 1,      /* a signal or a term that it uses is missing: no value */
    CB_TERM_OUTSIDE = 2,      /* a curve is held at its end */
    CB_TERM_EXTRAPOLATED = 4, /* a model has an input outside its training range */
    CB_TERM_WEAKENED = 8,     /* … so far outside that its weight is below 1 */
};

/* The box in one step, as terms see it. */
struct cb_evaluation {
    const struct cb_config *config;
    const struct cb_signal_state *signals;
    const struct cb_term_state *states; /* of the terms before this one: of this step */
    const float *outputs;               /* likewise */
    bool all_live;                      /* so far every term of this step is live */
};

/* Slopes by one signal, after all terms of the step. */
struct cb_slope_pass {
    struct cb_evaluation e;
    uint8_t signal;      /* by which the slopes are */
    const float *slopes; /* of the outputs before this term */
};

/* `count` indices in struct cb_term_config, CB_NONE for what is absent. */
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
    struct cb_term_list signals;       /* that it looks at; count 0: a struct cb_term_inputs */
    struct cb_term_list uses;          /* outputs of other terms; count 0: none */
    const char *uses_key;              /* names these outputs */
    uint8_t outputs; /* slot of the list of its outputs' names; 0: one output, named as the term */

    /* Loads the term at `at` further: its outputs are named, slots are as its table says. */
    bool (*load)(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term);
    /* Finds the outputs that it uses, when all terms are loaded; at: value of uses_key. NULL where
     * it uses none. */
    bool (*link)(struct cb_loader *loader, uint32_t at, struct cb_term_config *term);
    /* out: value[term->outputs], unless it returns CB_TERM_MISSING; and remarks on it */
    uint8_t (*value)(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value);
    /* in : a live term; slope[term->outputs], all 0
     * out: d output / d signal, as cb_terms_slopes() */
    void (*slope)(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope);
};

/* true: the output is that of this step */
static inline bool cb_output_is_live(const struct cb_evaluation *e, uint8_t output) {
    return e->states[e->config->output_terms[output]].live;
}

/* out: index of the signal of the slopes among the inputs; or their count */
static inline unsigned cb_input_of(const struct cb_slope_pass *pass,
                                   const struct cb_term_inputs *inputs) {
    unsigned i = 0;
    while (i < inputs->count && pass->e.config->links[inputs->link + i] != pass->signal) ++i;
    return i;
}

#endif
