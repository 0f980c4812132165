/* SPDX-License-Identifier: MIT
 *
 * What must hold, for each channel with slew rate s, period P, limit L, register unit u:
 *
 *   (1) |o| <= L                          for every output o;
 *   (2) |o - h| <= s min(t - t_h, 2P)     for every value h that the PLC may hold, put there by the
 *                                         step at t_h; plus u where a step allows less than u;
 *   (3) |a - b| <= D                      for the two channels of a pair;
 *   (4) |o - o'| <= S                     for outputs at most W apart, where the control has a
 *                                         largest step S (profile.h); and |o - n| <= S where the
 *                                         PLC says (applied) that the NC has n.
 *
 * Rules. Let q be the last output, made d = t - t_q ago, and [m, M] the interval that holds every
 * value the PLC may hold. The new output o is chosen with
 *
 *   (A) |o - q| <= s min(d, 2P)          (B) M - 2Ps <= o <= m + 2Ps          (C) (1) and (3)
 *
 * Why (2) follows. Every h was once an output, q = h at t_h. The outputs since then went from h
 * to o in steps that obey (A), whose sum is at most s (t - t_h); with (B) it is at most
 * s min(t - t_h, 2P). It does not matter which of the writes between arrived.
 *
 * Why a choice always exists: q itself. It satisfied (B) and (C) when it was made, and the interval
 * since grew by nothing but q. So "stay" is always allowed, and every rule below only shortens
 * a movement that starts at q:
 *   - (1), (A), (B) are intervals that hold q, so clamping to them keeps the rest;
 *   - (3): let target and q both satisfy it. Each channel ends between its q and its target. If the
 *     difference then is too large, exactly one of the two moved in the direction that widens it
 *     (had both, the targets would differ by even more); this one stops where the difference is D,
 *     which is between its q and where it was.
 * A pair is written in one request, so what the PLC holds of it is always the outputs of one step.
 *
 * (4) is two rules. The loader has lowered s to (S - u) / W, so outputs W apart differ by
 * s W + u <= S, whichever of them the NC takes over. The distance to n is one more interval to
 * clamp to. It holds q as long as the NC takes what the PLC gives it; when the PLC has moved n away
 * by itself, q stays or comes nearer.
 *
 * The grid. A register holds whole units. An output moves by whole units and never further than
 * (A) allows; what is left is carried to the next step, so that a ramp keeps its rate. Where (A)
 * allows less than one unit, one unit is taken once steps have earned it: q + carry obeys (A),
 * and the output follows it at less than a unit's distance, hence the u in (2).
 *
 * All sums are float32: "allowed" is meant to SLACK of the numbers involved, so that 15.00 + 15.00
 * is 30.00 and not one unit less. (1) is exact: targets are chosen inside, and none is passed.
 *
 * Late writes. A write without an answer may take effect after a later one was confirmed: its bytes
 * wait in the PLC behind a new connection. Let T be cb_limiter_late_us(). The write may take effect
 * until the PLC's program was seen running for T, or the PLC served requests (its program runs, or
 * it confirms writes) for 2T. So its value leaves [m, M] only with a confirmed write that was sent
 * after that. Every such value was once an output, so (2) follows for it as for the others; and a
 * confirmation that leaves it in [m, M] only keeps what was there, so "stay" holds.
 *
 * Arrival. Late writes are kept by turns of 2T of service. Those of a turn leave [m, M] when the
 * next turn ends, however many come after them. So an output that (B) holds back moves on by 2Ps
 * after two turns at the latest, also while the PLC's program is stopped or every other write gets
 * no answer: while writes are confirmed, (B) holds no output for ever.
 *
 * Last word. bounded() is the last operation on every output: a value that is not finite becomes
 * the last one that was sent, and no output is beyond max(L, |last one sent|) nor beyond the
 * ceiling. In a sound box it changes nothing; it holds whatever the stages before it do.
 *
 * After a reload (adopt.c) q may lie outside new limits. The output then moves towards them at
 * the slew rate, and the clamps below let q be.
 */
#include "firmware/box/limiter.h"

#include "firmware/base/assert.h"
#include "firmware/config/grid.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Rounding of a few float32 operations, relative. */
static const float SLACK = 2.0f * FLT_EPSILON; /* 2^-22 */

/* From here on a float32 has no room for single units of an int32. */
static const float LARGEST_GRID = 2147483648.0f; /* 2^31 */

/* out: the last grid value on the way from `from_um` (on the grid) to um */
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

/* The PLC holds a value in the interval low … high; late: or that of a late write. */
static void holds(struct cb_channel_state *state, float low_um, float high_um, bool late) {
    state->possible_min_um = low_um;
    state->possible_max_um = high_um;
    if (!late) return;
    state->possible_min_um = cb_min(low_um, cb_min(state->late_min_um, state->older_min_um));
    state->possible_max_um = cb_max(high_um, cb_max(state->late_max_um, state->older_max_um));
}

static uint32_t left_of(uint32_t left_us, uint32_t passed_us) {
    return passed_us < left_us ? left_us - passed_us : 0;
}

/* The next turn begins without late writes; those of the last one are kept until it ends. */
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

/* Whether upper is more than `most` above lower. */
static bool too_far(float upper_um, float lower_um, float most) {
    return upper_um - lower_um > most + (cb_abs(upper_um) + cb_abs(lower_um)) * SLACK;
}

static bool apart(float a_um, float b_um, float most) {
    return too_far(a_um, b_um, most) || too_far(b_um, a_um, most);
}

/* Brings two targets, each inside its own limit, within the pair's difference: both give way by the
 * same amount where their limits let them, so that the centre of the stage stays where it was. */
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

/* in : two targets on their grids that rounding left more than `most` apart
 * out: the larger one is taken back towards the other: so it stays inside its limit */
static void take_back(float a_unit_um, float b_unit_um, float most, float *a_um, float *b_um) {
    const float way = *a_um > *b_um ? most : -most;
    if (cb_abs(*a_um) > cb_abs(*b_um))
        *a_um = grid_before(a_unit_um, *b_um + way, *b_um);
    else
        *b_um = grid_before(b_unit_um, *a_um - way, *a_um);
}

/* in : targets on the grid, inside the limits of value
 * out: those of pairs also within their difference, still on the grid */
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

/* The interval that (A), (B) and (1) leave to the next output; it holds the last one. */
struct room {
    float low_um, high_um;
};

static struct room room_of(const struct cb_channel_config *channel,
                           const struct cb_channel_state *state, const struct cb_motion *motion) {
    const float unit_um = channel->unit_um;
    const float allowed_um = channel->slew_um_per_s * motion->elapsed_s;
    /* below one unit, goal_um() is what keeps (A): it moves no further than allowed */
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

/* Where the unrounded output would go by its rate alone. */
static float goal_um(const struct cb_channel_config *channel, const struct cb_channel_state *state,
                     float target_um, const struct cb_motion *motion) {
    const float slew = channel->slew_um_per_s, ramp = motion->ramp_um_per_s;
    const bool ramps = ramp > 0.0f && !channel->is_slope; /* which is in µm/s */
    const float step_um = (ramps ? cb_min(ramp, slew) : slew) * motion->elapsed_s;
    const float rest_um = target_um - state->output_um - state->carry_um;
    if (cb_abs(rest_um) <= step_um) return target_um;
    return state->output_um + (state->carry_um + (rest_um > 0.0f ? step_um : -step_um));
}

/* The next output of a channel by itself, on the grid. */
static float next_um(const struct cb_channel_config *channel, const struct cb_channel_state *state,
                     float goal, const struct cb_motion *motion) {
    const struct room room = room_of(channel, state, motion);
    const float inside_um = cb_clamp(goal, room.low_um, room.high_um);
    return grid_before(channel->unit_um, inside_um, state->output_um);
}

/* What is left of the way to the goal when it is less than a unit; an output that was held back
 * starts afresh. */
static float carry_um(float unit_um, float goal, float output_um) {
    const float rest_um = goal - output_um;
    return cb_abs(rest_um) < unit_um ? rest_um : 0.0f;
}

/* Rule (3), when the upper channel of a pair is more than `most` above the lower one: the one that
 * moved and widened it stops earlier. `upper` and `lower` are what the outputs were. */
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

/* in : next outputs of all channels, each by itself
 * out: pairs within their difference wherever the last outputs were */
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
        /* only where a unit is coarser than the difference: both stay */
        if (apart(*a_um, *b_um, most) && !apart(a->output_um, b->output_um, most)) {
            *a_um = a->output_um;
            *b_um = b->output_um;
        }
    }
}

/* An output that is not within the limit: one that comes inside after a reload, or a wrong one. */
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

/* The last word on an output, whatever the stages before it made of it.
 * in : um: any float; state: the last output that was sent is finite
 * out: finite; |result| <= max(limit, |last output sent|) and <= the site's ceiling. top_um is
 * within both: cb_ceiling_apply() has lowered it */
static float bounded(const struct cb_config *config, const struct cb_channel_config *channel,
                     const struct cb_channel_state *state, float um) {
    return cb_abs(um) <= channel->top_um ? um : force_inside(config, channel, state, um);
}

void cb_limiter_step(const struct cb_config *config, struct cb_channel_state *channels,
                     struct cb_counters *counters, const float *target_um,
                     const struct cb_motion *motion) {
    float target[CB_MAX_CHANNELS], goal[CB_MAX_CHANNELS], output[CB_MAX_CHANNELS];
    CB_ASSERT(motion->elapsed_s >= 0.0f && motion->elapsed_s <= motion->max_s);
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

/* What the box itself may have put there, as a register says it, perhaps under another file's
 * limits; where the PLC was not asked that is what it sent last. */
static bool is_own(const struct cb_config *config, const struct cb_channel_state *channels,
                   const struct cb_start *start, unsigned index) {
    const struct cb_channel_config *channel = &config->channels[index];
    const struct cb_channel_state *state = &channels[index];
    const float um = start[index].um;
    const float unit_um = cb_channel_raw_unit_um(channel);
    const float low_um = state->possible_min_um, high_um = state->possible_max_um;
    /* of the values that were sent, never of what was read: an infinite reading widens nothing */
    const float slack_um = unit_um + cb_max(cb_abs(low_um), cb_abs(high_um)) / CB_FINEST_GRID;
    if (!start[index].certain) return um == state->sent_um;
    return um >= low_um - slack_um && um <= high_um + slack_um;
}

/* One of a pair is the box's own value only where the other one is. By (B) both are then within 2Ps
 * of the last output that was sent, so they are no further apart than those and the two ways. */
static bool pair_is_own(const struct cb_config *config, const struct cb_channel_state *channels,
                        const struct cb_start *start, unsigned index) {
    if (!is_own(config, channels, start, index)) return false;
    for (unsigned i = 0; i < config->pairs_count; ++i) {
        const unsigned a = config->pairs[i].a, b = config->pairs[i].b;
        const unsigned other = a == index ? b : a;
        if ((a == index || b == index) && !is_own(config, channels, start, other)) return false;
    }
    return true;
}

/* Values of the box's own stay, so that nothing steps when the PLC is heard again after a reload;
 * they come inside the limits and the pair's difference later, at the slew rate. */
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
