/* SPDX-License-Identifier: MIT
 * Check of the values that the PLC reports as applied against the values that were sent. */
#ifndef COMPBOX_FIRMWARE_BOX_APPLIED_H
#define COMPBOX_FIRMWARE_BOX_APPLIED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/box/limiter.h"

struct cb_config;

/* The PLC may follow with a delay of four quarters (config->applied_quarter_us): it may apply any
 * value that was sent in this time. */
enum {
    CB_SENT_SLOTS = 5,      /* those quarters, and the current one */
    CB_BEYOND_READINGS = 2, /* successive readings far beyond the sent values that are a fault */
};

/* A channel with `applied`. All values are in µm. */
struct cb_applied_channel {
    float sent_min_um[CB_SENT_SLOTS]; /* the values sent in each quarter, the newest one first */
    float sent_max_um[CB_SENT_SLOTS];
    /* Time for which `applied` was outside of them, at most two quarters. A quarter of the time
     * inside is subtracted, so that a flickering value counts. */
    uint32_t outside_us;
    uint8_t beyond; /* successive readings beyond error_um */
    /* The tangent that was sent last, where the PLC interpolates. */
    float line_um, line_slope_um_per_m, line_reference_mm;
};

/* A channel whose value is not the box's. */
struct cb_applied_verdict {
    bool unapplied;  /* outside of all values sent in that time, for longer than a quarter */
    bool foreign;    /* in CB_BEYOND_READINGS successive readings beyond error_um plus a unit, and
                        beyond all values sent in that time */
    uint8_t channel; /* its index, a foreign one first; CB_NONE: there is none */
    float value_um;  /* the value that the PLC reported */
};

struct cb_applied_state {
    uint32_t slot_us; /* age of the newest quarter */
    struct cb_applied_channel channels[CB_MAX_CHANNELS];
    struct cb_applied_verdict verdict; /* of the last good reading */
};

/* Call once in each step: records the outputs that were sent last, and compares the applied values.
 * in : reference_mm: P0 of each channel as sent last; registers of the read block, of a good
 *      reading, or NULL; elapsed_us since the previous step; judged: the PLC has to follow, because
 *      the box is ACTIVE
 * out: channels[].applied_um, if the value is finite; state->verdict over all channels; without a
 *      good reading both stay
 * A value that is not finite counts as foreign. With `tangent` the value is K0, which the PLC
 * reports for the reference of the same block, so it is compared like any other. A PLC that moves
 * in a straight line (interpolate_us) comes from the tangent before: where that one is at the new
 * reference counts as sent, too. */
void cb_applied_step(const struct cb_config *config, struct cb_applied_state *state,
                     struct cb_channel_state *channels, const float *reference_mm,
                     struct cb_counters *counters, const uint16_t *registers, uint32_t elapsed_us,
                     bool judged);

#endif
