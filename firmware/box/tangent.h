/* SPDX-License-Identifier: MIT
 * Tangent mode: for a channel the control is given K0, tan(beta) and P0 and applies, in each of its
 * own interpolation cycles, K0 + tan(beta) (P - P0) with P the actual position (SINUMERIK
 * temperature compensation). P0 is where the box evaluated, K0 the channel's output, tan(beta) =
 * -dE/dP of all its terms by its own axis' position, µm/mm, without the share of other axes.
 *
 * A slope is a channel of its own behind those of the file, in µm/m, without terms: so it passes
 * the limiter (limiter.h) like everything that is written, with its own limit and slew. It is
 * wanted only while the box is ACTIVE and the channel inside its limit; else it goes to zero. */
#ifndef COMPBOX_FIRMWARE_BOX_TANGENT_H
#define COMPBOX_FIRMWARE_BOX_TANGENT_H

#include "firmware/box/channels.h"
#include "firmware/config/config.h"
#include "firmware/signals/signals.h"
#include "firmware/terms/terms.h"

/* What the box keeps for it. */
struct cb_tangent_state {
    float reference[CB_MAX_CHANNELS]; /* P0 of each channel, unit of its signal (mm) */
    float slopes[CB_MAX_OUTPUTS];     /* of the outputs by one signal: scratch */
};

/* in : terms evaluated, channels' demands known
 * out: wanted_um of every slope, in µm/m, finite; P0 where the position is fresh
 * Counts slopes that are wanted beyond their limit. */
void cb_tangent_want(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *terms, const float *outputs,
                     struct cb_tangent_state *state, struct cb_channel_state *channels,
                     struct cb_counters *counters);

/* Puts every P0 into the write block. */
void cb_tangent_encode(const struct cb_config *config, const struct cb_tangent_state *state,
                       uint16_t *registers);

#endif
