/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/app/commands.h"

#include "hal/stm32f405/app/load.h"

static void help(struct cb_app *app);

static void begin_trace(struct cb_app *app) {
    app->trace = true;
}

static void end_trace(struct cb_app *app) {
    app->trace = false;
}

static void restart(struct cb_app *app) {
    (void)app;
    cb_restart(CB_START_REQUESTED);
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

static const struct cb_command commands[] = {
    {"help", "this list", help},
    {"start", "cause and state of the start", cb_status_start},
    {"slots", "the coefficient files in flash", show_slots},
    {"counters", "all counters that are not 0", cb_status_counters},
    {"wires", "counters of the serial lines", cb_status_wires},
    {"fault", "registers of the last processor fault", cb_status_fault},
    {"dump", "the flight recorder, oldest cycle first", cb_dump_request},
    {"dump before", "the cycles before the last unwanted restart", cb_dump_request_kept},
    {"trace on", "a line about each cycle", begin_trace},
    {"trace off", "no more of them", end_trace},
    {"trace start", "restart, with a trace from the first cycle on", restart_with_trace},
    {"stop", "ramp to zero, then STOPPED until the next start", stop},
    {"restart", "restart the box", restart},
};

static const struct cb_command_list all = {commands, sizeof commands / sizeof commands[0]};

static void list_help(struct cb_app *app, const struct cb_command_list *list) {
    for (unsigned i = 0; i < list->count; ++i) {
        struct cb_text *line = cb_console_line(&app->console);
        cb_text_put(line, "  ");
        cb_text_put(line, list->commands[i].words);
        while (line->length < 20) cb_text_put(line, " ");
        cb_text_put(line, list->commands[i].help);
        cb_console_end(&app->console);
    }
}

static void help(struct cb_app *app) {
    list_help(app, &all);
    list_help(app, &cb_test_commands);
}

static bool same(const char *a, const char *b) {
    while (*a == *b && *a != 0) ++a, ++b;
    return *a == *b;
}

/* out: the typed command, or NULL */
static const struct cb_command *find(const struct cb_command_list *list, const char *typed) {
    for (unsigned i = 0; i < list->count; ++i)
        if (same(typed, list->commands[i].words)) return &list->commands[i];
    return 0;
}

void cb_commands_serve(struct cb_app *app) {
    const char *typed = cb_console_take(&app->console);
    if (typed == 0) return;
    const struct cb_command *command = find(&all, typed);
    if (command == 0) command = find(&cb_test_commands, typed);
    if (command)
        command->run(app);
    else
        cb_console_say(&app->console, "no such command; `help` lists them");
}
