/* SPDX-License-Identifier: MIT
 * Tangent mode: the box writes K0, tan(beta) and P0 of a channel. In each of its interpolation
 * cycles the control applies K0 + tan(beta) (P - P0), with P the actual position (SINUMERIK
 * temperature compensation). P0 is the position of the evaluation, K0 the channel's output, and
 * tan(beta) = -dE/dP of all its terms by the position of its own axis, µm/mm, without the share of
 * other axes.
 *
 * A slope is a channel of its own behind those of the file, in µm/m, without terms. So it passes
 * the limiter (limiter.h) like every output, with its own limit and slew rate. Its target is zero
 * unless the box is ACTIVE and the channel inside its limit. */
#ifndef COMPBOX_FIRMWARE_BOX_TANGENT_H
#define COMPBOX_FIRMWARE_BOX_TANGENT_H

#include "firmware/box/channels.h"
#include "firmware/signals/signals.h"
#include "firmware/terms/terms.h"

struct cb_config;

/* State of all tangents. */
struct cb_tangent_state {
    float reference[CB_MAX_CHANNELS]; /* P0 of each channel, unit of its signal (mm) */
    float slopes[CB_MAX_OUTPUTS];     /* of the outputs by one signal: scratch */
};

/* in : terms evaluated, demands of the channels known
 * out: wanted_um of every slope, in µm/m, finite; P0 if the position is fresh; slopes beyond their
 *      limit are counted */
void cb_tangent_want(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *terms, const float *outputs,
                     struct cb_tangent_state *state, struct cb_channel_state *channels,
                     struct cb_counters *counters);

/* Puts every P0 into the write block. */
void cb_tangent_encode(const struct cb_config *config, const struct cb_tangent_state *state,
                       uint16_t *registers);

#endif
