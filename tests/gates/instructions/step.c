/* SPDX-License-Identifier: MIT */
#include "tests/gates/instructions/step.h"

#include <string.h>

#include "firmware/box/box.h"
#include "firmware/load/load.h"
#include "tests/gates/instructions/counter.h"

static const char shared_breaks[] = {
#include "reference_load.inc" /* as bytes, by CMake */
};
static const char own_breaks[] = {
#include "reference_load_own_breaks.inc"
};
static const char bank[] = {
#include "reference_load_bank.inc"
};
static const char sigma[] = {
#include "reference_load_sigma.inc"
};
static const struct {
    const char *text;
    size_t length;
} files[] = {[STEP_SHARED_BREAKS] = {shared_breaks, sizeof shared_breaks},
             [STEP_OWN_BREAKS] = {own_breaks, sizeof own_breaks},
             [STEP_BANK] = {bank, sizeof bank},
             [STEP_SIGMA] = {sigma, sizeof sigma}};

enum { PERIOD_US = 30000, AXES = 3, THERMOMETERS = 12, FIRST_THERMOMETER = 14, TEMPERATURE = 220 };

static struct cb_box box;
static struct cb_load_scratch scratch;
static struct cb_inputs in;
static struct cb_outputs out;
static int64_t now_us;
static int32_t position[AXES], speed[AXES]; /* 0.1 µm, 0.1 µm per cycle */
static uint32_t random_state = 2463534242u;

static uint32_t next_random(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

bool step_load(enum step_file file) {
    static const struct cb_target target = {"gate", 1u << CB_SOURCE_PLC, 1u << CB_TRANSPORT_TCP, 0};
    struct cb_message message;
    return cb_config_load(&box.config, files[file].text, files[file].length, &target, &scratch,
                          &message) == CB_OK;
}

/* 10 m/min and more, to and fro over 2.4 m, at the temperature of the training data. */
static void travel(void) {
    for (int a = 0; a < AXES; ++a) {
        if (position[a] + speed[a] < 0 || position[a] + speed[a] > 24000000) speed[a] = -speed[a];
        position[a] += speed[a];
        in.registers[8 + 2 * a] = (uint16_t)((uint32_t)position[a] >> 16);
        in.registers[9 + 2 * a] = (uint16_t)position[a];
    }
    for (int i = 0; i < THERMOMETERS; ++i)
        in.registers[FIRST_THERMOMETER + i] = (uint16_t)(TEMPERATURE + next_random() % 5);
}

static void one_step(void *unused) {
    (void)unused;
    cb_box_step(&box, &in, now_us, &out);
}

/* What the step after this one will see. */
static void next_cycle(enum step_world world) {
    now_us += PERIOD_US - 50 + (int64_t)(next_random() % 100);
    ++in.registers[1];
    in.read_ok = true;
    in.last_write = (uint8_t)(out.write ? CB_TRANSFER_OK : CB_TRANSFER_NONE);
    in.held = cb_box_wants_held(&box) == CB_WANT_NOW ? CB_TRANSFER_OK : CB_TRANSFER_NONE;
    if (world != STEP_REST) travel();
    in.read_us = now_us;
}

uint32_t step_most(enum step_world world, unsigned cycles) {
    uint32_t most = 0;
    memset(&in, 0, sizeof in);
    memset(&out, 0, sizeof out);
    for (int a = 0; a < AXES; ++a) speed[a] = 50000 + 13000 * a;
    in.registers[0] = 0xB; /* enable, referenced, permit resume */
    travel();
    cb_box_start(&box);
    for (unsigned i = 0; i < cycles; ++i) {
        next_cycle(world);
        const uint32_t count = counter_of(one_step, 0);
        if (i > 0 && count > most) most = count;
    }
    return most;
}

bool step_was_active(void) {
    return box.mode.mode == CB_MODE_ACTIVE;
}
