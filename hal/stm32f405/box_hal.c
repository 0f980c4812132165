/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/box_hal.h"

#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/retained.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/watchdog.h"

enum { SLEEP_US = 1000 }; /* SysTick wakes the processor at the latest after so long */

static int64_t now_us(void *context) {
    (void)context;
    return cb_time_us();
}

/* Sleeps where the next interrupt cannot come too late, turns in circles for the last millisecond
 * of a period that is no whole number of them. */
static void wait_until(struct cb_board *board, int64_t until_us) {
    const bool whole = until_us % SLEEP_US == 0;
    for (;;) {
        board->idle();
        const int64_t left_us = until_us - cb_time_us();
        if (left_us <= 0) return;
        if (whole || left_us > SLEEP_US) cb_time_sleep();
    }
}

/* in : a tick that is not before now
 * Ticks lie at whole multiples of the period after the first. */
uint32_t cb_board_wait_tick(struct cb_board *board) {
    uint32_t missed = 0;
    const int64_t from_us = cb_time_us();
    if (board->next_tick_us == 0)
        board->next_tick_us = (from_us / SLEEP_US + 1) * SLEEP_US;
    else
        board->next_tick_us += board->period_us;
    const int64_t late_us = from_us - board->next_tick_us;
    if (late_us > 0) {
        missed = (uint32_t)(late_us / board->period_us) + 1;
        board->next_tick_us += (int64_t)missed * board->period_us;
    }
    wait_until(board, board->next_tick_us);
    return missed;
}

static uint32_t wait_tick(void *context) {
    return cb_board_wait_tick(context);
}

/* How long to wait for a reply: as long as there is time for one repetition after it, when there is
 * time for one at all. */
static int64_t patience_us(int64_t now_us, int64_t deadline_us, uint32_t needed_us) {
    const bool twice = deadline_us - now_us >= 2 * (int64_t)needed_us;
    return twice ? deadline_us - (int64_t)needed_us : deadline_us;
}

/* One request and its reply, or the end of its time. */
static enum cb_wire_end ask(struct cb_board *board, const struct cb_modbus_request *request,
                            uint16_t *registers, int64_t until_us) {
    struct cb_wire *wire = &board->plc;
    cb_wire_ask(wire, board->plc_unit, request, registers, until_us);
    while (!cb_wire_poll(wire, cb_time_us())) {
        board->meanwhile();
        if (wire->state != CB_WIRE_QUIET)
            cb_time_sleep(); /* the silence ends between two interrupts */
    }
    return wire->end;
}

/* A request that got no answer stays out until the deadline of the next cycle: a reply that comes
 * by then is thrown away and not taken for that of another request, which RTU could not tell from
 * it. In its own cycle it may be repeated: both replies are of the same question. in : deadline_us
 * of the cycle out: whether this cycle has to be silent */
static bool must_be_silent(const struct cb_board *board, int64_t deadline_us) {
    return board->unanswered_deadline_us != 0 && deadline_us > board->unanswered_deadline_us &&
           cb_time_us() < board->unanswered_deadline_us + (int64_t)board->period_us;
}

/* A request is repeated as often as its time allows: reading twice and writing the same absolute
 * values twice harm nobody.
 * in : deadline_us of the cycle; what is left of it behind until_us is for another request */
static enum cb_transfer exchange(struct cb_board *board, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us, int64_t until_us) {
    const uint32_t needed_us = cb_rtu_exchange_us(&board->plc.line, request, board->slave_delay_us);
    bool sent = false;
    if (must_be_silent(board, deadline_us)) return CB_TRANSFER_FAILED;
    for (unsigned tries = 0; tries < CB_BOARD_TRIES; ++tries) {
        const int64_t now_us = cb_time_us();
        if (until_us - now_us < (int64_t)needed_us) break;
        board->plc.counters.retries += tries > 0;
        switch (ask(board, request, registers, patience_us(now_us, until_us, needed_us))) {
            case CB_WIRE_OK:
                return CB_TRANSFER_OK;
            case CB_WIRE_REFUSED:
                return CB_TRANSFER_REFUSED;
            case CB_WIRE_SILENT:
                board->unanswered_deadline_us = deadline_us;
                sent = true;
                break;
            case CB_WIRE_SPOILT: /* the slave has had its say */
                sent = true;
                break;
            case CB_WIRE_NOT_SENT:
                break;
        }
    }
    return sent ? CB_TRANSFER_UNKNOWN : CB_TRANSFER_FAILED;
}

static enum cb_transfer read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                             int64_t deadline_us) {
    struct cb_board *board = context;
    const struct cb_modbus_request request = cb_modbus_read(start, count);
    return exchange(board, &request, registers, deadline_us,
                    deadline_us - (int64_t)board->reserve_us);
}

static enum cb_transfer write(void *context, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_write(start, count, registers);
    return exchange(context, &request, 0, deadline_us, deadline_us);
}

static enum cb_transfer write_read(void *context, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us) {
    const struct cb_modbus_request request =
        cb_modbus_write_read(write_start, write_count, write_registers, read_start, read_count);
    return exchange(context, &request, read_registers, deadline_us, deadline_us);
}

static size_t samples(void *context, struct cb_hal_sample *list, size_t max) {
    struct cb_board *board = context;
    const size_t count = board->waiting < max ? board->waiting : max;
    for (size_t i = 0; i < count; ++i) list[i] = board->samples[i];
    board->waiting = 0;
    return count;
}

/* A cycle is complete: the only place that feeds the watchdog. A stack that has run over must not
 * go on. */
static void feed_watchdog(void *context) {
    (void)context;
    if (!cb_guard_intact()) cb_restart(CB_START_STACK);
    cb_watchdog_feed();
}

static bool stop_requested(void *context) {
    const struct cb_board *board = context;
    return board->stop;
}

struct cb_hal cb_board_hal(struct cb_board *board) {
    return (struct cb_hal){.context = board,
                           .now_us = now_us,
                           .wait_tick = wait_tick,
                           .read = read,
                           .write = write,
                           .write_read = write_read,
                           .samples = samples,
                           .feed_watchdog = feed_watchdog,
                           .stop_requested = stop_requested};
}
