/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/app/load.h"
#include "hal/stm32f405/fault.h"

struct command {
    const char *words, *help;
    void (*run)(struct cb_app *app);
};

static void help(struct cb_app *app);

static void say_trace(struct cb_app *app) {
    app->trace = true;
}

static void end_trace(struct cb_app *app) {
    app->trace = false;
}

static void restart(struct cb_app *app) {
    (void)app;
    cb_restart(CB_START_ASKED);
}

static void restart_with_trace(struct cb_app *app) {
    cb_retained.trace = 1;
    restart(app);
}

static void stop(struct cb_app *app) {
    app->board.stop = true;
}

static void show_slots(struct cb_app *app) {
    cb_load_report(&app->console);
}

static void crash_undefined(struct cb_app *app) {
    (void)app;
    cb_provoke(CB_PROVOKE_UNDEFINED);
}

static void crash_address(struct cb_app *app) {
    (void)app;
    cb_provoke(CB_PROVOKE_ADDRESS);
}

static void crash_stack(struct cb_app *app) {
    (void)app;
    cb_provoke(CB_PROVOKE_STACK);
}

static void crash_canary(struct cb_app *app) {
    (void)app;
    cb_provoke(CB_PROVOKE_CANARY);
}

static void crash_hang(struct cb_app *app) {
    (void)app;
    cb_provoke(CB_PROVOKE_HANG);
}

static const struct command commands[] = {
    {"help", "this list", help},
    {"start", "why and with what the box started", cb_status_start},
    {"slots", "the coefficient files in flash", show_slots},
    {"counters", "all counters that are not 0", cb_status_counters},
    {"wires", "what happened on the serial lines", cb_status_wires},
    {"fault", "registers of the last processor fault", cb_status_fault},
    {"dump", "the flight recorder, oldest cycle first", cb_dump_ask},
    {"trace on", "a line about each cycle", say_trace},
    {"trace off", "no more of them", end_trace},
    {"trace start", "restart, with a trace from the first cycle on", restart_with_trace},
    {"stop", "ramp to zero, then STOPPED until the next start", stop},
    {"restart", "start anew", restart},
    {"crash undefined", "test: an undefined instruction", crash_undefined},
    {"crash address", "test: a write where no memory is", crash_address},
    {"crash stack", "test: a stack overflow", crash_stack},
    {"crash canary", "test: a stack that has run to its last word", crash_canary},
    {"crash hang", "test: an endless loop, for the watchdog", crash_hang},
};

enum { COMMANDS = sizeof commands / sizeof commands[0] };

static void help(struct cb_app *app) {
    for (unsigned i = 0; i < COMMANDS; ++i) {
        struct cb_text *line = cb_console_line(&app->console);
        cb_text_put(line, "  ");
        cb_text_put(line, commands[i].words);
        while (line->length < 20) cb_text_put(line, " ");
        cb_text_put(line, commands[i].help);
        cb_console_end(&app->console);
    }
}

static bool same(const char *a, const char *b) {
    while (*a == *b && *a != 0) ++a, ++b;
    return *a == *b;
}

void cb_commands_serve(struct cb_app *app) {
    const char *typed = cb_console_take(&app->console);
    if (typed == 0) return;
    for (unsigned i = 0; i < COMMANDS; ++i) {
        if (!same(typed, commands[i].words)) continue;
        commands[i].run(app);
        return;
    }
    cb_console_say(&app->console, "no such command; `help` lists them");
}
