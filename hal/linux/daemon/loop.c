/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/loop.h"

#include <string.h>

#include "hal/linux/files/cause_words.h"
#include "hal/linux/files/row_sigma.h"
#include "hal/linux/realtime.h"

static struct cb_row_link link_of(const struct cb_link *link) {
    return (struct cb_row_link){.state = link->state,
                                .cause = link->cause,
                                .error_number = link->error_number,
                                .connects = link->connects,
                                .failures = link->failures,
                                .disconnects = link->disconnects};
}

static void copy_can(struct cb_row_can *row, const struct cb_can_source *source) {
    row->state = source->can.state;
    row->short_id = source->short_id;
    row->counters = source->can.counters;
    memcpy(row->nodes, source->nodes, source->config.nodes_count * sizeof row->nodes[0]);
}

static struct cb_row_link device_of(const struct cb_serial *serial) {
    return (struct cb_row_link){.state = serial->fd >= 0 ? CB_LINK_UP : CB_LINK_DOWN,
                                .cause = CB_LINK_CAUSE_ERRNO,
                                .error_number = serial->error_number,
                                .connects = serial->connects,
                                .failures = serial->failures,
                                .disconnects = serial->disconnects};
}

static void copy_wire(struct cb_row *row, const struct cb_linux *target) {
    row->transport = target->transport;
    row->tcp = target->tcp.counters;
    row->rtu = target->rtu.counters;
    row->peer = target->transport == CB_TRANSPORT_RTU ? target->rtu.peer : target->tcp.peer;
    row->link = target->transport == CB_TRANSPORT_RTU ? device_of(&target->rtu.serial)
                                                      : link_of(&target->tcp.link);
}

/* Restores the step's inputs: the write after it has changed two of them for the next step. */
static void copy_step(struct cb_row *row, const struct cb_cycle *cycle) {
    row->step_at_us = cycle->step_at_us;
    row->in = cycle->in;
    row->in.exchange_us = cycle->step_exchange_us;
    row->in.last_write = cycle->step_last_write;
    memcpy(row->written, cycle->out.registers, sizeof row->written);
}

static enum cb_row_signal_state state_of(const struct cb_signal_state *signal) {
    if (!signal->known) return CB_ROW_SIGNAL_NEVER;
    if (!signal->fresh) return CB_ROW_SIGNAL_STALE;
    return signal->refusal == CB_CAUSE_NONE ? CB_ROW_SIGNAL_FRESH : CB_ROW_SIGNAL_REFUSED;
}

/* All entries, because a count may have changed in memory. */
static void copy_values(struct cb_row *row, const struct cb_box *box,
                        const struct cb_outputs *out) {
    for (unsigned i = 0; i < CB_MAX_SIGNALS; i++) {
        const struct cb_signal_state *signal = &box->signals[i];
        row->signals[i] = (struct cb_row_signal){.value = signal->value,
                                                 .state = (uint8_t)state_of(signal),
                                                 .time_us = signal->time_us,
                                                 .implausible = signal->implausible,
                                                 .stale = signal->stale};
    }
    for (unsigned i = 0; i < CB_MAX_CHANNELS; i++) {
        const struct cb_channel_state *channel = &box->channels[i];
        row->channels[i] = (struct cb_row_channel){.wanted_um = channel->wanted_um,
                                                   .output_um = out->channel_um[i],
                                                   .applied_um = channel->applied_um,
                                                   .limited = channel->limited,
                                                   .excessive = channel->excessive};
    }
    memcpy(row->outputs, box->outputs, sizeof row->outputs);
    memcpy(row->probes, box->probes, sizeof row->probes);
    cb_row_take_sigmas(row, box);
}

/* Publishes the finished cycle for the other thread; a full ring counts the row as lost. The last
 * one of all is not lost, it stays beside the ring: its counters are the final ones. */
static void publish(struct cb_loop *loop, int64_t woke_before_ns) {
    const uint64_t number = loop->made++;
    const int32_t slot = cb_ring_slot_to_write(&loop->ring);
    const struct cb_tick *tick = &loop->target.tick;
    struct cb_row *row = slot < 0 ? &loop->beside : &loop->rows[slot];
    loop->is_beside = slot < 0;
    row->time_us = loop->cycle.tick_us;
    row->tick = tick->index;
    row->late_ns = tick->worst_ns;
    row->interval_ns = woke_before_ns == 0 ? 0 : tick->woke_ns - woke_before_ns;
    row->exchange_us = loop->cycle.exchange_us;
    row->step_us = loop->cycle.step_us;
    row->generation = loop->generation;
    row->lead_us = cb_lead_us(&loop->box->config, &loop->box->life.lead);
    row->read = (uint8_t)loop->cycle.read;
    row->write = (uint8_t)loop->cycle.write;
    row->mode = loop->box->mode.mode;
    row->reason = loop->box->mode.reason;
    row->cause = cb_name_cause(loop->box);
    row->foreign = loop->box->foreign;
    row->box = loop->box->counters;
    copy_wire(row, &loop->target);
    copy_can(&row->can, &loop->target.can);
    row->number = number;
    copy_step(row, &loop->cycle);
    copy_values(row, loop->box, &loop->cycle.out);
    if (slot >= 0) cb_ring_publish(&loop->ring);
}

/* Publishes the lags for the other thread, once a second. */
static void publish_state(struct cb_loop *loop) {
    if (loop->cycle.tick_us - loop->state_us < CB_LOOP_STATE_US) return;
    int32_t slot = cb_ring_slot_to_write(&loop->state_ring);
    if (slot < 0) return;
    loop->state_us = loop->cycle.tick_us;
    cb_state_take(&loop->states[slot], loop->box);
    loop->state_generations[slot] = loop->generation;
    cb_ring_publish(&loop->state_ring);
}

void cb_loop_init(struct cb_loop *loop) {
    loop->box = &loop->boxes[0];
}

struct cb_box *cb_loop_spare(struct cb_loop *loop) {
    return &loop->boxes[loop->box == loop->boxes];
}

void cb_loop_offer(struct cb_loop *loop, bool at_rest_only) {
    loop->at_rest_only = at_rest_only;
    __atomic_store_n(&loop->offer, CB_LOOP_OFFER_MADE, __ATOMIC_RELEASE);
}

/* out: whether an offer was made; it is then in the state `to` */
static bool grab_offer(struct cb_loop *loop, uint32_t to) {
    uint32_t made = CB_LOOP_OFFER_MADE;
    return __atomic_compare_exchange_n(&loop->offer, &made, to, false, __ATOMIC_ACQ_REL,
                                       __ATOMIC_RELAXED);
}

bool cb_loop_withdraw(struct cb_loop *loop) {
    return grab_offer(loop, CB_LOOP_OFFER_NONE);
}

bool cb_loop_answered(const struct cb_loop *loop) {
    return __atomic_load_n(&loop->offer, __ATOMIC_ACQUIRE) == CB_LOOP_OFFER_NONE;
}

const struct cb_box *cb_loop_box(const struct cb_loop *loop) {
    return &loop->boxes[__atomic_load_n(&loop->generation, __ATOMIC_ACQUIRE) % 2];
}

bool cb_loop_is_corrupt(const struct cb_loop *loop) {
    return __atomic_load_n(&cb_loop_box(loop)->config_corrupt, __ATOMIC_RELAXED);
}

static void take_over(struct cb_loop *loop, struct cb_box *spare) {
    loop->box = spare;
    loop->cycle.turn = CB_TURN_BESIDE;
    loop->target.generation = loop->generation + 1;
    __atomic_store_n(&loop->generation, loop->target.generation, __ATOMIC_RELEASE);
    cb_can_source_replan(&loop->target.can, &spare->config);
}

/* Between two cycles: the offered box takes over the running state, or remains offered. */
static void take_offer(struct cb_loop *loop) {
    if (!grab_offer(loop, CB_LOOP_OFFER_IN_HAND)) return;
    struct cb_box *spare = cb_loop_spare(loop);
    const bool may = !loop->at_rest_only || cb_box_at_rest(loop->box);
    const bool taken = may && cb_box_adopt(spare, loop->box);
    if (taken) take_over(loop, spare);
    __atomic_store_n(&loop->offer, taken ? CB_LOOP_OFFER_NONE : CB_LOOP_OFFER_MADE,
                     __ATOMIC_RELEASE);
}

void *cb_loop_run(void *argument) {
    struct cb_loop *loop = argument;
    cb_settle_thread("compboxd-loop");
    const struct cb_hal hal = cb_linux_hal(&loop->target);
    cb_box_start(loop->box);
    cb_state_give(&loop->resumed, loop->box);
    cb_cycle_start(&loop->cycle);
    cb_tick_start(&loop->target.tick, loop->clock, loop->box->config.period_us);
    int64_t woke_before_ns = 0;
    for (uint64_t done = 0; !loop->stopped && !cb_flag_is_raised(&loop->quit);) {
        take_offer(loop);
        cb_cycle_run(&loop->cycle, loop->box, &hal);
        loop->stopped = loop->cycle.out.stopped;
        publish(loop, woke_before_ns);
        publish_state(loop);
        woke_before_ns = loop->target.tick.woke_ns;
        if (++done == loop->cycles) cb_flag_raise(&loop->target.stop);
    }
    cb_linux_close(&loop->target);
    cb_flag_raise(&loop->finished);
    return NULL;
}
