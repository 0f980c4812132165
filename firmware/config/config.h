/* SPDX-License-Identifier: MIT
 * The coefficient file in the box's memory: plain data of fixed size, made by load/load.h and never
 * changed afterwards (the box verifies its check sum at run time).
 *
 * References are indices, coefficients are offsets into one pool, so that the whole may be copied
 * or placed anywhere. CB_NONE marks an absent index.
 *
 * Each section has a header of its own. Whoever needs only one includes that one; whoever passes a
 * configuration on declares `struct cb_config;`. */
#ifndef COMPBOX_FIRMWARE_CONFIG_CONFIG_H
#define COMPBOX_FIRMWARE_CONFIG_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"
#include "firmware/config/buses.h"
#include "firmware/config/channel.h"
#include "firmware/config/plc.h"
#include "firmware/config/sensors.h"
#include "firmware/config/signal.h"
#include "firmware/config/term.h"

/* Each step first checks the part from the front to plc.host as a whole: numbers, counts and lists
 * of indices. Of the arrays behind it, a step checks the entries in use. */
struct cb_config {
    uint32_t period_us;          /* 1 000 … 1 000 000 */
    uint32_t lead_us;            /* 0 … 500 000 */
    uint32_t hold_us;            /* maximum time in HOLD */
    uint32_t applied_quarter_us; /* derived: cb_profile_quarter_us() */
    float ramp_um_per_s;         /* > 0 */
    float ceiling_um;   /* > 0: the site's limit of every output, whatever the file allows; 0:
                           none */
    bool lead_measured; /* the box measures the lead (lead.h); lead_us is 0 */
    uint8_t signals_count, terms_count, outputs_count, channels_count, pairs_count;
    uint8_t lags_count, branches_count, buses_count, banks_count;
    uint8_t sensors_count; /* that check each other */
    uint8_t slopes_count;  /* slopes behind the channels_count channels of the file */
    uint16_t pool_count, links_count;
    uint16_t bank_lags_count; /* lags of all banks together */
    /* derived (derive.h) */
    uint8_t grids_count, other_terms_count, plain_count;
    uint16_t sigma_rows;               /* rows of banks in a step of terms/sigma.h; 0: none states a
                                          sigma */
    uint32_t plain_age_us;             /* the smallest maximum age of plain signals */
    uint8_t other_terms[CB_MAX_TERMS]; /* all terms except plain curves, in order */
    uint8_t adapts_count;
    uint8_t adapts[CB_MAX_ADAPTS];    /* terms of type adapt, in order */
    uint8_t measured[CB_MAX_SIGNALS]; /* all signals except lags, the plain_count plain ones last */
    struct cb_plc_config plc;

    /* derived */
    uint8_t output_terms[CB_MAX_OUTPUTS]; /* outputs[].term, close together */
    struct cb_grid grids[CB_MAX_TERMS];
    struct cb_plain_curve plain_curves[CB_MAX_TERMS];
    struct cb_lag_link lag_links[CB_MAX_SIGNALS];

    struct cb_signal_config signals[CB_MAX_SIGNALS];
    struct cb_term_config terms[CB_MAX_TERMS];
    struct cb_curve_config branches[CB_MAX_BRANCHES]; /* backward; as curves of terms */
    struct cb_bank_config banks[CB_MAX_BANKS];        /* of linear terms */
    struct cb_channel_config channels[CB_MAX_CHANNELS];
    struct cb_pair_config pairs[CB_MAX_PAIRS];
    struct cb_sensors_config sensors;
    uint32_t revision; /* no step uses the fields from here to outputs */
    char machine[40];
    struct cb_bus_config buses[CB_MAX_BUSES];
    struct cb_can_config can;
    uint8_t lags[CB_MAX_SIGNALS]; /* the lags, each after its signal, adjacent where they share a
                                     time constant and the order permits it */
    struct cb_output_config outputs[CB_MAX_OUTPUTS];
    uint8_t links[CB_MAX_LINKS];
    float pool[CB_POOL_FLOATS];
};

/* Number of channels and slopes: all outputs that pass the limiter. */
static inline unsigned cb_all_channels(const struct cb_config *config) {
    return (unsigned)config->channels_count + config->slopes_count;
}

#endif
