/* SPDX-License-Identifier: MIT
 *
 * Invariants, for each channel with slew rate s, period P, limit L, register unit u:
 *
 *   (1) |o| <= L                          for every output o;
 *   (2) |o - h| <= s min(t - t_h, 2P)     for every value h that the PLC may hold, written by the
 *                                         step at t_h; plus u if a step allows less than u;
 *   (3) |a - b| <= D                      for the two channels of a pair;
 *   (4) |o - o'| <= S                     for outputs at most W apart in time, if the control has a
 *                                         largest step S (profile.h); and |o - n| <= S if the PLC
 *                                         reports (applied) that the NC has n.
 *
 * Rules. Let q be the last output, of time t - d, and [m, M] the interval of all values that the
 * PLC may hold. The new output o satisfies
 *
 *   (A) |o - q| <= s min(d, 2P)          (B) M - 2Ps <= o <= m + 2Ps          (C) (1) and (3)
 *
 * Why (2) follows. Every h was once an output, q = h at t_h. The outputs since then went from h
 * to o in steps that obey (A), whose sum is at most s (t - t_h); with (B) it is at most
 * s min(t - t_h, 2P), whichever of the writes in between took effect.
 *
 * Why a solution always exists: q is one. It satisfied (B) and (C) in its step, and since then the
 * interval has grown by q alone. So "stay" is always allowed, and every rule below only shortens
 * a movement that starts at q:
 *   - (1), (A), (B) are intervals that contain q, so clamping to one preserves the others;
 *   - (3): let target and q both satisfy it. Each channel ends between its q and its target. If the
 *     difference then is too large, exactly one of the two moved in the direction that widens it
 *     (had both, the targets would differ by even more); this one stops where the difference is D,
 *     which is between its q and where it was.
 * A pair is written in one request, so what the PLC holds of it is always the outputs of one step.
 *
 * (4) has two parts. The loader has lowered s to (S - u) / W, so outputs W apart differ by s W + u
 * <= S, whichever of them the NC takes over. The distance to n gives one more interval. It contains
 * q as long as the NC takes over the PLC's values; after the PLC itself has moved n away, q stays
 * or comes nearer.
 *
 * The grid. A register holds whole units. An output moves by whole units and never further than
 * (A) allows; the remainder is carried to the next step, so that a ramp keeps its rate. If (A)
 * allows less than one unit, steps accumulate until a unit is reached: q + carry obeys (A), and the
 * output follows it at less than a unit's distance, hence the u in (2).
 *
 * All sums are float32, so "allowed" means within SLACK of the numbers involved: 15.00 + 15.00 is
 * 30.00 and not one unit less. (1) is exact: targets are inside the limit, and no output passes its
 * target.
 *
 * Late writes. A write without a reply may take effect after a later one was confirmed, because its
 * bytes wait in the PLC on an old connection. Let T be cb_limiter_late_us(). The write may take
 * effect until the PLC's program was seen running for T, or until the PLC served requests (its
 * program runs, or it confirms writes) for 2T. So its value leaves [m, M] only with a confirmed
 * write that was sent after that. Every such value was once an output, so (2) follows as for the
 * others. A confirmation before that time does not extend [m, M], so "stay" remains allowed.
 *
 * Arrival. Late writes are kept by turns of 2T of service. Those of a turn leave [m, M] when the
 * next turn ends, however many follow them. So an output that (B) holds back moves on by 2Ps after
 * two turns at the latest, also while the PLC's program is stopped or every other write has no
 * reply: while writes are confirmed, (B) holds no output for ever.
 *
 * Final bound. bounded() is the last operation on every output. It replaces a value that is not
 * finite by the last one sent; no output is beyond max(L, |last one sent|) or beyond the ceiling.
 * In a sound box it changes nothing. It does not depend on the earlier stages.
 *
 * After a reload (adopt.c) q may be outside the new limits. The output then moves towards them at
 * the slew rate: the clamps below always admit q. */
#include "firmware/box/limiter.h"

#include "firmware/base/assert.h"
#include "firmware/config/config.h"
#include "firmware/config/grid.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Rounding of a few float32 operations, relative. */
static const float SLACK = 2.0f * FLT_EPSILON; /* 2^-22 */

/* From here on float32 does not resolve single units of an int32. */
static const float LARGEST_GRID = 2147483648.0f; /* 2^31 */

/* in : from_um, on the grid; um, any float
 * out: the last grid value between from_um and um; um itself without a grid, or beyond
 *      LARGEST_GRID */
static float grid_before(float unit_um, float um, float from_um) {
    if (!(unit_um > 0.0f) || !(cb_abs(um) < LARGEST_GRID * unit_um)) return um;
    const float slack_um = (cb_abs(um) + cb_abs(from_um)) * SLACK;
    int32_t units = cb_round(um / unit_um);
    const float beyond_um = (float)units * unit_um - um;
    if (um >= from_um && beyond_um > slack_um) --units;
    if (um < from_um && -beyond_um > slack_um) ++units;
    return (float)units * unit_um;
}

uint32_t cb_limiter_late_us(const struct cb_config *config) {
    const uint64_t us =
        (uint64_t)config->plc.heartbeat_timeout_ms * 1000u + 2u * (uint64_t)config->period_us;
    return us < UINT32_MAX ? (uint32_t)us : UINT32_MAX;
}

/* Sets the interval of possible values to low … high; if `late`, it includes the late writes
 * too. */
static void holds(struct cb_channel_state *state, float low_um, float high_um, bool late) {
    state->possible_min_um = low_um;
    state->possible_max_um = high_um;
    if (!late) return;
    state->possible_min_um = cb_min(low_um, cb_min(state->late_min_um, state->older_min_um));
    state->possible_max_um = cb_max(high_um, cb_max(state->late_max_um, state->older_max_um));
}

/* out: left_us less passed_us, at least 0 */
static uint32_t left_of(uint32_t left_us, uint32_t passed_us) {
    return passed_us < left_us ? left_us - passed_us : 0;
}

/* Counts late_us and turn_us down. At the end of a turn the next one begins without late writes;
 * those of the turn that ended are kept until the next one ends. */
static void age_late(struct cb_channel_state *state, uint32_t lived_us, uint32_t served_us,
                     uint32_t turn_us) {
    state->late_us = left_of(state->late_us, lived_us);
    state->turn_us = left_of(state->turn_us, served_us);
    if (state->turn_us > 0) return;
    state->older_min_um = state->late_min_um;
    state->older_max_um = state->late_max_um;
    state->late_min_um = FLT_MAX;
    state->late_max_um = -FLT_MAX;
    state->turn_us = turn_us;
}

/* The last write had no reply: its value is possible now, and late for late_us. */
static void unanswered(struct cb_channel_state *state, uint32_t late_us) {
    const float sent_um = state->sent_um;
    if (state->late_us == 0) {
        state->late_min_um = state->older_min_um = sent_um;
        state->late_max_um = state->older_max_um = sent_um;
        state->turn_us = 2u * late_us;
    }
    state->late_min_um = cb_min(state->late_min_um, sent_um);
    state->late_max_um = cb_max(state->late_max_um, sent_um);
    state->late_us = late_us;
    holds(state, state->possible_min_um, state->possible_max_um, true);
}

void cb_limiter_written(const struct cb_config *config, struct cb_channel_state *channels,
                        enum cb_transfer result, uint32_t elapsed_us, bool alive) {
    const uint32_t late_us = cb_limiter_late_us(config), lived_us = alive ? elapsed_us : 0;
    const uint32_t served_us = result == CB_TRANSFER_OK ? elapsed_us : lived_us;
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        struct cb_channel_state *state = &channels[i];
        const bool late = state->late_us > 0; /* when the write was sent */
        if (result == CB_TRANSFER_OK) holds(state, state->sent_um, state->sent_um, late);
        if (late) age_late(state, lived_us, served_us, 2u * late_us);
        if (result == CB_TRANSFER_UNKNOWN) unanswered(state, late_us);
    }
}

/* out: true if upper_um is more than `most` above lower_um */
static bool too_far(float upper_um, float lower_um, float most) {
    return upper_um - lower_um > most + (cb_abs(upper_um) + cb_abs(lower_um)) * SLACK;
}

static bool apart(float a_um, float b_um, float most) {
    return too_far(a_um, b_um, most) || too_far(b_um, a_um, most);
}

/* in : two targets, each inside its own limit
 * out: targets within the pair's difference. Both change by the same amount if their limits permit,
 *      so the centre of the stage does not move. */
static void give_way(const struct cb_config *config, const struct cb_pair_config *pair, float *a_um,
                     float *b_um) {
    const float most = pair->max_difference_um;
    const float a_most = config->channels[pair->b].top_um + most;
    const float b_most = config->channels[pair->a].top_um + most;
    *a_um = cb_clamp(*a_um, -a_most, a_most);
    *b_um = cb_clamp(*b_um, -b_most, b_most);
    const float excess = cb_abs(*a_um - *b_um) - most;
    if (!(excess > 0.0f)) return;
    const float give = *a_um > *b_um ? 0.5f * excess : -0.5f * excess;
    *a_um -= give;
    *b_um += give;
}

/* in : two targets on their grids, after rounding more than `most` apart
 * out: the one of larger size is moved towards the other, so it stays inside its limit */
static void take_back(float a_unit_um, float b_unit_um, float most, float *a_um, float *b_um) {
    const float way = *a_um > *b_um ? most : -most;
    if (cb_abs(*a_um) > cb_abs(*b_um))
        *a_um = grid_before(a_unit_um, *b_um + way, *b_um);
    else
        *b_um = grid_before(b_unit_um, *a_um - way, *a_um);
}

/* in : targets on the grid, each inside its limit
 * out: the same, and targets of pairs within their difference */
static void join_targets(const struct cb_config *config, struct cb_counters *counters,
                         float *target_um) {
    for (unsigned i = 0; i < config->pairs_count; ++i) {
        const struct cb_pair_config *pair = &config->pairs[i];
        const float most = pair->max_difference_um;
        const struct cb_channel_config *a = &config->channels[pair->a];
        const struct cb_channel_config *b = &config->channels[pair->b];
        float *a_um = &target_um[pair->a], *b_um = &target_um[pair->b];
        if (!apart(*a_um, *b_um, most)) continue;
        ++counters->pairs_limited;
        give_way(config, pair, a_um, b_um);
        *a_um = cb_channel_nearest(a, *a_um);
        *b_um = cb_channel_nearest(b, *b_um);
        if (apart(*a_um, *b_um, most)) take_back(a->unit_um, b->unit_um, most, a_um, b_um);
    }
}

/* The interval of the next output by (A), (B), (1) and (4); it contains the last output. */
struct room {
    float low_um, high_um;
};

/* out: the interval of one channel; without (B) and (4) if the output will not be written */
static struct room room_of(const struct cb_channel_config *channel,
                           const struct cb_channel_state *state, const struct cb_motion *motion) {
    const float unit_um = channel->unit_um;
    const float allowed_um = channel->slew_um_per_s * motion->elapsed_s;
    /* below one unit goal_um() enforces (A): it moves no further than allowed */
    const float step_um = allowed_um < unit_um ? 2.0f * unit_um : allowed_um;
    const float last_um = state->output_um;
    struct room room = {last_um - step_um, last_um + step_um};
    if (motion->writing) {
        const float reach_um = cb_max(channel->slew_um_per_s * motion->max_s, unit_um);
        room.low_um = cb_max(room.low_um, state->possible_max_um - reach_um);
        room.high_um = cb_min(room.high_um, state->possible_min_um + reach_um);
        if (channel->step_um > 0.0f) {
            room.low_um = cb_max(room.low_um, state->applied_um - channel->step_um);
            room.high_um = cb_min(room.high_um, state->applied_um + channel->step_um);
        }
    }
    room.low_um = cb_min(cb_max(room.low_um, -channel->top_um), last_um);
    room.high_um = cb_max(cb_min(room.high_um, channel->top_um), last_um);
    return room;
}

/* out: the next output by its rate alone, before rounding and limits */
static float goal_um(const struct cb_channel_config *channel, const struct cb_channel_state *state,
                     float target_um, const struct cb_motion *motion) {
    const float slew = channel->slew_um_per_s, ramp = motion->ramp_um_per_s;
    const bool ramps = ramp > 0.0f && !channel->is_slope; /* a slope is not in µm */
    const float step_um = (ramps ? cb_min(ramp, slew) : slew) * motion->elapsed_s;
    const float rest_um = target_um - state->output_um - state->carry_um;
    if (cb_abs(rest_um) <= step_um) return target_um;
    return state->output_um + (state->carry_um + (rest_um > 0.0f ? step_um : -step_um));
}

/* out: the next output of one channel, on the grid, before the rule of pairs */
static float next_um(const struct cb_channel_config *channel, const struct cb_channel_state *state,
                     float goal, const struct cb_motion *motion) {
    const struct room room = room_of(channel, state, motion);
    const float inside_um = cb_clamp(goal, room.low_um, room.high_um);
    return grid_before(channel->unit_um, inside_um, state->output_um);
}

/* out: rest of the way to the goal, if it is less than a unit; 0 for an output that a limit
 *      stopped */
static float carry_um(float unit_um, float goal, float output_um) {
    const float rest_um = goal - output_um;
    return cb_abs(rest_um) < unit_um ? rest_um : 0.0f;
}

/* Rule (3) for a pair whose upper channel is more than `most` above the lower one: the channel
 * whose movement widened the difference stops earlier.
 * in : upper, lower, with the last outputs; *upper_um, *lower_um, the next ones */
static void wait_for_other(float upper_unit_um, float lower_unit_um, float most,
                           const struct cb_channel_state *upper,
                           const struct cb_channel_state *lower, float *upper_um, float *lower_um) {
    if (*upper_um > upper->output_um) {
        const float stop_um = grid_before(upper_unit_um, *lower_um + most, upper->output_um);
        *upper_um = cb_max(upper->output_um, stop_um);
    } else if (*lower_um < lower->output_um) {
        const float stop_um = grid_before(lower_unit_um, *upper_um - most, lower->output_um);
        *lower_um = cb_min(lower->output_um, stop_um);
    }
}

/* in : next outputs of all channels, before the rule of pairs
 * out: those of pairs within their difference, if their last outputs were */
static void join_outputs(const struct cb_config *config, const struct cb_channel_state *channels,
                         float *output_um) {
    for (unsigned i = 0; i < config->pairs_count; ++i) {
        const struct cb_pair_config *pair = &config->pairs[i];
        const float most = pair->max_difference_um;
        const struct cb_channel_state *a = &channels[pair->a], *b = &channels[pair->b];
        const float a_unit_um = config->channels[pair->a].unit_um;
        const float b_unit_um = config->channels[pair->b].unit_um;
        float *a_um = &output_um[pair->a], *b_um = &output_um[pair->b];
        if (too_far(*a_um, *b_um, most))
            wait_for_other(a_unit_um, b_unit_um, most, a, b, a_um, b_um);
        else if (too_far(*b_um, *a_um, most))
            wait_for_other(b_unit_um, a_unit_um, most, b, a, b_um, a_um);
        /* only if a unit is coarser than the difference: both stay */
        if (apart(*a_um, *b_um, most) && !apart(a->output_um, b->output_um, most)) {
            *a_um = a->output_um;
            *b_um = b->output_um;
        }
    }
}

/* in : um, any float beyond the limit: the output is still outside after a reload, or it is wrong
 * out: as bounded() */
CB_OUTLINE float force_inside(const struct cb_config *config,
                              const struct cb_channel_config *channel,
                              const struct cb_channel_state *state, float um) {
    const float finite_um = cb_is_finite(um) ? um : state->sent_um;
    const float own_um = cb_max(channel->limit_um, cb_abs(state->sent_um));
    const float ceiling_um = config->ceiling_um;
    const float most_um = ceiling_um > 0.0f ? cb_min(own_um, ceiling_um) : own_um;
    if (cb_abs(finite_um) <= most_um) return finite_um;
    return grid_before(channel->unit_um, cb_clamp(finite_um, -most_um, most_um), 0.0f);
}

/* The last operation on an output; it does not depend on the earlier stages.
 * in : um, any float; state->sent_um finite
 * out: finite; |result| <= max(limit, |sent_um|) and <= the site's ceiling. top_um is within both,
 *      because cb_ceiling_apply() has lowered it. */
static float bounded(const struct cb_config *config, const struct cb_channel_config *channel,
                     const struct cb_channel_state *state, float um) {
    return cb_abs(um) <= channel->top_um ? um : force_inside(config, channel, state, um);
}

void cb_limiter_step(const struct cb_config *config, struct cb_channel_state *channels,
                     struct cb_counters *counters, const float *target_um,
                     const struct cb_motion *motion) {
    float target[CB_MAX_CHANNELS], goal[CB_MAX_CHANNELS], output[CB_MAX_CHANNELS];
    CB_ASSERT(motion->elapsed_s >= 0.0f);
    CB_ASSERT(motion->elapsed_s <= motion->max_s);
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        target[i] = cb_channel_nearest(&config->channels[i], target_um[i]);
    join_targets(config, counters, target);
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        goal[i] = goal_um(&config->channels[i], &channels[i], target[i], motion);
        output[i] = next_um(&config->channels[i], &channels[i], goal[i], motion);
    }
    join_outputs(config, channels, output);
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        output[i] = bounded(config, &config->channels[i], &channels[i], output[i]);
        channels[i].output_um = output[i];
        channels[i].carry_um = carry_um(config->channels[i].unit_um, goal[i], output[i]);
        if (motion->writing) channels[i].sent_um = output[i];
        counters->outputs_slewed += output[i] != target[i];
    }
}

/* out: true if the box itself may have written the start value, perhaps within another file's
 *      limits; if the value is not certain, true for the value sent last */
static bool is_own(const struct cb_config *config, const struct cb_channel_state *channels,
                   const struct cb_start *start, unsigned index) {
    const struct cb_channel_config *channel = &config->channels[index];
    const struct cb_channel_state *state = &channels[index];
    const float um = start[index].um;
    const float unit_um = cb_channel_raw_unit_um(channel);
    const float low_um = state->possible_min_um, high_um = state->possible_max_um;
    /* from the values sent, never from the reading: an infinite reading widens nothing */
    const float slack_um = unit_um + cb_max(cb_abs(low_um), cb_abs(high_um)) / CB_FINEST_GRID;
    if (!start[index].certain) return um == state->sent_um;
    return um >= low_um - slack_um && um <= high_um + slack_um;
}

/* out: true if the start values of a pair are further apart than permitted, but not those sent
 *      last: another client wrote one of the two. Both outputs are within 2Ps of what the PLC may
 *      hold (B), so neither moves by more when they are forced together. */
static bool is_torn_apart(const struct cb_pair_config *pair,
                          const struct cb_channel_state *channels, const struct cb_start *start) {
    const float most = pair->max_difference_um;
    return apart(start[pair->a].um, start[pair->b].um, most) &&
           !apart(channels[pair->a].sent_um, channels[pair->b].sent_um, most);
}

/* out: as is_own(); for a channel of a pair only if both are, and one request may have written
 *      them */
static bool pair_is_own(const struct cb_config *config, const struct cb_channel_state *channels,
                        const struct cb_start *start, unsigned index) {
    if (!is_own(config, channels, start, index)) return false;
    for (unsigned i = 0; i < config->pairs_count; ++i) {
        const struct cb_pair_config *pair = &config->pairs[i];
        const unsigned other = pair->a == index ? pair->b : pair->a;
        if (pair->a != index && pair->b != index) continue;
        if (!is_own(config, channels, start, other) || is_torn_apart(pair, channels, start))
            return false;
    }
    return true;
}

/* out: place_um[channels]. The box's own values stay, so no output steps when contact returns after
 *      a reload; they move inside the limits and the pair's difference later, at the slew rate.
 *      Other values are forced inside. */
static void place(const struct cb_config *config, const struct cb_channel_state *channels,
                  const struct cb_start *start, float *place_um) {
    struct cb_counters ignored = {0};
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        place_um[i] = cb_channel_nearest(&config->channels[i], start[i].um);
    join_targets(config, &ignored, place_um);
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        if (pair_is_own(config, channels, start, i)) place_um[i] = start[i].um;
}

void cb_limiter_place(const struct cb_config *config, struct cb_channel_state *channels,
                      const struct cb_start *start) {
    float place_um[CB_MAX_CHANNELS];
    place(config, channels, start, place_um);
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        struct cb_channel_state *state = &channels[i];
        const float low_um = start[i].certain ? place_um[i] : state->possible_min_um;
        const float high_um = start[i].certain ? place_um[i] : state->possible_max_um;
        state->output_um = state->sent_um = place_um[i];
        holds(state, cb_min(low_um, place_um[i]), cb_max(high_um, place_um[i]), state->late_us > 0);
        state->carry_um = 0.0f;
    }
}
