/* SPDX-License-Identifier: MIT
 * The flight recorder and the trace as text. Numbers that must read back exactly are hexadecimal
 * bits; docs/stm32f405.md has the columns. */
#include "hal/stm32f405/app/app.h"
#include "hal/stm32f405/app/last_cycles.h"

enum { LINES_AT_ONCE = 4 };

static void put_hex(struct cb_text *line, uint32_t number, unsigned digits) {
    cb_text_put(line, " ");
    cb_text_put_hex(line, number, digits);
}

static void put_time(struct cb_text *line, int64_t time_us) {
    cb_text_put(line, " ");
    cb_text_put_signed64(line, time_us);
}

static void put_floats(struct cb_text *line, const float *values, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
        cb_text_put(line, " ");
        cb_text_put_float_bits(line, values[i]);
    }
}

static void put_registers(struct cb_text *line, const char *name, const uint16_t *registers,
                          unsigned count) {
    cb_text_put(line, name);
    for (unsigned i = 0; i < count; ++i) cb_text_put_hex(line, registers[i], 4);
}

static void begin(struct cb_app *app, const struct cb_recorder *recorder) {
    app->dumped = recorder;
    app->dump_left = recorder->count;
    cb_console_say(&app->console,
                   "dump: cycle time_us mode reason control counters detail channels");
    if (app->dump_left == 0) cb_console_say(&app->console, "dump: end");
}

void cb_dump_request(struct cb_app *app) {
    begin(app, &app->recorder);
}

void cb_dump_request_kept(struct cb_app *app) {
    const struct cb_recorder *kept = cb_last_cycles_kept();
    if (kept->count > 0)
        begin(app, kept);
    else
        cb_console_say(&app->console, "no unwanted restart since power-on ended a run");
}

/* A file that changed in memory, or none at all, does not say how many channels there are. */
static unsigned channels_of(const struct cb_app *app) {
    const unsigned channels = app->box.config.channels_count;
    return channels > 0 && channels < CB_MAX_CHANNELS ? channels : CB_MAX_CHANNELS;
}

static void print_record(struct cb_app *app, const struct cb_record *record) {
    struct cb_text *line = cb_console_line(&app->console);
    cb_text_put(line, "D ");
    cb_text_put_unsigned(line, record->cycle);
    put_time(line, record->time_us);
    put_hex(line, record->mode, 2);
    put_hex(line, record->reason, 2);
    put_hex(line, record->control, 4);
    put_hex(line, record->counters, 8);
    put_hex(line, record->detail, 4);
    put_floats(line, record->channel_um, channels_of(app));
    cb_console_end(&app->console);
}

/* The recorder pauses during a dump: main.c checks dump_left. */
void cb_dump_go_on(struct cb_app *app) {
    for (unsigned i = 0; i < LINES_AT_ONCE && app->dump_left > 0 && cb_console_has_room(2); ++i) {
        const struct cb_record *record = cb_recorder_at(app->dumped, --app->dump_left);
        if (record) print_record(app, record);
        if (app->dump_left == 0) cb_console_say(&app->console, "dump: end");
    }
}

static void put_samples(struct cb_text *line, const struct cb_inputs *in) {
    for (unsigned i = 0; i < in->sample_count; ++i) {
        cb_text_put(line, " S");
        cb_text_put_hex(line, in->samples[i].signal, 2);
        cb_text_put_float_bits(line, in->samples[i].raw);
        put_time(line, in->samples[i].time_us);
    }
}

/* Inputs and outputs of the step. The exchange's last two numbers are those after the cycle: the
 * result of its write. */
void cb_trace_note(struct cb_app *app) {
    const struct cb_inputs *in = &app->cycle.in;
    const struct cb_outputs *out = &app->cycle.out;
    const struct cb_plc_config *plc = &app->box.config.plc;
    struct cb_text *line = cb_console_line(&app->console);
    cb_text_put(line, "T ");
    cb_text_put_unsigned(line, app->box.counters.cycles);
    put_time(line, app->box.life.now_us);
    put_time(line, in->read_us);
    put_hex(line, in->missed_ticks, 4);
    put_hex(line, (uint32_t)in->read_ok | (uint32_t)in->stop << 1 | (uint32_t)out->write << 2, 1);
    put_hex(line, in->held, 1);
    put_hex(line, app->cycle.write, 1);
    put_hex(line, in->exchange_us, 8);
    if (in->read_ok) put_registers(line, " R", in->registers, plc->read.count);
    if (in->held == CB_TRANSFER_OK) put_registers(line, " H", in->held_registers, plc->write.count);
    put_samples(line, in);
    put_registers(line, " W", out->registers, plc->write.count);
    cb_text_put(line, " C");
    put_floats(line, out->channel_um, app->box.config.channels_count);
    cb_console_end(&app->console);
}
