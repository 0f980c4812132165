/* SPDX-License-Identifier: MIT */
#include "firmware/box/box.h"

#include <string.h>

#include "firmware/base/assert.h"
#include "firmware/base/duration.h"
#include "firmware/config/derive.h"
#include "firmware/config/grid.h"
#include "firmware/wire/number.h"
#include "models/num.h"

/* Results of the stages of one step. */
struct step {
    uint32_t elapsed_us;   /* since the previous step; 0 if time went backward */
    bool jumped;           /* time went backward or too far forward */
    bool read;             /* this cycle's reading is good … */
    struct cb_apart apart; /* … and its distance from the previous one; elapsed_us 0: no such one */
    bool essentials_ok;    /* every essential signal is fresh */
    struct cb_terms_verdict terms;
    bool loss;   /* an earlier run was interrupted, or the PLC's outputs are unknown */
    bool placed; /* the outputs were set to the PLC's values: no movement in this step */
    struct cb_demand demand;
};

/* Sets everything except the configuration to the state after power-on. */
static void clear(struct cb_box *box) {
    memset((char *)box + sizeof box->config, 0, sizeof *box - sizeof box->config);
    cb_mode_start(&box->mode);
    cb_probes_start(box->probes);
    box->life.zero_written = true;
    box->foreign.channel = box->applied.verdict.channel = CB_NONE;
}

/* The counts bound all loops over arrays of the box, whatever loaded the configuration. */
static void assert_counts(const struct cb_config *config) {
    CB_ASSERT(config->signals_count <= CB_MAX_SIGNALS);
    CB_ASSERT(config->lags_count <= config->signals_count);
    CB_ASSERT(config->terms_count <= CB_MAX_TERMS);
    CB_ASSERT(config->outputs_count <= CB_MAX_OUTPUTS);
    CB_ASSERT(cb_all_channels(config) <= CB_MAX_CHANNELS);
    CB_ASSERT(config->banks_count <= CB_MAX_BANKS);
    CB_ASSERT(config->bank_lags_count <= CB_MAX_BANK_LAGS);
    CB_ASSERT(config->adapts_count <= CB_MAX_ADAPTS);
    CB_ASSERT(config->pairs_count <= CB_MAX_PAIRS);
    CB_ASSERT(config->plc.read.count <= CB_MAX_READ_REGISTERS);
    CB_ASSERT(config->plc.write.count <= CB_MAX_WRITE_REGISTERS);
    for (unsigned i = 0; i < config->pairs_count; ++i) {
        CB_ASSERT(config->pairs[i].a < config->channels_count);
        CB_ASSERT(config->pairs[i].b < config->channels_count);
    }
}

/* The registers of a number are in the block. */
static bool fits(const struct cb_block_config *block, unsigned reg, uint8_t type) {
    return reg + cb_number_registers((enum cb_number_type)type) <= block->count;
}

/* No step writes or reads behind a block of registers, or sums outputs that are not there. */
static void assert_channel(const struct cb_config *config,
                           const struct cb_channel_config *channel) {
    const struct cb_plc_config *plc = &config->plc;
    CB_ASSERT(channel->sum_count <= CB_MAX_SUM);
    for (unsigned k = 0; k < channel->sum_count; ++k)
        CB_ASSERT(channel->sum[k] < config->outputs_count);
    CB_ASSERT(fits(&plc->write, channel->reg, channel->type));
    if (channel->has_applied) CB_ASSERT(fits(&plc->read, channel->applied_reg, channel->type));
    if (!channel->tangent) return;
    CB_ASSERT(channel->slope < cb_all_channels(config));
    CB_ASSERT(channel->tangent_signal < config->signals_count);
    CB_ASSERT(fits(&plc->write, channel->reference_reg, channel->reference_type));
}

void cb_box_start(struct cb_box *box) {
    assert_counts(&box->config);
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i)
        assert_channel(&box->config, &box->config.channels[i]);
    clear(box);
    cb_config_derive(&box->config);
    cb_terms_derive(&box->config);
    cb_box_take_sums(box);
}

/* out: step->elapsed_us and step->jumped. After a jump readings, heartbeat and signals are
 *      invalid. */
static void keep_time(struct cb_box *box, int64_t now_us, struct step *step) {
    const int64_t gap_us = box->life.started ? now_us - box->life.now_us : 0;
    step->jumped = gap_us < 0 || gap_us > (int64_t)CB_CLOCK_PERIODS * box->config.period_us;
    step->elapsed_us = gap_us < 0 ? 0 : gap_us > UINT32_MAX ? UINT32_MAX : (uint32_t)gap_us;
    box->life.now_us = now_us;
    box->life.started = true;
    if (!step->jumped) return;
    ++box->counters.clock_jumps;
    cb_plc_forget(&box->plc);
    cb_signals_forget(&box->config, box->signals, &box->counters);
}

/* Leaky count of overruns: single ones are harmless, repeated ones a fault (CB_OVERRUN_FAULT). It
 * rises no further, so that a reset needs CB_OVERRUN_FORGIVES cycles in time, however many were
 * not. */
static void keep_score(struct cb_box *box, uint32_t missed_ticks) {
    box->counters.missed_ticks += missed_ticks;
    if (missed_ticks > 0) {
        box->life.good_cycles = 0;
        if (box->life.overrun_score < CB_OVERRUN_FAULT) ++box->life.overrun_score;
    } else if (++box->life.good_cycles >= CB_OVERRUN_FORGIVES) {
        box->life.good_cycles = 0;
        if (box->life.overrun_score > 0) --box->life.overrun_score;
    }
}

/* out: time since the previous step, at most the two periods in which a step may move outputs */
static uint32_t bounded_us(const struct cb_box *box, const struct step *step) {
    const uint32_t most_us = CB_STEP_PERIODS * box->config.period_us;
    return step->elapsed_us < most_us ? step->elapsed_us : most_us;
}

/* Processes the result of the last write. Without outputs to write it counts as NONE; an unknown
 * value counts as UNKNOWN. */
static void take_write(struct cb_box *box, uint8_t last_write, const struct step *step) {
    enum cb_transfer result =
        last_write > CB_TRANSFER_UNKNOWN ? CB_TRANSFER_UNKNOWN : (enum cb_transfer)last_write;
    if (!box->life.writing) result = CB_TRANSFER_NONE;
    cb_limiter_written(&box->config, box->channels, result, bounded_us(box, step), box->plc.alive);
    cb_plc_written(&box->config, &box->plc, &box->counters, result, step->elapsed_us,
                   box->life.now_us);
    if (result != CB_TRANSFER_OK) return;
    box->life.zero_written = cb_channels_hold_zero(&box->config, box->channels);
    box->life.stop_confirmed = box->life.sent_mode == CB_MODE_STOPPED;
}

enum cb_want cb_box_wants_held(const struct cb_box *box) {
    const struct cb_plc_state *plc = &box->plc;
    if (plc->contact != CB_CONTACT_KNOWN) return plc->parting ? CB_WANT_NOTHING : CB_WANT_NOW;
    if (plc->silent || plc->read_back_us < CB_READ_BACK_US) return CB_WANT_NOTHING;
    return CB_WANT_IF_ROOM;
}

/* out: start value of one output when contact is established: the applied value, if there is one;
 *      else the register's value, unless the PLC has restarted; else zero. `certain` is false if
 *      the PLC refuses the read-back: then it may still hold any of the possible values. */
static struct cb_start start_of(const struct cb_box *box, unsigned index,
                                const struct cb_inputs *in) {
    const struct cb_channel_config *channel = &box->config.channels[index];
    const float applied_um = cb_channel_decode(channel, in->registers + channel->applied_reg);
    const float held_um = cb_channel_decode(channel, in->held_registers + channel->reg);
    if (channel->has_applied && cb_is_finite(applied_um))
        return (struct cb_start){applied_um, true};
    if (in->held == CB_TRANSFER_OK && !box->plc.went_back && cb_is_finite(held_um))
        return (struct cb_start){held_um, true};
    return (struct cb_start){0.0f, in->held == CB_TRANSFER_OK};
}

/* out: true if the status register of the PLC has a mode other than STANDBY and STOPPED */
static bool was_at_work(const struct cb_box *box, const struct cb_inputs *in) {
    const unsigned mode = in->held_registers[box->config.plc.status] & 0xFFu;
    return mode != CB_MODE_STANDBY && mode != CB_MODE_STOPPED;
}

/* out: true if the contact is a loss, after which permission is needed: the status shows a run that
 *      was interrupted, or the PLC refuses the read-back */
static bool is_loss(const struct cb_box *box, const struct cb_inputs *in) {
    const bool first = box->plc.contact == CB_CONTACT_NONE;
    if (in->held == CB_TRANSFER_OK) return first && was_at_work(box, in);
    return !(first && box->life.stopped_before);
}

/* Establishes contact, if there is none, after a read-back that succeeded or was refused.
 * in : a good reading
 * out: the outputs are at the PLC's values and may be written; step->placed and step->loss */
static void find_plc(struct cb_box *box, const struct cb_inputs *in, struct step *step) {
    struct cb_start start[CB_MAX_CHANNELS];
    struct cb_plc_state *plc = &box->plc;
    if (plc->contact == CB_CONTACT_KNOWN) return;
    if (in->held != CB_TRANSFER_OK && in->held != CB_TRANSFER_REFUSED) return;
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i) start[i] = start_of(box, i, in);
    cb_limiter_place(&box->config, box->channels, start);
    step->loss = is_loss(box, in);
    box->counters.resyncs += plc->contact == CB_CONTACT_LOST;
    plc->contact = CB_CONTACT_KNOWN;
    plc->silent = in->held == CB_TRANSFER_REFUSED;
    plc->unconfirmed_us = plc->read_back_us = 0;
    plc->unread = 0;
    plc->confirmed = plc->went_back = false;
    step->placed = true;
}

/* in : held_um, value of the register that was read back
 * out: true if it is neither the value that was sent nor one of an earlier write that may act late,
 *      so another client writes to the register */
static bool is_foreign(const struct cb_channel_config *channel,
                       const struct cb_channel_state *state, float held_um) {
    const float low_um = state->possible_min_um, high_um = state->possible_max_um;
    const float largest_um = cb_max(cb_abs(low_um), cb_abs(high_um));
    const float near_um = cb_channel_raw_unit_um(channel) + largest_um * 1e-6f;
    return !(held_um >= low_um - near_um && held_um <= high_um + near_um);
}

/* Compares the write block that was read back with the values sent, after a confirmed write.
 * out: box->foreign, the last channel that differs, and its counter */
static void look_back(struct cb_box *box, const struct cb_inputs *in, const struct step *step) {
    struct cb_plc_state *plc = &box->plc;
    plc->read_back_us = cb_add_us(plc->read_back_us, step->elapsed_us);
    if (plc->contact != CB_CONTACT_KNOWN || in->held == CB_TRANSFER_NONE) return;
    plc->read_back_us = 0;
    plc->unread = in->held == CB_TRANSFER_OK ? 0 : (uint8_t)(plc->unread + 1);
    plc->silent = in->held == CB_TRANSFER_REFUSED || plc->unread >= CB_READ_BACK_TRIES;
    box->foreign.channel = CB_NONE;
    if (in->held != CB_TRANSFER_OK || in->last_write != CB_TRANSFER_OK) return;
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i) {
        const struct cb_channel_config *channel = &box->config.channels[i];
        const float held_um = cb_channel_decode(channel, in->held_registers + channel->reg);
        if (!is_foreign(channel, &box->channels[i], held_um)) continue;
        ++box->counters.registers_foreign;
        box->foreign = (struct cb_foreign_register){(uint8_t)i, held_um, box->channels[i].sent_um};
    }
}

static float seconds(const struct cb_box *box, const struct step *step) {
    return (float)bounded_us(box, step) * 1e-6f;
}

/* out: distance of two readings, by beats or by the clock. Only a PLC program that interpolates is
 *      known to sample positions with each beat; another heartbeat may count anything. */
static struct cb_apart apart_of(const struct cb_box *box, uint16_t beats, int64_t elapsed_us) {
    if (elapsed_us <= 0 || elapsed_us > CB_LEAD_PERIODS * (int64_t)box->config.period_us)
        return (struct cb_apart){0, 0.0f, false};
    const bool counted = box->config.plc.interpolate_us > 0;
    const float apart_us = counted ? cb_lead_apart_us(&box->life.lead, beats, (uint32_t)elapsed_us)
                                   : (float)(uint32_t)elapsed_us;
    return (struct cb_apart){elapsed_us, apart_us > 0.0f ? 1e6f / apart_us : 0.0f, counted};
}

/* Checks the reading of the PLC, and updates the estimates behind the lead.
 * out: step->read; step->apart if the previous reading was good too */
static void read_plc(struct cb_box *box, const struct cb_inputs *in, struct step *step) {
    const int64_t was_us = box->plc.read_us;
    const uint16_t was_beat = box->plc.plc_heartbeat;
    const bool was_readable = box->plc.readable;
    step->read = cb_plc_read(&box->config, &box->plc, &box->counters, in, box->life.now_us);
    if (in->last_write == CB_TRANSFER_OK) cb_lead_take_exchange(&box->life.lead, in->exchange_us);
    if (!step->read || !was_readable) return;
    const uint16_t beats = (uint16_t)(box->plc.plc_heartbeat - was_beat);
    const int64_t elapsed_us = box->plc.read_us - was_us;
    if (box->plc.alive)
        cb_lead_take_heartbeat(&box->life.lead, beats, elapsed_us);
    else
        cb_lead_lose_heartbeat(&box->life.lead);
    step->apart = apart_of(box, beats, elapsed_us);
}

/* Checks the reading and all that comes with it, and updates the signals.
 * in : lead_us, the look-ahead of positions
 * out: step->read, placed, loss, essentials_ok */
static void acquire(struct cb_box *box, const struct cb_inputs *in, uint32_t lead_us,
                    struct step *step) {
    read_plc(box, in, step);
    cb_plc_age(&box->config, &box->plc, &box->counters, box->life.now_us);
    cb_applied_step(&box->config, &box->applied, box->channels, box->tangent.reference,
                    &box->counters, step->read ? in->registers : NULL, step->elapsed_us,
                    box->mode.mode == CB_MODE_ACTIVE);
    if (step->read) {
        look_back(box, in, step);
        find_plc(box, in, step);
    }
    /* no movement: staying is always allowed (limiter.c) */
    step->placed = step->placed || cb_plc_parts(&box->plc);
    const struct cb_reading reading = cb_signals_accept(
        &box->config, box->signals, &box->counters, in, step->read, step->apart, box->life.now_us);
    if (box->config.sensors_count > 0)
        cb_sensors_watch(&box->config, box->signals, &box->sensors, &box->counters,
                         box->life.now_us);
    step->essentials_ok = cb_signals_age(&box->config, box->signals, &box->counters, &reading,
                                         lead_us, box->life.now_us);
    cb_banks_follow(&box->config, box->signals, &box->bank);
}

/* The outputs are those of the last step, which the PLC has. */
static void take_probes(struct cb_box *box) {
    const struct cb_probe_outputs outputs = {
        .terms = box->outputs,
        .channels = box->channels,
        .sigma = &box->sigma,
        .applied = box->applied.channels,
        .known = box->plc.contact == CB_CONTACT_KNOWN,
        .reported = cb_plc_readable(&box->config, &box->plc, box->life.now_us)};
    cb_probes_step(&box->config, box->signals, &outputs, box->terms, box->probes, &box->counters,
                   box->life.now_us);
}

static void compute(struct cb_box *box, struct step *step) {
    const float fade_um = box->config.ramp_um_per_s * seconds(box, step);
    step->terms = cb_terms_evaluate(&box->config, box->signals, &box->bank, box->terms,
                                    &box->counters, fade_um, box->outputs);
    if (box->config.sigma_rows > 0)
        cb_sigma_step(&box->config, box->signals, &box->bank, &box->sigma, box->life.now_us);
    if (box->config.adapts_count > 0) take_probes(box);
    step->demand = cb_channels_want(&box->config, box->outputs, box->channels, &box->counters);
    if (box->config.slopes_count > 0)
        cb_tangent_want(&box->config, box->signals, box->terms, box->outputs, &box->tangent,
                        box->channels, &box->counters);
}

static enum cb_reason find_fault(const struct cb_box *box) {
    if (box->plc.refusing && box->plc.refused_us > CB_REFUSED_US) return CB_REASON_WRITE_REFUSED;
    if (box->life.overrun_score >= CB_OVERRUN_FAULT) return CB_REASON_OVERRUN;
    return CB_REASON_NONE;
}

/* out: the events of this step, from the results of all earlier stages */
static struct cb_mode_events see(const struct cb_box *box, const struct cb_inputs *in,
                                 const struct step *step) {
    const struct cb_config *config = &box->config;
    const uint16_t control = box->plc.control;
    const bool plc_ok = cb_plc_readable(config, &box->plc, box->life.now_us);
    /* readings succeed, but the PLC did not reply to the read-back */
    const bool silent = plc_ok && box->plc.contact != CB_CONTACT_KNOWN && !box->life.writing;
    const struct cb_mode_events events = {
        .plc_ok = plc_ok,
        .writes_ok = (!box->plc.mute && !silent) ||
                     cb_plc_gone(config, &box->plc, box->life.now_us), /* plc_ok is false then */
        .nc_alarm = box->plc.nc_alarm,
        .loss = step->loss,
        .unapplied = box->applied.verdict.unapplied,
        .foreign = box->applied.verdict.foreign,
        .heartbeat_ok = box->plc.alive,
        .essentials_ok = step->essentials_ok,
        .clock_ok = !step->jumped,
        .enable = (control & CB_CONTROL_ENABLE) != 0,
        .referenced = (control & config->plc.referenced_mask) == config->plc.referenced_mask,
        .reset_edge = box->plc.reset_edge,
        .permit_resume = (control & CB_CONTROL_PERMIT_RESUME) != 0,
        .stop = in->stop,
        .all_zero = cb_channels_all_zero(config, box->channels),
        .zero_written = box->life.zero_written,
        .excessive = step->demand.excessive,
        .degraded = step->terms.degraded,
        .extrapolated = step->terms.extrapolated,
        .drifted = cb_probes_drifted(config, box->probes) != CB_NONE,
        .limited = step->demand.limited,
        .fault = (uint8_t)find_fault(box)};
    return events;
}

/* Steps the mode, finds the cause of its reason, and counts the modes entered. */
static void change_mode(struct cb_box *box, const struct cb_inputs *in, const struct step *step) {
    const struct cb_mode_events events = see(box, in, step);
    const uint8_t before = box->mode.mode;
    cb_mode_step(&box->mode, &events, step->elapsed_us, box->config.hold_us);
    const uint8_t mode = box->mode.mode;
    const bool was_fault = mode == CB_MODE_FAULT && before == CB_MODE_FAULT;
    if (!was_fault) box->cause = cb_box_find_cause(box);
    if (mode == before) return;
    box->counters.holds += mode == CB_MODE_HOLD;
    box->counters.ramps += mode == CB_MODE_RAMP;
    box->counters.faults += mode == CB_MODE_FAULT;
    if (before == CB_MODE_FAULT) box->life.overrun_score = 0;
}

static enum cb_aim aim_of(enum cb_mode mode) {
    switch (mode) {
        case CB_MODE_ACTIVE:
            return CB_AIM_WANTED;
        case CB_MODE_HOLD:
            return CB_AIM_STAY;
        case CB_MODE_STANDBY:
        case CB_MODE_RAMP:
        case CB_MODE_FAULT:
        case CB_MODE_STOPPED:
            break;
    }
    return CB_AIM_ZERO;
}

static void move(struct cb_box *box, const struct step *step) {
    float target_um[CB_MAX_CHANNELS];
    const enum cb_aim aim = aim_of((enum cb_mode)box->mode.mode);
    const struct cb_motion motion = {
        .elapsed_s = step->placed ? 0.0f : seconds(box, step),
        .max_s = (float)(CB_STEP_PERIODS * box->config.period_us) * 1e-6f,
        .ramp_um_per_s = aim == CB_AIM_ZERO ? box->config.ramp_um_per_s : 0.0f,
        .writing = box->plc.contact == CB_CONTACT_KNOWN || cb_plc_parts(&box->plc)};
    cb_channels_target(&box->config, box->channels, aim, target_um);
    cb_limiter_step(&box->config, box->channels, &box->counters, target_um, &motion);
}

/* Clears eight registers at a time: the compiler's code for a loop or memset() takes three times as
 * long. */
static void clear_registers(uint16_t *registers, unsigned count) {
    for (; count >= 8; count -= 8, registers += 8) memset(registers, 0, 8 * sizeof *registers);
    while (count > 0) registers[--count] = 0;
}

/* out: the whole write block and *out, from the state of the box */
static void emit(struct cb_box *box, struct cb_outputs *out) {
    const struct cb_plc_config *plc = &box->config.plc;
    clear_registers(out->registers, plc->write.count);
    cb_channels_encode(&box->config, box->channels, out->registers);
    if (box->config.slopes_count > 0)
        cb_tangent_encode(&box->config, &box->tangent, out->registers);
    out->registers[plc->status] = (uint16_t)(box->mode.mode | box->mode.reason << 8);
    out->registers[plc->box_heartbeat] = ++box->life.box_heartbeat;
    if (plc->has_request)
        out->registers[plc->request] = cb_probes_ask(&box->config, box->probes) ? 1u : 0u;
    if (plc->has_detail) out->registers[plc->detail] = cb_cause_detail(&box->cause);
    if (plc->write.counters)
        out->registers[0] = out->registers[plc->write.count - 1] = ++box->life.block_counter;
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i)
        out->channel_um[i] = box->channels[i].output_um;
    out->last = cb_plc_parts(&box->plc);
    out->write = box->plc.contact == CB_CONTACT_KNOWN || out->last;
    out->stopped = box->mode.mode == CB_MODE_STOPPED &&
                   (box->life.stop_confirmed || !(box->life.wrote || out->write));
    box->life.writing = out->write;
    if (!out->write) return;
    box->life.wrote = true;
    box->life.sent_mode = box->mode.mode;
    box->life.zero_written =
        box->life.zero_written && cb_channels_all_zero(&box->config, box->channels);
}

/* Ends all writing: the configuration has changed in memory, so no field of it is used. The
 * heartbeat stops too, and the PLC's watchdog removes the offset. */
static void give_up(struct cb_box *box, int64_t now_us, struct cb_outputs *out) {
    const struct cb_mode_events events = {.fault = CB_REASON_CONFIG_CORRUPT};
    const uint8_t before = box->mode.mode;
    cb_mode_step(&box->mode, &events, 0, 0);
    box->counters.faults += box->mode.mode != before;
    box->cause = (struct cb_cause){CB_CAUSE_NONE, 0, 0.0f, 0.0f};
    box->life.now_us = now_us;
    box->life.writing = out->write = out->stopped = false;
}

void cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                 struct cb_outputs *out) {
    struct step step = {0};
    CB_ASSERT(box);
    CB_ASSERT(in);
    CB_ASSERT(out);
    ++box->counters.cycles;
    if (!cb_box_check(box)) {
        give_up(box, now_us, out);
        return;
    }
    keep_time(box, now_us, &step);
    keep_score(box, in->missed_ticks);
    take_write(box, in->last_write, &step);
    acquire(box, in, cb_lead_us(&box->config, &box->life.lead), &step);
    compute(box, &step);
    change_mode(box, in, &step);
    move(box, &step);
    emit(box, out);
}

/* out: lowest rate of a ramp to zero, µm/s. A step at the slew rate moves whole units only, so it
 *      loses up to one unit, or up to half of its way where that is less than two units. A step
 *      that never allows a unit loses nothing (limiter.c, "The grid"). */
static float lowest_rate(const struct cb_config *config, const struct cb_channel_config *channel) {
    const float slew = channel->slew_um_per_s, period_s = (float)config->period_us * 1e-6f;
    const bool whole_units = 2.0f * slew * period_s >= channel->unit_um;
    const float lost = whole_units ? cb_min(channel->unit_um / period_s, 0.5f * slew) : 0.0f;
    return channel->is_slope ? slew - lost : cb_min(slew - lost, config->ramp_um_per_s);
}

int64_t cb_box_stop_us(const struct cb_box *box) {
    const struct cb_config *config = &box->config;
    float longest_s = 0.0f;
    if (!cb_box_is_sound(box)) return 0;
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        const float way_um = cb_max(channel->limit_um, cb_abs(box->channels[i].output_um));
        longest_s = cb_max(longest_s, way_um / lowest_rate(config, channel));
    }
    return 4 * (int64_t)cb_limiter_late_us(config) + (int64_t)(cb_min(longest_s, 1e9f) * 1e6f);
}

void cb_box_settle(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                   struct cb_outputs *out) {
    struct step step = {0};
    float target_um[CB_MAX_CHANNELS];
    struct cb_start start[CB_MAX_CHANNELS];
    cb_box_start(box);
    keep_time(box, now_us, &step);
    acquire(box, in, cb_lead_us(&box->config, &box->life.lead), &step);
    compute(box, &step);
    cb_channels_target(&box->config, box->channels, CB_AIM_WANTED, target_um);
    for (unsigned i = 0; i < cb_all_channels(&box->config); ++i)
        start[i] = (struct cb_start){target_um[i], true};
    cb_limiter_place(&box->config, box->channels, start);
    box->plc.contact = CB_CONTACT_KNOWN;
    box->plc.beating = box->plc.alive = true;
    box->plc.heartbeat_us = now_us;
    box->mode = (struct cb_mode_state){.mode = CB_MODE_ACTIVE, .enable_was = true};
    emit(box, out);
}
