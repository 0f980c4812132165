/* SPDX-License-Identifier: MIT
 * The program's parts, joined by main.c. */
#ifndef COMPBOX_HAL_STM32F405_APP_H
#define COMPBOX_HAL_STM32F405_APP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/box/box.h"
#include "firmware/box/recorder.h"
#include "firmware/load/load.h"
#include "firmware/signals/bus_turns.h"
#include "hal/cycle.h"
#include "hal/stm32f405/app/console.h"
#include "hal/stm32f405/box_hal.h"
#include "hal/stm32f405/chip.h"
#include "hal/stm32f405/clock.h"
#include "hal/stm32f405/retained.h"

/* The flight recorder uses the loader's memory. */
enum { CB_APP_RECORDS = sizeof(struct cb_load_scratch) / sizeof(struct cb_record) };

/* bus.c */
struct cb_app_bus {
    bool present; /* the file has one */
    struct cb_wire wire;
    struct cb_bus_turns turns;
    uint16_t registers[CB_MAX_READ_REGISTERS];
};

struct cb_app {
    struct cb_console console;
    struct cb_clock clock;
    enum cb_start_cause cause;
    struct cb_chip chip;
    uint32_t file_crc; /* of the running text, as `compbox pack` stored it before the text */
    char slot;         /* 'A', 'B'; 0: no file and no box */
    struct cb_board board;
    struct cb_app_bus bus;
    struct cb_cycle cycle;
    struct cb_recorder recorder;
    bool trace; /* one line per cycle */
    const struct cb_recorder *dumped;
    uint32_t dump_left; /* its records that are not yet sent */
    uint8_t reported_mode, reported_reason;
    uint16_t reported_detail; /* detail of the last reported mode */
    bool mode_reported;       /* a mode was reported */
    int64_t status_us;        /* of the last status line */
    struct cb_box box;
    union {
        struct cb_load_scratch scratch;
        struct cb_record records[CB_APP_RECORDS];
    } loading;
};

/* status.c: after each cycle: mode and reason when they change, a status line once a second. */
void cb_status_note(struct cb_app *app);

/* Prints version, cause of the start, clock, chip and file. */
void cb_status_start(struct cb_app *app);

/* Prints the running file, if there is one. */
void cb_status_file(struct cb_app *app);
void cb_status_counters(struct cb_app *app);
void cb_status_fault(struct cb_app *app);
void cb_status_wires(struct cb_app *app);

/* dump.c: continues a requested dump as far as the console has room; prints the trace's line. */
void cb_dump_request(struct cb_app *app);
void cb_dump_request_kept(struct cb_app *app); /* last_cycles.h */
void cb_dump_go_on(struct cb_app *app);
void cb_trace_note(struct cb_app *app);

/* Gap between the lumps in which bytes arrive: a socket of the emulator waits for another
 * thread. */
uint32_t cb_app_lumps_us(const struct cb_app *app);

/* standby.c: runs instead of a box. */
_Noreturn void cb_standby_run(struct cb_app *app);

/* bus.c: starts the line; does the work that is due on it. */
void cb_bus_start(struct cb_app *app);
void cb_bus_poll(struct cb_app *app);

/* commands.c: executes the typed command. */
void cb_commands_serve(struct cb_app *app);

#endif
