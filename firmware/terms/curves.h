/* SPDX-License-Identifier: MIT
 * What the kinds of curves share when they are loaded; for curves.c and polynomial.c.
 */
#ifndef COMPBOX_FIRMWARE_TERMS_CURVES_H
#define COMPBOX_FIRMWARE_TERMS_CURVES_H

#include <stddef.h>

#include "firmware/json/reader.h"

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
#define CB_CURVE_REVERSAL_FIELD                                                           \
    {                                                                                     \
        "reversal_mm", CB_FIELD_FLOAT, false, CB_CURVE_AT(reversal_mm), .least = "0.001", \
                                                                        .most = "1000"    \
    }

/* Reads the keys of one kind of curve from their slots into the pool and *curve. */
typedef bool cb_load_curve_fn(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                              struct cb_curve_config *curve);

/* A whole term that is a curve: its signal, itself by `load`, and its branch backward, an object of
 * the keys `backward`. */
bool cb_load_curve(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                   const struct cb_object *backward, cb_load_curve_fn *load,
                   struct cb_curve_config *curve);

#endif
