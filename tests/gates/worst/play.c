/* SPDX-License-Identifier: MIT */
#include "tests/gates/worst/play.h"

#include <string.h>

#include "firmware/wire/number.h"
#include "tests/gates/instructions/counter.h"

enum { CONTROL = 0xB }; /* enable, referenced, permit resume */

/* Two boxes for reloads; while the file is loaded, the second one is the loader's memory. */
static union {
    struct cb_box box[2];
    struct {
        struct cb_box loading;
        struct cb_load_scratch scratch;
    } at_load;
} memory;

/* The world between two steps. */
static struct {
    unsigned current; /* index of the box that runs */
    struct cb_inputs in;
    struct cb_outputs out;
    uint16_t written[CB_MAX_WRITE_REGISTERS]; /* what the PLC holds */
    float raw[CB_MAX_SIGNALS];                /* of each measured signal, as last sent */
    int64_t now_us;
} world;

static struct cb_box *running(void) {
    return &memory.box[world.current];
}

const struct cb_config *play_config(void) {
    return &running()->config;
}

bool play_load(const char *text, size_t length, const struct cb_target *target,
               struct cb_message *message) {
    struct cb_config *config = &memory.box[0].config;
    if (cb_config_load(config, text, length, target, &memory.at_load.scratch, message) != CB_OK)
        return false;
    cb_box_start(&memory.box[0]);
    memcpy(&memory.box[1].config, config, sizeof *config);
    return true;
}

/* ---- time ---- */

/* out: time from one step to the next */
static int64_t gap_us(uint8_t code) {
    const int64_t period_us = play_config()->period_us;
    const int64_t special[] = {period_us,
                               period_us + 1,
                               period_us - 1,
                               period_us / 2,
                               2 * period_us,
                               2 * period_us + 1,
                               3 * period_us,
                               9 * period_us / 2,
                               5 * period_us,
                               5 * period_us + 1,
                               1,
                               0,
                               -period_us,
                               1000000,
                               10000000,
                               INT64_C(5000000000)};
    const unsigned count = sizeof special / sizeof special[0];
    return code < count ? special[code] : period_us * code / 128;
}

/* ---- numbers ---- */

/* out: the next value in the unit of the signal */
static float next_value(const struct cb_signal_config *signal, uint8_t code, float last) {
    const float range = signal->max - signal->min;
    const float usual = signal->max_rate_per_s > 0.0f ? signal->max_rate_per_s : range;
    const float way = usual * (float)play_config()->period_us * 1e-6f;
    switch (code) {
        case 1:
            return signal->min;
        case 2:
            return signal->max;
        case 3:
            return signal->min - range * 0.01f;
        case 4:
            return signal->max + range * 0.01f;
        case 5:
            return 0.0f / 0.0f;
        case 6:
            return last + signal->scale;
        case 7:
            return last - signal->scale;
        case 8:
            return last + 0.1f * way;
        case 9:
            return last - 0.1f * way;
        case 10:
            return last + 0.9f * way;
        case 11:
            return last - 0.9f * way;
        case 12:
            return last + 3.0f * way;
        case 13:
            return last - 3.0f * way;
        case 14:
            return signal->min + 1e-3f * range;
        case 15:
            return signal->max - 1e-3f * range;
        default:
            return signal->min + range * (float)(code - 16) / 239.0f;
    }
}

/* Sends a number as registers; what no register of the type can represent as its highest bits. */
static void put(uint8_t type, float number, uint16_t *registers) {
    if (cb_number_encode(type, number, registers)) return;
    registers[0] = 0x7FC0;
    if (cb_number_registers(type) > 1) registers[1] = 0x7FC0;
}

static void put_sample(unsigned signal, float raw) {
    if (world.in.sample_count == CB_MAX_SAMPLES) return;
    world.in.samples[world.in.sample_count++] =
        (struct cb_sample){(uint8_t)signal, raw, world.in.read_us};
}

static void put_signals(const struct play_event *event) {
    const struct cb_config *config = play_config();
    const unsigned measured = (unsigned)config->signals_count - config->lags_count;
    for (unsigned k = 0; k < measured; ++k) {
        const unsigned i = config->measured[k];
        const struct cb_signal_config *signal = &config->signals[i];
        const uint8_t code = event->signal[k];
        if (code == 0) continue;
        const float last = world.raw[i] * signal->scale + signal->zero;
        const float value = next_value(signal, code, last == last ? last : 0.0f);
        world.raw[i] = (value - signal->zero) / signal->scale;
        if (signal->source == CB_SOURCE_PLC)
            put(signal->type, world.raw[i], world.in.registers + signal->reg);
        else
            put_sample(i, world.raw[i]);
    }
    const unsigned sent = world.in.sample_count;
    for (unsigned k = 0; sent > 0 && event->faults & PLAY_FLOOD && k < CB_MAX_SAMPLES; ++k)
        put_sample(world.in.samples[k % sent].signal, world.in.samples[k % sent].raw);
}

/* in : code, not 0. out: a value that a register of the channel may have */
static void put_channel(const struct cb_channel_config *channel, uint8_t code,
                        uint16_t *registers) {
    const float most = code & 1 ? channel->limit_um : 2.0f * channel->error_um;
    const float um = (float)(code - 128) / 127.0f * most;
    put(channel->type, code == 255 ? 0.0f / 0.0f : um / channel->scale, registers);
}

/* The write block as the PLC has it, and what it applies. */
static void put_channels(const struct play_event *event) {
    const struct cb_config *config = play_config();
    memcpy(world.in.held_registers, world.written, sizeof world.written);
    world.in.held_registers[config->plc.status] ^= event->status;
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        const struct cb_channel_config *channel = &config->channels[i];
        uint16_t *const held = world.in.held_registers + channel->reg;
        if (event->held_value[i] != 0) put_channel(channel, event->held_value[i], held);
        if (!channel->has_applied) continue;
        uint16_t *const applied = world.in.registers + channel->applied_reg;
        memcpy(applied, world.written + channel->reg,
               cb_number_registers(channel->type) * sizeof *applied);
        if (event->applied[i] != 0) put_channel(channel, event->applied[i], applied);
    }
}

/* ---- events ---- */

static uint8_t transfer(uint8_t code, enum cb_transfer usual) {
    return code == 0 ? (uint8_t)usual : (uint8_t)(code - 1);
}

static void put_reading(const struct play_event *event) {
    const struct cb_plc_config *plc = &play_config()->plc;
    uint16_t *const registers = world.in.registers;
    registers[plc->control] = CONTROL ^ event->control;
    registers[plc->plc_heartbeat] += (uint16_t)(1 + event->beats);
    if (plc->has_handshake) registers[plc->handshake] = event->status;
    world.in.read_ok = !(event->faults & PLAY_SILENT);
    world.in.read_us = world.now_us - event->age * (int64_t)play_config()->period_us / 64;
    if (event->age == 255) world.in.read_us = world.now_us + 1;
    world.in.sample_count = 0;
    put_signals(event);
    put_channels(event);
    if (!plc->read.counters) return;
    ++registers[0];
    registers[plc->read.count - 1] = registers[0] + (event->faults & PLAY_TORN ? 1u : 0u);
}

static void put_event(const struct play_event *event) {
    const bool writing = world.out.write;
    const bool wanted = cb_box_wants_held(running()) != CB_WANT_NOTHING;
    world.now_us += gap_us(event->gap);
    world.in.last_write = transfer(event->write, writing ? CB_TRANSFER_OK : CB_TRANSFER_NONE);
    if (writing && world.in.last_write == CB_TRANSFER_OK)
        memcpy(world.written, world.out.registers, sizeof world.written);
    put_reading(event);
    world.in.held =
        transfer(event->held, wanted && world.in.read_ok ? CB_TRANSFER_OK : CB_TRANSFER_NONE);
    world.in.stop = event->faults & PLAY_STOP;
    world.in.missed_ticks = event->missed;
    world.in.exchange_us = event->exchange * 500u;
}

/* A name is another one with its highest bit set. */
static void rename_one(char *name, bool other) {
    *name = (char)(other ? *name | 0x80 : *name & 0x7F);
}

/* Gives other names to signals, terms and channels, or the usual ones. */
static void rename_parts(struct cb_config *config, uint8_t faults) {
    for (unsigned i = 0; i < config->signals_count; ++i)
        rename_one(config->signals[i].name, faults & PLAY_NEW_SIGNALS);
    for (unsigned i = 0; i < config->outputs_count; ++i)
        rename_one(config->outputs[i].name, faults & PLAY_NEW_TERMS);
    for (unsigned i = 0; i < cb_all_channels(config); ++i)
        rename_one(config->channels[i].name, faults & PLAY_NEW_CHANNELS);
}

/* out: true: the other box runs, with another file of the same size */
static bool reload(uint8_t faults) {
    struct cb_box *const fresh = &memory.box[1 - world.current];
    rename_parts(&fresh->config, faults);
    cb_box_start(fresh);
    if (!cb_box_adopt(fresh, running())) return false;
    world.current = 1 - world.current;
    return true;
}

static void one_step(void *unused) {
    (void)unused;
    cb_box_step(running(), &world.in, world.now_us, &world.out);
}

static void start(void) {
    memset(&world, 0, sizeof world);
    rename_parts(&running()->config, 0);
    cb_box_start(running());
    const struct cb_config *config = play_config();
    for (unsigned i = 0; i < config->signals_count; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        world.raw[i] = (0.5f * (signal->min + signal->max) - signal->zero) / signal->scale;
        if (signal->source == CB_SOURCE_PLC)
            put(signal->type, world.raw[i], world.in.registers + signal->reg);
    }
}

void play(const struct play_event *events, unsigned count, struct play_most most[PLAY_KINDS]) {
    memset(most, 0, PLAY_KINDS * sizeof *most);
    start();
    for (unsigned i = 0; i < count; ++i) {
        enum play_kind kind = i == 0 ? PLAY_FIRST : PLAY_LATER;
        const bool reloads = events[i].faults & PLAY_RELOAD;
        if (i == 0) running()->life.stopped_before = reloads;
        if (i > 0 && reloads && reload(events[i].faults)) kind = PLAY_RELOADED;
        put_event(&events[i]);
        const uint32_t used = counter_of(one_step, 0);
        if (used > most[kind].count) most[kind] = (struct play_most){used, i, running()->mode.mode};
    }
}
