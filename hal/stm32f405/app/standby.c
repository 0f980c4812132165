/* SPDX-License-Identifier: MIT
 * A box without a usable file: it reports this on the console and, if a slot's header has the
 * place, in the PLC's status register. It writes nothing else, also no heartbeat. */
#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/app/load.h"
#include "hal/stm32f405/time.h"

enum { PERIOD_US = 30000, WRITE_EVERY = 32, ANSWER_US = 500000 };

static void start_wire(struct cb_app *app, const struct cb_slot_report *report) {
    const struct cb_rtu_line line = {
        .baud = report->baud, .parity = report->parity, .stop_bits = report->stop_bits};
    cb_wire_start(&app->board.plc, CB_USART_PLC, &line, cb_app_lumps_us(app));
}

static void write_status(struct cb_app *app, const struct cb_slot_report *report) {
    const uint16_t status = (uint16_t)(CB_MODE_STANDBY | CB_REASON_NO_FILE << 8);
    const struct cb_modbus_request request = cb_modbus_write(report->status, 1, &status);
    cb_wire_send(&app->board.plc, CB_RTU_SEND_REQUEST, report->unit, &request, 0,
                 cb_time_us() + ANSWER_US);
}

_Noreturn void cb_standby_run(struct cb_app *app) {
    const struct cb_hal hal = cb_board_hal(&app->board);
    struct cb_slot_report report;
    const bool has_place = cb_load_report_place(&report);
    if (has_place) start_wire(app, &report);
    app->board.period_us = PERIOD_US;
    for (uint32_t cycle = 0;; ++cycle) {
        (void)cb_board_wait_tick(&app->board);
        if (has_place && cycle % WRITE_EVERY == 0) write_status(app, &report);
        (void)cb_wire_poll(&app->board.plc, cb_time_us());
        cb_status_note(app);
        hal.feed_watchdog(hal.context);
    }
}
