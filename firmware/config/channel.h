/* SPDX-License-Identifier: MIT
 * The sections "channels" and "pairs" in memory: the registers, limits and rates of each output. */
#ifndef COMPBOX_FIRMWARE_CONFIG_CHANNEL_H
#define COMPBOX_FIRMWARE_CONFIG_CHANNEL_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"

/* wanted_um = -sum of outputs; written = sign * wanted_um / scale, as `type`. */
struct cb_channel_config {
    char name[CB_NAME_SIZE];
    uint8_t sum[CB_MAX_SUM]; /* indices of outputs */
    uint8_t sum_count;       /* >= 1 */
    uint8_t type;            /* enum cb_number_type */
    int8_t sign;             /* +1 or -1: found by a sign test at commissioning */
    bool has_applied;        /* the PLC returns the applied value, same type, scale and sign; both
                                channels of a pair or none */
    bool is_slope;           /* not a channel of the file, but the slope of one, µm/m */
    bool tangent;            /* it has slope and reference besides its value */
    uint8_t slope;           /* tangent: index of the channel that is its slope */
    uint8_t tangent_signal;  /* tangent: index of its axis' position */
    uint8_t reference_type;  /* tangent: enum cb_number_type */
    uint16_t reference_reg;  /* tangent: index in the write block */
    float reference_scale;   /* tangent: mm per unit of that register; > 0 */
    uint16_t reg;            /* index in the write block */
    uint16_t applied_reg;    /* index in the read block */
    float limit_um;          /* > 0: |output| never exceeds it */
    float error_um;          /* >= limit: a demand beyond it is a FAULT */
    float slew_um_per_s;     /* > 0: |change| <= slew * min(elapsed, 2 periods) */
    float deadband_um;       /* >= 0: smaller changes are not written */
    float step_um;           /* > 0: maximum distance from the PLC's applied value */
    float scale;             /* µm per unit of the register; > 0 */
    /* derived (grid.h) */
    float unit_um; /* one unit of the register; 0 where it is as fine as float32 */
    float most_um; /* the limit, or just inside it */
    float top_um;  /* the largest value within the limit that the register can represent */
};

/* Two motors of one stage: maximum difference of their outputs. */
struct cb_pair_config {
    uint8_t a, b;            /* indices of channels, a != b */
    float max_difference_um; /* > 0 */
};

#endif
