/* SPDX-License-Identifier: MIT
 * compbox-stm32f405: the box on a bare STM32F405. Starts the hardware, loads the coefficient file
 * from flash, and runs the cycles; the console uses the rest of each period. */
#include "hal/stm32f405/main.h"

#include "firmware/config/rtu_budget.h"
#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/app/last_cycles.h"
#include "hal/stm32f405/app/load.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/usart.h"
#include "hal/stm32f405/watchdog.h"

enum {
    WATCHDOG_START_MS = 8000, /* at least 5.4 s; loading takes 3 s at 16 MHz */
    WATCHDOG_PERIODS = 10,
    WATCHDOG_LEAST_MS = 300,
    GOOD_RUN_CYCLES = 20000,  /* ten minutes at 30 ms; faults before them are forgotten */
    EMULATED_LUMPS_US = 8000, /* a socket's bytes wait for the emulator's other thread */
};

static struct cb_app app;

/* Work between two cycles. */
static void idle(void) {
    cb_bus_poll(&app);
    cb_commands_serve(&app);
    cb_dump_go_on(&app);
}

/* Work while waiting for the PLC. */
static void meanwhile(void) {
    cb_bus_poll(&app);
}

/* Starts the watchdog first, so that no later step can hang for good, the clock's start and the
 * loader included. */
static void start_hardware(void) {
    cb_watchdog_start(WATCHDOG_START_MS);
    app.cause = cb_retained_open(cb_chip_reset_cause());
    cb_last_cycles_open(app.cause);
    app.clock = cb_clock_start(cb_retained.crystal_failed == 0);
    app.chip = cb_chip_read(app.clock.source == CB_CLOCK_EMULATED);
    cb_time_start(app.clock.core_hz);
    cb_usart_prepare(&app.clock);
    cb_console_start(&app.console);
}

/* in : period_us of the cycle; 0: of STANDBY without a file
 * out: the watchdog's time from the first cycle on */
static uint32_t watchdog_ms(uint32_t period_us) {
    const uint32_t timeout_ms = period_us / 1000 * WATCHDOG_PERIODS;
    return timeout_ms > WATCHDOG_LEAST_MS ? timeout_ms : WATCHDOG_LEAST_MS;
}

/* out: whether the box restarted itself repeatedly. The file may be the cause, and is then not
 *      loaded. */
static bool restarts_too_often(void) {
    return cb_retained.fault_starts > CB_FAULT_STARTS_MAX;
}

static void load(void) {
    cb_load_read();
    cb_status_start(&app);
    if (restarts_too_often()) {
        cb_console_say(&app.console,
                       "too many restarts by faults: the file is not run; `restart` tries again");
        cb_retained.fault_starts = 0;
        cb_retained_seal();
        return;
    }
    app.slot = cb_load_slots(&app.box.config, &app.loading.scratch, &app.console, &app.file_crc);
    cb_status_file(&app);
}

static void note_cycle(void) {
    if (app.dump_left == 0) cb_recorder_note(&app.recorder, &app.box);
    cb_last_cycles_note(&app.box);
    if (app.trace && !app.box.config_corrupt) cb_trace_note(&app);
    cb_status_note(&app);
    if (app.box.counters.cycles == GOOD_RUN_CYCLES && cb_retained.fault_starts > 0) {
        cb_retained.fault_starts = 0;
        cb_retained_seal();
    }
}

uint32_t cb_app_lumps_us(const struct cb_app *of) {
    return of->clock.source == CB_CLOCK_EMULATED ? EMULATED_LUMPS_US : 0;
}

/* After a fault of its own the box waits for permit resume or a new enable edge, as after any loss
 * (docs/decisions/0004-enable.md). */
static _Noreturn void run_box(void) {
    const struct cb_hal hal = cb_board_hal(&app.board);
    app.board.period_us = app.box.config.period_us;
    const struct cb_rtu_manners manners = cb_rtu_manners_of(&app.box.config.plc);
    cb_board_start_plc(&app.board, app.box.config.plc.unit, &manners, cb_app_lumps_us(&app));
    cb_bus_start(&app);
    cb_recorder_start(&app.recorder, app.loading.records, CB_APP_RECORDS);
    cb_box_start(&app.box);
    app.box.mode.lost = cb_start_was_fault(app.cause);
    app.trace = cb_retained.trace != 0;
    cb_retained.trace = 0;
    cb_retained_seal();
    cb_cycle_start(&app.cycle);
    for (;;) {
        cb_cycle_run(&app.cycle, &app.box, &hal);
        note_cycle();
    }
}

_Noreturn void cb_main(void) {
    start_hardware();
    load();
    app.board.idle = idle;
    app.board.meanwhile = meanwhile;
    app.status_us = -1000000; /* prints the first one at once */
    app.board.watchdog_ms = watchdog_ms(app.slot ? app.box.config.period_us : 0);
    if (app.slot == 0) cb_standby_run(&app);
    run_box();
}
