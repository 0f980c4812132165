/* SPDX-License-Identifier: MIT
 * What the PLC reports that it applies, and whether that is what it was given. */
#ifndef COMPBOX_FIRMWARE_BOX_APPLIED_H
#define COMPBOX_FIRMWARE_BOX_APPLIED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/counters.h"
#include "firmware/box/limiter.h"
#include "firmware/config/config.h"

/* The PLC has four quarters of time to follow (config->applied_quarter_us): the values that were
 * sent in it are all its own to apply. */
enum {
    CB_SENT_SLOTS = 5,      /* those quarters, and the one that has just begun */
    CB_BEYOND_READINGS = 2, /* in a row, before a value far beyond what was sent is a fault */
};

/* A channel with `applied`. All values are in µm. */
struct cb_applied_channel {
    float sent_min_um[CB_SENT_SLOTS]; /* the values sent in each quarter, the newest one first */
    float sent_max_um[CB_SENT_SLOTS];
    uint32_t
        outside_us; /* for how long applied was outside of them, at most two quarters; a quarter
                       of the time inside is taken off, so that a flickering value counts */
    uint8_t beyond; /* readings in a row beyond error_um */
};

/* A channel whose value is not the box's. */
struct cb_applied_verdict {
    bool unapplied;  /* outside of all that was sent in that time, for longer than a quarter */
    bool foreign;    /* beyond error_um and a unit in CB_BEYOND_READINGS readings in a row, and
                        beyond all that was sent of late */
    uint8_t channel; /* its index, the worst first; CB_NONE: there is none */
    float value_um;  /* what the PLC reported */
};

struct cb_applied_state {
    uint32_t slot_us; /* age of the newest quarter */
    struct cb_applied_channel channels[CB_MAX_CHANNELS];
    struct cb_applied_verdict verdict; /* of the last good reading */
};

/* Once in each step: takes note of the outputs that were sent last, and takes the values of a good
 * reading into channels[].applied_um, the finite ones.
 * in : registers of the read block; NULL: there is no good reading, and the verdict stays;
 *      elapsed_us since the step before; judged: the PLC has to follow (the box is ACTIVE)
 * A value that is not finite counts as foreign. Of a channel with `tangent` the value is K0, which
 * the PLC reports for the reference that it was sent with: so it is compared like any other. */
void cb_applied_step(const struct cb_config *config, struct cb_applied_state *state,
                     struct cb_channel_state *channels, struct cb_counters *counters,
                     const uint16_t *registers, uint32_t elapsed_us, bool judged);

#endif
