/* SPDX-License-Identifier: MIT
 * The Pt100 modules on their own line: polled in turn (firmware/signals/bus_turns.h), with a little
 * work in each call. The exchange with the PLC never waits for them. */
#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/time.h"

enum { FIRST_BUS = 0 };

void cb_bus_start(struct cb_app *app) {
    const struct cb_config *config = &app->box.config;
    struct cb_app_bus *bus = &app->bus;
    bus->present = config->buses_count > 0;
    if (!bus->present) return;
    cb_wire_start(&bus->wire, CB_USART_BUS, &config->buses[FIRST_BUS].serial.line,
                  cb_app_lumps_us(app));
    cb_bus_turns_start(&bus->turns, config, FIRST_BUS, cb_time_us());
}

/* Stores the samples in the board for the next cycle. */
static void hand_over(struct cb_app *app) {
    struct cb_board *board = &app->board;
    board->waiting +=
        cb_bus_turns_take(&app->bus.turns, &app->box.config, app->bus.registers,
                          board->samples + board->waiting, CB_BOARD_SAMPLES - board->waiting);
}

static void end_turn(struct cb_app *app) {
    switch (app->bus.wire.end) {
        case CB_RTU_END_REPLY:
            hand_over(app);
            break;
        case CB_RTU_END_REFUSED:
            cb_bus_turns_refused(&app->bus.turns);
            break;
        case CB_RTU_END_DAMAGED:
        case CB_RTU_END_RUBBISH:
        case CB_RTU_END_SILENT:
        case CB_RTU_END_STRAY:
        case CB_RTU_END_NOT_SENT:
            break; /* the turn counts as silent */
    }
}

static void send_next(struct cb_app *app, int64_t now_us) {
    const struct cb_serial_config *serial = &app->box.config.buses[FIRST_BUS].serial;
    struct cb_modbus_request request;
    uint8_t unit;
    if (!cb_bus_turns_next(&app->bus.turns, now_us, &unit, &request)) return;
    const uint32_t patience_us =
        cb_rtu_exchange_us(&serial->line, &request, serial->slave_delay_us) + cb_app_lumps_us(app);
    cb_wire_send(&app->bus.wire, CB_RTU_SEND_REQUEST, unit, &request, app->bus.registers,
                 now_us + patience_us);
}

void cb_bus_poll(struct cb_app *app) {
    if (app->box.config_corrupt) return; /* the signals of the samples are unknown */
    struct cb_wire *wire = &app->bus.wire;
    if (!app->bus.present) return;
    const int64_t now_us = cb_time_us();
    if (wire->state == CB_WIRE_IDLE) {
        send_next(app, now_us);
    } else if (cb_wire_poll(wire, now_us)) {
        end_turn(app);
        wire->state = CB_WIRE_IDLE;
    }
}
