/* SPDX-License-Identifier: MIT
 * The section "terms" in memory: one struct for each kind of term, the outputs, and the grids that
 * curves share. Coefficients are offsets into the pool of struct cb_config. */
#ifndef COMPBOX_FIRMWARE_CONFIG_TERM_H
#define COMPBOX_FIRMWARE_CONFIG_TERM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"
#include "models/adapt.h"
#include "models/sigma.h"

/* A curve of one signal. Pool layout: B-spline and polyline: breaks[spans+1], coefficients
 * [spans*(degree+1)]; polynomial: coefficients[degree+1]. With reversal_mm > 0 it is the branch for
 * a rising position, and branches[backward] is the branch for a falling one. */
struct cb_curve_config {
    uint8_t signal; /* index of its signal */
    uint8_t degree;
    uint16_t spans;                             /* polynomial: 1 */
    uint16_t pool;                              /* offset of the first float */
    uint8_t backward;                           /* index into branches, where reversal_mm > 0 */
    float spans_per_unit;                       /* see cb_ppoly */
    float center, inverse_half_range, from, to; /* polynomial only */
    float reversal_mm; /* distance of a reversal from one branch to the other; 0: no branches */
};

/* Signals that a term uses: config->links[link + i]. */
struct cb_term_inputs {
    uint16_t link;
    uint8_t count;
};

/* A weighted sum of signals. Pool: weights[inputs.count], constant. With a bank it sums the columns
 * of that; pool: weights[outputs][columns], bias[outputs]. */
struct cb_linear_config {
    struct cb_term_inputs inputs;
    uint16_t pool;
    bool has_bank;
    uint8_t bank; /* index into banks */
};

/* A bank: each input to each of its powers, with each time constant. A column is one of these
 * products, in the order: inputs, for each its powers, for each the time constants. Each column
 * with a time constant is a lag of its own. */
struct cb_bank_config {
    struct cb_term_inputs inputs; /* … behind them the powers of each: bit p - 1 of links[link +
                                     count + i] */
    uint16_t taus;                /* pool: taus_count time constants, s, ascending */
    uint16_t ranges;              /* pool: where `trained`, a cb_training_range of each input */
    uint16_t lags;                /* its first lag in struct cb_bank_state */
    uint8_t taus_count;
    bool unlagged; /* the first time constant is 0: the input itself */
    bool trained;
    uint8_t outputs, directions; /* of its term; of its sigma */
    uint16_t sigma;              /* pool: floor_um[outputs], along_um[outputs], offsets[directions],
                                    weights[directions][columns] */
    uint32_t model; /* check sum of weights, biases and sigma, not 0; 0: no sigma is stated */
};
_Static_assert(CB_MAX_DIRECTIONS == (int)CB_SIGMA_DIRECTIONS, "as models/ has room for");

/* Another term's output times (signal - origin). */
struct cb_product_config {
    uint8_t output; /* index into outputs: the slope */
    uint8_t signal;
    float origin; /* unit of the signal */
};

/* Pool: cb_bpnet_floats() weights; a cb_training_range of each input. */
struct cb_bpnet_config {
    struct cb_term_inputs inputs;
    uint8_t hidden;
    bool linear;
    uint16_t weights, ranges;
};

/* Pool: a struct cb_volumetric; constant tool length. */
struct cb_volumetric_config {
    uint8_t signals[4]; /* positions of X, Y, Z; tool length, or CB_NONE */
    bool complete;      /* no error is CB_NONE */
    uint8_t error[18];  /* outputs of the errors in the order of cb_volumetric_state; or CB_NONE */
    uint16_t pool;
};

/* Another term's output, adapted by probes. As large as a curve: a term is no larger. */
struct cb_adapt_config {
    struct cb_adapt_settings settings;
    uint8_t output;     /* index into outputs: the model */
    uint8_t signals[2]; /* the probed value, µm; the count of probes, uint16 */
    uint8_t measures;   /* CB_ADAPT_WHOLE or 0, plus the channel */
};
enum {
    CB_ADAPT_WHOLE = 0x80,   /* the probed value is the whole error, as without compensation */
    CB_ADAPT_NOWHERE = 0x7F, /* instead of a channel: no sum has the term; only with WHOLE */
};
_Static_assert(sizeof(struct cb_adapt_config) <= sizeof(struct cb_curve_config), "no larger");
_Static_assert((int)CB_MAX_CHANNELS < (int)CB_ADAPT_NOWHERE, "a channel fits in beside WHOLE");

/* out: the channel whose sum has the term; CB_NONE: there is none */
static inline uint8_t cb_adapt_channel(const struct cb_adapt_config *adapt) {
    const uint8_t channel = adapt->measures & CB_ADAPT_NOWHERE;
    return channel == CB_ADAPT_NOWHERE ? (uint8_t)CB_NONE : channel;
}

static inline bool cb_adapt_is_whole(const struct cb_adapt_config *adapt) {
    return (adapt->measures & CB_ADAPT_WHOLE) != 0;
}

/* A term comes after those whose outputs it uses, whatever their order in the file. */
struct cb_term_config {
    uint8_t type;         /* enum cb_term_type (terms/kinds.h) */
    uint8_t first_output; /* index into outputs; the term's outputs are consecutive */
    uint8_t outputs;      /* >= 1 */
    union {
        struct cb_curve_config curve;
        struct cb_linear_config linear;
        struct cb_product_config product;
        struct cb_bpnet_config bpnet;
        struct cb_volumetric_config volumetric;
        struct cb_adapt_config adapt;
    } as;
};

/* Terms of type B-spline or polyline without branches, which most are. Derived: terms with the same
 * signal, breaks and degree are adjacent and share a grid, so that one search finds the span for
 * all of them. */
struct cb_grid {
    uint8_t signal, degree;
    uint8_t curves;       /* number of its entries in config->plain_curves, after the previous
                             grid's */
    uint8_t term;         /* its first term, whose breaks are searched */
    float spans_per_unit; /* see cb_ppoly, as the next two */
    uint16_t spans;
    uint16_t breaks; /* offset in the pool */
};
struct cb_plain_curve {
    uint16_t coefficients; /* offset in the pool */
    uint8_t term, output;
};

struct cb_output_config {
    char name[CB_NAME_SIZE]; /* a one-output term's own name, or a name from its "outputs" */
    uint8_t term;
};

#endif
