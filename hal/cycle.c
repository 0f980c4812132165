/* SPDX-License-Identifier: MIT */
#include "hal/cycle.h"

#include <string.h>

#include "firmware/base/assert.h"
#include "firmware/config/rtu_budget.h"

/* State of one cycle's exchange. */
struct exchange {
    const struct cb_hal *hal;
    const struct cb_plc_config *plc;
    int64_t deadline_us;
    bool fc23; /* one request writes and reads */
};

static int64_t now(const struct cb_hal *hal) {
    return hal->now_us(hal->context);
}

/* A third request takes no longer than the first two, so it fits if they took at most half of the
 * time. */
static bool has_room(const struct cb_cycle *cycle, const struct exchange *exchange) {
    return now(exchange->hal) + cycle->exchange_us <= exchange->deadline_us - cycle->exchange_us;
}

/* FC3 of the write block. */
static void read_held(struct cb_cycle *cycle, const struct exchange *exchange) {
    const struct cb_hal *hal = exchange->hal;
    const struct cb_block_config *write = &exchange->plc->write;
    cycle->in.held = (uint8_t)hal->read(hal->context, write->start, write->count,
                                        cycle->in.held_registers, exchange->deadline_us);
}

/* The reading took more than half of the time. Another one behind it would end too late, and its
 * reply would delay the requests of the next cycles. */
static bool is_slow(const struct cb_cycle *cycle, const struct exchange *exchange) {
    const int64_t now_us = now(exchange->hal);
    return now_us - cycle->tick_us > exchange->deadline_us - now_us;
}

/* Behind a reading: FC3 of the write block, when the box requests it. Two requests in every cycle
 * are also what fc3+fc16 needs later, so only fc23 may have them in two cycles. */
static void read_back(struct cb_cycle *cycle, const struct cb_box *box,
                      const struct exchange *exchange) {
    const enum cb_want want = cb_box_wants_held(box);
    if (!cycle->in.read_ok || cycle->in.held != CB_TRANSFER_NONE) return;
    if (want == CB_WANT_NOW && exchange->fc23 && is_slow(cycle, exchange))
        cycle->turn = CB_TURN_NEXT;
    else if (want == CB_WANT_NOW || (want == CB_WANT_IF_ROOM && has_room(cycle, exchange)))
        read_held(cycle, exchange);
}

/* FC3 of the write block in place of the reading. */
static void read_back_alone(struct cb_cycle *cycle, const struct exchange *exchange) {
    read_held(cycle, exchange);
    cycle->read = (enum cb_transfer)cycle->in.held;
    cycle->in.read_ok = false;
    cycle->turn = CB_TURN_DONE;
}

/* Records the time from a reading to the confirmation of the outputs computed from it.
 * in : read_us, time of the reading; 0: none */
static void note_exchange(struct cb_cycle *cycle, int64_t read_us, int64_t confirmed_us) {
    const int64_t took_us = confirmed_us - read_us;
    if (cycle->write != CB_TRANSFER_OK || read_us == 0 || took_us <= 0) return;
    cycle->in.exchange_us = (uint32_t)(took_us < UINT32_MAX ? took_us : UINT32_MAX);
}

/* Closes the connection after a last write that may still take effect. */
static void leave_behind_last(const struct cb_cycle *cycle, const struct cb_hal *hal) {
    if (cycle->out.last && cycle->write == CB_TRANSFER_UNKNOWN && hal->leave)
        hal->leave(hal->context);
}

/* Takes the results of a client beside the loop: the fate of the previous step's outputs, and the
 * time of the reading.
 * in : made_from_us, of the reading behind those outputs; 0: none */
static void take_handed(struct cb_cycle *cycle, const struct cb_hal *hal, int64_t made_from_us) {
    const struct cb_handed handed = hal->handed(hal->context);
    if (handed.write != CB_TRANSFER_NONE) cycle->write = (enum cb_transfer)handed.write;
    cycle->in.last_write = handed.write;
    leave_behind_last(cycle, hal);
    note_exchange(cycle, made_from_us, handed.written_us);
    if (cycle->in.read_ok) cycle->in.read_us = handed.read_us;
}

/* FC3 of the read block. */
static void read_inputs(struct cb_cycle *cycle, const struct exchange *exchange) {
    const struct cb_hal *hal = exchange->hal;
    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;
    const struct cb_block_config *read = &exchange->plc->read;
    cycle->in.read_us = now(hal);
    cycle->read = hal->read(hal->context, read->start, read->count, cycle->in.registers,
                            exchange->deadline_us);
    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;
    if (hal->handed) take_handed(cycle, hal, made_from_us);
}

/* FC23: the previous step's outputs, then this step's inputs. */
static void write_then_read(struct cb_cycle *cycle, const struct exchange *exchange) {
    const struct cb_hal *hal = exchange->hal;
    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;
    const struct cb_block_config *read = &exchange->plc->read, *write = &exchange->plc->write;
    cycle->in.read_us = now(hal);
    cycle->read = cycle->write =
        hal->write_read(hal->context, write->start, write->count, cycle->out.registers, read->start,
                        read->count, cycle->in.registers, exchange->deadline_us);
    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;
    cycle->in.last_write = (uint8_t)cycle->write;
    leave_behind_last(cycle, hal);
    note_exchange(cycle, made_from_us, now(hal));
}

/* FC16 of the outputs of this step. */
static void write_outputs(struct cb_cycle *cycle, const struct exchange *exchange) {
    const struct cb_hal *hal = exchange->hal;
    const struct cb_block_config *write = &exchange->plc->write;
    if (hal->handed) { /* the next cycle has its result */
        (void)hal->write(hal->context, write->start, write->count, cycle->out.registers,
                         exchange->deadline_us);
        return;
    }
    if (now(hal) < exchange->deadline_us)
        cycle->write = hal->write(hal->context, write->start, write->count, cycle->out.registers,
                                  exchange->deadline_us);
    cycle->in.last_write = (uint8_t)cycle->write;
    leave_behind_last(cycle, hal);
    note_exchange(cycle, cycle->in.read_ok ? cycle->in.read_us : 0, now(hal));
}

static void take_samples(struct cb_cycle *cycle, const struct cb_hal *hal) {
    const size_t count = hal->samples(hal->context, cycle->in.samples, CB_MAX_SAMPLES);
    CB_ASSERT(count <= CB_MAX_SAMPLES);
    cycle->in.sample_count = (uint8_t)count;
}

void cb_cycle_start(struct cb_cycle *cycle) {
    memset(cycle, 0, sizeof *cycle);
    cycle->read = cycle->write = CB_TRANSFER_FAILED;
}

/* out: a longer time than this between two steps is a jump of the clock */
static int64_t clock_us(const struct cb_box *box) {
    return (int64_t)CB_CLOCK_PERIODS * box->config.period_us;
}

/* out: the last step is so long ago that the next one takes all its inputs as stale: mode and
 * outputs that it computed are not written any more */
static bool outlived(const struct cb_cycle *cycle, const struct cb_box *box) {
    return cycle->tick_us - cycle->step_at_us > clock_us(box);
}

/* out: a read-back does not count behind a longer time: a suspend or a pause of the loop lies
 *      between, in which the PLC may have restarted or moved on */
static int64_t recent_us(const struct cb_box *box) {
    return (int64_t)CB_STEP_PERIODS * box->config.period_us;
}

/* All requests of a cycle before its step.
 * in : combined: one FC23 writes the outputs of the step before, and reads
 * out: in->read_ok and held with their registers. A read-back that had the cycle before for itself
 *      counts if it is recent. */
static void exchange_before(struct cb_cycle *cycle, const struct cb_box *box,
                            const struct exchange *exchange, bool combined) {
    const uint8_t turn = cycle->turn;
    const bool answered = cycle->in.held == CB_TRANSFER_OK || cycle->in.held == CB_TRANSFER_REFUSED;
    const bool recent = cycle->tick_us - cycle->step_at_us <= recent_us(box);
    cycle->turn = CB_TURN_BESIDE;
    if (turn != CB_TURN_DONE || !answered || !recent) cycle->in.held = CB_TRANSFER_NONE;
    if (combined) {
        write_then_read(cycle, exchange);
    } else if (turn == CB_TURN_NEXT) {
        read_back_alone(cycle, exchange);
        return;
    } else {
        read_inputs(cycle, exchange);
    }
    read_back(cycle, box, exchange);
}

/* The step gets nothing of the PLC: the configuration has changed in memory, so there was no
 * request; or a suspend came behind the exchange. What was read is of before it then. */
static void forget_exchange(struct cb_cycle *cycle) {
    cycle->in.read_ok = false;
    cycle->in.held = CB_TRANSFER_NONE;
}

void cb_cycle_run(struct cb_cycle *cycle, struct cb_box *box, const struct cb_hal *hal) {
    cycle->in.missed_ticks = hal->wait_tick(hal->context);
    cycle->tick_us = now(hal);
    const bool sound = cb_box_is_sound(box); /* otherwise its addresses and period are invalid */
    const bool beside = hal->handed != NULL;
    const struct exchange exchange = {
        .hal = hal,
        .plc = &box->config.plc,
        .deadline_us = cycle->tick_us + cb_exchange_budget_us(box->config.period_us),
        .fc23 = box->config.plc.exchange == CB_EXCHANGE_FC23 && !beside};
    /* With no outputs yet, no contact to the PLC, or outputs from before a suspend, the inputs are
     * read first, even with FC23. */
    const bool has_outputs = exchange.fc23 && cycle->out.write;
    const bool combined = has_outputs && !outlived(cycle, box);

    if (has_outputs && !combined) cycle->in.last_write = CB_TRANSFER_FAILED;
    cycle->read = cycle->write = CB_TRANSFER_FAILED;
    if (sound)
        exchange_before(cycle, box, &exchange, combined);
    else
        forget_exchange(cycle);
    const int64_t read_done_us = now(hal);
    take_samples(cycle, hal);
    cycle->in.stop = hal->stop_requested(hal->context);

    const int64_t step_from_us = now(hal);
    const int64_t waited_us = step_from_us - cycle->tick_us;
    if (waited_us > recent_us(box)) cycle->in.held = CB_TRANSFER_NONE;
    if (waited_us > clock_us(box)) forget_exchange(cycle);
    cycle->step_at_us = step_from_us;
    cycle->step_exchange_us = cycle->in.exchange_us;
    cycle->step_last_write = cycle->in.last_write;
    cb_box_step(box, &cycle->in, step_from_us, &cycle->out);
    const int64_t step_done_us = now(hal);

    cycle->in.last_write = CB_TRANSFER_NONE;
    if (!exchange.fc23 && cycle->out.write) write_outputs(cycle, &exchange);
    cycle->step_us = step_done_us - step_from_us;
    cycle->exchange_us = (read_done_us - cycle->tick_us) + (now(hal) - step_done_us);
    hal->feed_watchdog(hal->context);
}
