/* SPDX-License-Identifier: MIT
 * replay COEFFICIENTS TRACE: gives the host's core the inputs that compbox-stm32f405 traced on its
 * console (docs/stm32f405.md), cycle by cycle from its start, and compares every output bit. Lines
 * of the flight recorder in the same file are compared too. Prints what was compared; exit 1 at the
 * first difference. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/box/box.h"
#include "firmware/box/recorder.h"
#include "firmware/load/load.h"
#include "hal/hal.h"

enum { LINE = 8192, RECORDS = 1 << 20 };

static struct cb_box box;
static struct cb_load_scratch scratch;
static struct cb_inputs in;
static struct cb_outputs out;
static struct cb_recorder recorder;

/* One line of the trace, taken apart. */
struct line {
    uint32_t cycle, missed, flags, held, write, exchange_us;
    int64_t now_us, read_us;
    char *words; /* R…, H…, S…, W…, C … */
};

static int fail(const char *what, uint32_t cycle) {
    printf("cycle %u: %s\n", (unsigned)cycle, what);
    return 1;
}

/* The next word of *rest, which then stands behind it; NULL when there is none. */
static char *next_word(char **rest) {
    char *word = *rest + strspn(*rest, " \r\n");
    const size_t size = strcspn(word, " \r\n");
    if (size == 0) return NULL;
    *rest = word + size + (word[size] != 0);
    word[size] = 0;
    return word;
}

static bool load(const char *path) {
    static char text[CB_MAX_TEXT_BYTES];
    static const struct cb_target target = {"replay", 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_BUS,
                                            1u << CB_TRANSPORT_RTU, 0};
    struct cb_message message;
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    const size_t length = fread(text, 1, sizeof text, file);
    fclose(file);
    if (cb_config_load(&box.config, text, length, &target, &scratch, &message) == CB_OK)
        return true;
    printf("%s: %s\n", path, message.text);
    return false;
}

static uint32_t hex(const char *digits, size_t count) {
    char word[9] = {0};
    memcpy(word, digits, count);
    return (uint32_t)strtoul(word, NULL, 16);
}

static bool take_apart(char *text, struct line *line) {
    int used = 0;
    long long now_us, read_us;
    const int fields =
        sscanf(text, "T %u %lld %lld %x %x %x %x %x%n", &line->cycle, &now_us, &read_us,
               &line->missed, &line->flags, &line->held, &line->write, &line->exchange_us, &used);
    line->now_us = now_us;
    line->read_us = read_us;
    line->words = text + used;
    return fields == 8;
}

/* in : count registers of four digits */
static bool take_registers(const char *digits, uint16_t *registers, unsigned count) {
    if (strspn(digits, "0123456789abcdef") != 4 * (size_t)count) return false;
    for (unsigned i = 0; i < count; ++i) registers[i] = (uint16_t)hex(digits + 4 * i, 4);
    return true;
}

/* What the cycle's exchange handed to the step; with FC3 and FC16 the write is that of the cycle
 * before (hal/cycle.c). in : before: the line of that cycle, all 0 at the start */
static void take_times(const struct line *line, const struct line *before, bool wrote_before) {
    const bool combined = box.config.plc.exchange == CB_EXCHANGE_FC23;
    const struct line *writer = combined ? line : before;
    in.missed_ticks = line->missed;
    in.read_ok = line->flags & 1;
    in.stop = line->flags >> 1 & 1;
    in.held = (uint8_t)line->held;
    in.read_us = line->read_us;
    in.last_write = wrote_before ? (uint8_t)writer->write : CB_TRANSFER_NONE;
    in.exchange_us = writer->exchange_us;
    in.sample_count = 0;
}

static void take_sample(const char *digits, char **rest) {
    struct cb_sample *sample = &in.samples[in.sample_count++];
    const uint32_t bits = hex(digits + 2, 8);
    sample->signal = (uint8_t)hex(digits, 2);
    memcpy(&sample->raw, &bits, sizeof bits);
    sample->time_us = strtoll(next_word(rest), NULL, 10);
}

static bool same_floats(char **rest, const float *values, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
        const char *word = next_word(rest);
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        if (!word || hex(word, 8) != bits) return false;
    }
    return true;
}

/* Inputs of one line, the step, and the comparison. */
static int replay(const struct line *line) {
    const struct cb_plc_config *plc = &box.config.plc;
    uint16_t written[CB_MAX_WRITE_REGISTERS];
    char *rest = line->words, *word = next_word(&rest);
    for (; word && *word != 'W'; word = next_word(&rest)) {
        bool good = true;
        if (*word == 'R') good = take_registers(word + 1, in.registers, plc->read.count);
        if (*word == 'H') good = take_registers(word + 1, in.held_registers, plc->write.count);
        if (*word == 'S') take_sample(word + 1, &rest);
        if (!good) return fail("its line is damaged", line->cycle);
    }
    if (!word || !take_registers(word + 1, written, plc->write.count))
        return fail("its line is damaged", line->cycle);
    cb_box_step(&box, &in, line->now_us, &out);
    cb_recorder_note(&recorder, &box);
    if (memcmp(written, out.registers, plc->write.count * sizeof written[0]) != 0)
        return fail("the registers differ", line->cycle);
    if (out.write != (line->flags >> 2 & 1)) return fail("one of both writes", line->cycle);
    word = next_word(&rest);
    if (!word || *word != 'C' || !same_floats(&rest, out.channel_um, box.config.channels_count))
        return fail("the channels differ", line->cycle);
    return 0;
}

static int compare_record(char *text) {
    struct cb_record read = {0};
    unsigned cycle, mode, reason, control, counters, detail;
    long long time_us;
    int used = 0;
    if (sscanf(text, "D %u %lld %x %x %x %x %x%n", &cycle, &time_us, &mode, &reason, &control,
               &counters, &detail, &used) != 7)
        return fail("a recorder's line is damaged", read.cycle);
    const struct cb_record *own =
        cycle > box.counters.cycles ? NULL : cb_recorder_at(&recorder, box.counters.cycles - cycle);
    if (!own) return fail("was recorded, but not traced", cycle);
    char *rest = text + used;
    if (own->cycle != cycle || own->time_us != time_us || own->mode != mode ||
        own->reason != reason || own->control != control || own->counters != counters ||
        own->detail != detail)
        return fail("the recorder says something else", cycle);
    for (unsigned i = 0; i < box.config.channels_count; ++i) {
        const char *word = next_word(&rest);
        uint32_t bits;
        memcpy(&bits, &own->channel_um[i], sizeof bits);
        if (!word || hex(word, 8) != bits) return fail("the recorder's channels differ", cycle);
    }
    return 0;
}

int main(int argc, char **argv) {
    static char text[LINE];
    static struct cb_record records[RECORDS / 16];
    struct line line = {0}, before = {0};
    unsigned cycles = 0, compared = 0, active = 0;
    bool wrote = false;
    FILE *file = argc == 3 ? fopen(argv[2], "r") : NULL;
    if (!file || !load(argv[1])) return 2;
    cb_recorder_start(&recorder, records, sizeof records / sizeof records[0]);
    cb_box_start(&box);
    while (fgets(text, sizeof text, file)) {
        if (strncmp(text, "D ", 2) == 0) {
            if (compare_record(text) != 0) return 1;
            ++compared;
        }
        if (strncmp(text, "T ", 2) != 0) continue;
        if (!take_apart(text, &line) || line.cycle != cycles + 1)
            return fail("a line of the trace is missing behind it", cycles);
        take_times(&line, &before, wrote);
        if (replay(&line) != 0) return 1;
        wrote = out.write;
        before = line;
        active += box.mode.mode == CB_MODE_ACTIVE;
        ++cycles;
    }
    fclose(file);
    printf("{\"cycles\": %u, \"active\": %u, \"records\": %u, \"differences\": 0}\n", cycles,
           active, compared);
    return 0;
}
