/* SPDX-License-Identifier: MIT
 * What the kinds of curves of one signal share: the branch for each direction, and pieces. */
#ifndef COMPBOX_FIRMWARE_TERMS_CURVES_H
#define COMPBOX_FIRMWARE_TERMS_CURVES_H

#include <stddef.h>

#include "firmware/terms/kind.h"
#include "models/ppoly.h"

#define CB_CURVE_AT(member) .offset = offsetof(struct cb_curve_config, member)

/* Of every curve as a term; behind them stand the keys of the curve itself, which make an object of
 * their own for the branch backward. */
enum {
    CB_CURVE_NAME,
    CB_CURVE_TYPE,
    CB_CURVE_SIGNAL,
    CB_CURVE_BACKWARD,
    CB_CURVE_REVERSAL,
    CB_CURVE_KEYS
};
#define CB_CURVE_FIELDS                                                                           \
    CB_TERM_COMMON_FIELDS, [CB_CURVE_SIGNAL] = {"signal", CB_FIELD_STRING, true, CB_NOT_STORED},  \
                           [CB_CURVE_BACKWARD] = {"backward", CB_FIELD_OBJECT, false,             \
                                                  CB_NOT_STORED},                                 \
                           [CB_CURVE_REVERSAL] = {                                                \
                               "reversal_mm",    CB_FIELD_FLOAT, false, CB_CURVE_AT(reversal_mm), \
                               .least = "0.001", .most = "1000"}

/* A kind of curve, beside its value as a kind of term. */
struct cb_curve_kind {
    struct cb_object backward; /* its keys without those above: the object of a branch backward */
    bool piecewise; /* it is a cb_ppoly: those on the same breaks are evaluated together */
    /* Reads its own keys from their slots into the pool and *curve. */
    bool (*load)(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_curve_config *curve);
    /* in : span: where x was last found, or NULL
     * out: value at x; its slope where span is NULL */
    struct cb_curve_value (*at)(const struct cb_config *config, const struct cb_curve_config *curve,
                                float x, uint16_t *span);
};

/* `load`, `value` and `slope` of every term that is a curve. */
bool cb_curve_load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   struct cb_term_config *term);
uint8_t cb_curve_evaluate(const struct cb_evaluation *e, const struct cb_term_config *term,
                          struct cb_term_state *state, float *value);
void cb_curve_slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                    const struct cb_term_state *state, float *slope);

/* `at` of a curve that is a cb_ppoly. */
struct cb_curve_value cb_piecewise_at(const struct cb_config *config,
                                      const struct cb_curve_config *curve, float x, uint16_t *span);

/* Stores the description of a ppoly that lies in the pool; fails at `at` where it overflows. */
bool cb_keep_ppoly(struct cb_loader *loader, uint32_t at, const struct cb_ppoly *ppoly,
                   struct cb_curve_config *curve);

#endif
