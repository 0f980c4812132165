/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/box_hal.h"

#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/mcu.h"
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
        board->idle(board->idle_context);
        const int64_t left_us = until_us - cb_time_us();
        if (left_us <= 0) return;
        if (whole || left_us > SLEEP_US) cb_sleep();
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

static enum cb_transfer read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                             int64_t deadline_us) {
    (void)context, (void)start, (void)count, (void)registers, (void)deadline_us;
    return CB_TRANSFER_FAILED;
}

static enum cb_transfer write(void *context, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us) {
    (void)context, (void)start, (void)count, (void)registers, (void)deadline_us;
    return CB_TRANSFER_FAILED;
}

static enum cb_transfer write_read(void *context, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us) {
    (void)context, (void)write_start, (void)write_count, (void)write_registers;
    (void)read_start, (void)read_count, (void)read_registers, (void)deadline_us;
    return CB_TRANSFER_FAILED;
}

static size_t samples(void *context, struct cb_hal_sample *list, size_t max) {
    (void)context, (void)list, (void)max;
    return 0;
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
