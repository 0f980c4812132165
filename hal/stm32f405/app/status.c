/* SPDX-License-Identifier: MIT
 * Status lines of the console, and its commands start, counters, wires and fault. */
#include <string.h>

#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/time.h"

enum { STATUS_US = 1000000, COUNTER_BYTES = 32 /* of a name and a number, at most */ };

/* Time as all lines begin with it. */
static struct cb_text *begin(struct cb_app *app) {
    struct cb_text *line = cb_console_line(&app->console);
    cb_text_put_thousandths(line, cb_time_us() / 1000, 3);
    cb_text_put(line, " ");
    return line;
}

static void put_number(struct cb_text *line, const char *name, uint32_t number) {
    cb_text_put(line, name);
    cb_text_put_unsigned(line, number);
}

static const char *name_of(const struct cb_box *box, char what) {
    const struct cb_config *config = &box->config;
    const uint8_t index = box->cause.index;
    if (what == 's') return config->signals[index].name;
    if (what == 'c') return config->channels[index].name;
    return config->outputs[config->terms[index].first_output].name;
}

/* Writes the signal, term or channel behind the reason, its value and its bound. */
static void put_cause(struct cb_text *line, const struct cb_box *box) {
    const struct cb_cause_words words = cb_cause_words_of(box->cause.kind);
    if (box->cause.kind == CB_CAUSE_NONE) return;
    const char *const parts[] = {": ", words.what,  " ", name_of(box, words.what[0]),
                                 " ",  words.before};
    for (unsigned i = 0; i < sizeof parts / sizeof parts[0]; ++i) cb_text_put(line, parts[i]);
    if (words.between[0] == 0) return;
    cb_text_put(line, " ");
    cb_text_put_tenths(line, box->cause.value);
    cb_text_put(line, " ");
    cb_text_put(line, words.between);
    cb_text_put(line, " ");
    cb_text_put_tenths(line, box->cause.bound);
}

static void put_mode(struct cb_text *line, const struct cb_box *box) {
    cb_text_put(line, cb_mode_name(box->mode.mode));
    cb_text_put(line, ": ");
    cb_text_put(line, cb_reason_text(box->mode.reason));
    put_cause(line, box);
}

static void put_channels(struct cb_text *line, const struct cb_box *box) {
    for (unsigned i = 0; i < box->config.channels_count; ++i) {
        cb_text_put(line, i == 0 ? "; " : " ");
        cb_text_put(line, box->config.channels[i].name);
        cb_text_put(line, " ");
        cb_text_put_tenths(line, box->channels[i].output_um);
    }
    cb_text_put(line, " um");
}

static void put_stack(struct cb_text *line) {
    put_number(line, "; stack ", cb_guard_stack_used());
    put_number(line, "/", cb_guard_stack_bytes());
}

static void print_status(struct cb_app *app) {
    struct cb_text *line = begin(app);
    if (app->slot == 0) {
        cb_text_put(line, "STANDBY: ");
        cb_text_put(line, cb_reason_text(CB_REASON_NO_FILE));
    } else {
        put_mode(line, &app->box);
        if (!app->box.config_corrupt) put_channels(line, &app->box);
        put_number(line, "; cycles ", app->box.counters.cycles);
        put_number(line, " missed ", app->box.counters.missed_ticks);
    }
    put_stack(line);
    if (app->console.lost > 0) put_number(line, "; lines lost ", app->console.lost);
    cb_console_end(&app->console);
}

static void print_mode(struct cb_app *app) {
    struct cb_text *line = begin(app);
    cb_text_put(line, "now ");
    put_mode(line, &app->box);
    cb_console_end(&app->console);
    app->reported_mode = app->box.mode.mode;
    app->reported_reason = app->box.mode.reason;
    app->reported_detail = cb_cause_detail(&app->box.cause);
    app->mode_reported = true;
}

static bool mode_changed(const struct cb_app *app) {
    const uint8_t reason = app->box.mode.reason;
    const bool moved =
        reason == CB_REASON_SIGNAL && app->reported_detail != cb_cause_detail(&app->box.cause);
    return !app->mode_reported || app->reported_mode != app->box.mode.mode ||
           app->reported_reason != reason || moved;
}

void cb_status_note(struct cb_app *app) {
    if (app->slot != 0 && mode_changed(app)) print_mode(app);
    const int64_t now_us = cb_time_us();
    if (now_us - app->status_us < STATUS_US) return;
    app->status_us = now_us;
    print_status(app);
}

static void print_chip(struct cb_app *app) {
    const struct cb_chip *chip = &app->chip;
    struct cb_text *line = begin(app);
    cb_text_put(line, "chip ");
    for (unsigned i = 0; i < 3; ++i) cb_text_put_hex(line, chip->unique_id[i], 8);
    cb_text_put(line, "; brown-out reset ");
    cb_text_put(line, cb_brown_out_text(chip->brown_out));
    if (!cb_chip_is_guarded(chip))
        cb_text_put(line, ": set the option bytes to level 3 (docs/stm32f405.md)");
    cb_console_end(&app->console);
}

void cb_status_file(struct cb_app *app) {
    if (app->slot == 0) return;
    struct cb_text *line = begin(app);
    put_number(line, "runs revision ", app->box.config.revision);
    cb_text_put(line, " of slot ");
    cb_text_put_bytes(line, &app->slot, 1);
    cb_text_put(line, ": ");
    cb_text_put(line, app->box.config.machine);
    cb_text_put(line, ", CRC-32 ");
    cb_text_put_hex(line, app->file_crc, 8);
    cb_console_end(&app->console);
}

void cb_status_start(struct cb_app *app) {
    struct cb_text *line = begin(app);
    cb_text_put(line, "compbox-stm32f405 " CB_VERSION " started: ");
    cb_text_put(line, cb_start_text(app->cause));
    if (app->cause == CB_START_ASSERTION) {
        cb_text_put(line, ", ");
        cb_text_put(line, cb_retained.assertion);
        put_number(line, ":", cb_retained.assertion_line);
    }
    cb_text_put(line, "; ");
    cb_text_put(line, cb_clock_text(app->clock.source));
    if (cb_retained.crystal_failed) cb_text_put(line, "; the crystal has FAILED");
    put_number(line, "; restarts by faults ", cb_retained.fault_starts);
    cb_console_end(&app->console);
    print_chip(app);
    cb_status_file(app);
    if (app->cause == CB_START_FAULT) cb_status_fault(app);
}

/* Writes a counter that is not 0. */
static void put_counter(struct cb_text *line, const char *name, uint32_t count) {
    if (count == 0) return;
    cb_text_put(line, " ");
    cb_text_put(line, name);
    put_number(line, "=", count);
}

static struct cb_text *begin_counters(struct cb_app *app) {
    struct cb_text *line = begin(app);
    cb_text_put(line, "counters:");
    return line;
}

/* All counters may need two lines. */
void cb_status_counters(struct cb_app *app) {
    struct cb_text *line = begin_counters(app);
    for (unsigned i = 0; i < CB_COUNTERS_COUNT; ++i) {
        uint32_t count;
        memcpy(&count, (const char *)&app->box.counters + i * sizeof count, sizeof count);
        if (line->length + COUNTER_BYTES > sizeof line->bytes) {
            cb_console_end(&app->console);
            line = begin_counters(app);
        }
        put_counter(line, cb_counter_name(i), count);
    }
    cb_console_end(&app->console);
}

static void print_wire(struct cb_app *app, const char *name, const struct cb_wire *wire) {
    const struct cb_usart_counters bytes = cb_usart_counted(wire->port);
    struct cb_text *line = begin(app);
    cb_text_put(line, name);
#define CB_X(counter) put_counter(line, #counter, wire->counters.counter);
    CB_WIRE_COUNTERS(CB_X)
#undef CB_X
    put_counter(line, "bytes_sent", bytes.sent);
    put_counter(line, "bytes_received", bytes.received);
    put_counter(line, "bytes_bad", bytes.errors);
    put_counter(line, "bytes_lost", bytes.lost);
    cb_console_end(&app->console);
}

void cb_status_wires(struct cb_app *app) {
    print_wire(app, "plc:", &app->board.plc);
    if (app->bus.present) print_wire(app, "bus:", &app->bus.wire);
}

static void put_register(struct cb_text *line, const char *name, uint32_t value) {
    cb_text_put(line, name);
    cb_text_put_hex(line, value, 8);
}

void cb_status_fault(struct cb_app *app) {
    static const char *const names[] = {" r0 ", " r1 ", " r2 ", " r3 "};
    const struct cb_fault_registers *fault = &cb_retained.fault;
    struct cb_text *line = begin(app);
    if (cb_retained.faults == 0) {
        cb_text_put(line, "no processor fault since power-on");
        cb_console_end(&app->console);
        return;
    }
    put_number(line, "processor fault ", cb_retained.faults);
    put_number(line, ": exception ", fault->exception);
    put_register(line, " pc ", fault->pc);
    put_register(line, " lr ", fault->lr);
    put_register(line, " sp ", fault->sp);
    put_register(line, " psr ", fault->psr);
    for (unsigned i = 0; i < 4; ++i) put_register(line, names[i], fault->r[i]);
    put_register(line, " r12 ", fault->r12);
    put_register(line, " exc ", fault->exc_return);
    put_register(line, " cfsr ", fault->cfsr);
    put_register(line, " hfsr ", fault->hfsr);
    put_register(line, " mmfar ", fault->mmfar);
    put_register(line, " bfar ", fault->bfar);
    cb_console_end(&app->console);
}
