/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/box_hal.h"

#include "hal/rtu_exchange.h"
#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/retained.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/watchdog.h"

enum { SLEEP_US = 1000 }; /* SysTick wakes the processor at least this often */

static int64_t now_us(void *context) {
    (void)context;
    return cb_time_us();
}

/* Sleeps where the next interrupt comes in time, and spins in the last millisecond of a period that
 * is no whole number of milliseconds. */
static void wait_until(struct cb_board *board, int64_t until_us) {
    const bool whole = until_us % SLEEP_US == 0;
    for (;;) {
        const uint32_t seen = cb_time_interrupts();
        board->idle();
        const int64_t left_us = until_us - cb_time_us();
        if (left_us <= 0) return;
        if (whole || left_us > SLEEP_US) cb_time_sleep(seen);
    }
}

/* in : a tick that is not before now
 * Ticks are at whole multiples of the period after the first. */
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

void cb_board_start_plc(struct cb_board *board, uint8_t unit, const struct cb_rtu_manners *manners,
                        uint32_t lumps_us) {
    cb_wire_start(&board->plc, CB_USART_PLC, &manners->line, lumps_us);
    cb_rtu_dialog_start(&board->dialog, manners, lumps_us);
    board->plc.wary = true;
    board->plc_unit = unit;
}

/* Sends one frame and waits for its result, or for the end of its time. */
static enum cb_rtu_end exchange_once(void *context, enum cb_rtu_send what,
                                     const struct cb_modbus_request *request, uint16_t *registers,
                                     int64_t until_us) {
    struct cb_board *board = context;
    struct cb_wire *wire = &board->plc;
    const uint32_t sent = wire->counters.requests;
    cb_wire_send(wire, what, board->plc_unit, request, registers, until_us);
    for (;;) {
        const uint32_t seen = cb_time_interrupts();
        if (cb_wire_poll(wire, cb_time_us())) break;
        board->meanwhile();
        /* the silence and the time limit end between two interrupts */
        if (wire->state != CB_WIRE_QUIET && until_us - cb_time_us() > SLEEP_US) cb_time_sleep(seen);
    }
    if (wire->counters.requests == sent) return wire->end;
    wire->counters.probes += what == CB_RTU_SEND_PROBE;
    wire->counters.retries += what == CB_RTU_SEND_REQUEST && board->dialog.requests > 0;
    return wire->end;
}

static enum cb_transfer exchange(struct cb_board *board, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us) {
    const struct cb_rtu_wire wire = {.context = board, .now_us = now_us, .exchange = exchange_once};
    return cb_rtu_exchange_on(&wire, &board->dialog, request, registers, deadline_us);
}

static enum cb_transfer read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                             int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_read(start, count);
    return exchange(context, &request, registers, deadline_us);
}

static enum cb_transfer write(void *context, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_write(start, count, registers);
    return exchange(context, &request, 0, deadline_us);
}

static enum cb_transfer write_read(void *context, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us) {
    const struct cb_modbus_request request =
        cb_modbus_write_read(write_start, write_count, write_registers, read_start, read_count);
    return exchange(context, &request, read_registers, deadline_us);
}

static size_t samples(void *context, struct cb_sample *list, size_t max) {
    struct cb_board *board = context;
    const size_t count = board->waiting < max ? board->waiting : max;
    for (size_t i = 0; i < count; ++i) list[i] = board->samples[i];
    board->waiting = 0;
    return count;
}

/* A cycle is complete: the only place that feeds the watchdog; the first call shortens its time. A
 * stack that overflowed must not continue. */
static void feed_watchdog(void *context) {
    struct cb_board *board = context;
    if (!cb_guard_intact()) cb_restart(CB_START_STACK);
    if (board->watchdog_ms > 0) cb_watchdog_start(board->watchdog_ms);
    board->watchdog_ms = 0;
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
