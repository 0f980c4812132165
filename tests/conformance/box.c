/* SPDX-License-Identifier: MIT
 * The whole box: one coefficient file read from text, then thousands of cycles against a PLC and
 * sensors that misbehave at random (integers only, so that all targets see the same). No oracle:
 * what always holds is checked in every cycle, and every output bit goes into the hash. */
#include "firmware/box/box.h"

#include <stdbool.h>
#include <string.h>

#include "firmware/load/load.h"
#include "models/num.h"
#include "tests/conformance/check.h"

static const char text[] = {
#include "box_json.inc" /* tests/conformance/box.json as bytes, by CMake */
};

enum { CYCLES = 6000, PERIOD_US = 30000, SIGNAL_T1 = 4 };

struct cb_box conformance_box;

static struct cb_load_scratch scratch;
static struct cb_inputs in;
static struct cb_outputs out;

/* The world outside the box. */
struct world {
    uint32_t random;
    int32_t position[2], speed[2]; /* of X and Y, 0.1 µm and 0.1 µm per cycle */
    int16_t t1;                    /* 0.1 °C */
    uint16_t heartbeat, control;
    uint32_t silent; /* cycles for which the PLC stays unreadable */
    uint16_t held[CB_MAX_WRITE_REGISTERS];
    int64_t now_us;
};

static uint32_t next_random(struct world *world) {
    uint32_t x = world->random;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return world->random = x;
}

/* true in `per_mille` of 1000 calls. */
static bool happens(struct world *world, uint32_t per_mille) {
    return next_random(world) % 1000 < per_mille;
}

/* The axis moves on, turns round at the ends of its travel and sometimes changes its feed. */
static void move(struct world *world, int axis, int32_t travel) {
    if (happens(world, 20)) world->speed[axis] = (int32_t)(next_random(world) % 1000000) - 500000;
    int32_t *position = &world->position[axis];
    *position += world->speed[axis];
    if (*position < 0 || *position > travel) {
        *position = *position < 0 ? 0 : travel;
        world->speed[axis] = -world->speed[axis];
    }
}

static void put_pair(uint16_t *registers, uint32_t number, bool swapped) {
    registers[swapped ? 1 : 0] = (uint16_t)(number >> 16);
    registers[swapped ? 0 : 1] = (uint16_t)number;
}

/* A pressure in whole float32 numbers; one in fifty is any 32 bits: huge, NaN, infinite. */
static uint32_t pressure_bits(struct world *world) {
    if (happens(world, 20)) return next_random(world);
    const float pressure = (float)(next_random(world) % 301) - 150.0f;
    uint32_t bits;
    memcpy(&bits, &pressure, sizeof bits);
    return bits;
}

/* What the PLC would answer, and whether it does. */
static void read_plc(struct world *world) {
    move(world, 0, 143000000);
    move(world, 1, 30000000);
    if (happens(world, 5)) world->control ^= (uint16_t)(1u << next_random(world) % 4);
    if (happens(world, 40)) world->control |= 0xBu; /* enable, referenced, permit resume */
    if (happens(world, 30)) world->control ^= 0x4u; /* fault reset */
    if (!happens(world, 10)) ++world->heartbeat;
    if (happens(world, 5)) world->silent = next_random(world) % 30;
    if (world->silent > 0) --world->silent;
    in.read_ok = world->silent == 0 && !happens(world, 20);
    in.read_us = world->now_us;
    in.registers[0] = world->control;
    in.registers[1] = world->heartbeat;
    put_pair(in.registers + 8, (uint32_t)world->position[0], false);
    put_pair(in.registers + 10, (uint32_t)world->position[1], true);
    put_pair(in.registers + 12, pressure_bits(world), false);
    in.registers[14] = (uint16_t)(int16_t)(world->speed[0] / 500 * (happens(world, 30) ? 100 : 1));
    in.registers[16] = world->held[3];
    in.registers[17] = world->held[4];
    const bool read_back = in.read_ok && cb_box_wants_held(&conformance_box) != CB_WANT_NOTHING;
    in.held = read_back ? CB_TRANSFER_OK : CB_TRANSFER_NONE;
    memcpy(in.held_registers, world->held, sizeof in.held_registers);
}

/* A thermometer that sends most of the time, and nonsense once in a while. */
static void read_sensors(struct world *world) {
    world->t1 = (int16_t)(world->t1 + (int16_t)(next_random(world) % 7) - 3);
    in.sample_count = happens(world, 700) ? 1 : 0;
    const int16_t raw = happens(world, 10) ? (int16_t)next_random(world) : world->t1;
    in.samples[0] = (struct cb_sample){SIGNAL_T1, (float)raw, world->now_us};
}

/* The box's write reaches the PLC, or fails in one of the ways there are. */
static void write_plc(struct world *world) {
    static const uint8_t ways[] = {CB_TRANSFER_FAILED, CB_TRANSFER_REFUSED, CB_TRANSFER_UNKNOWN,
                                   CB_TRANSFER_UNKNOWN};
    const uint32_t way = next_random(world) % LENGTH(ways);
    const bool fails = happens(world, 60);
    in.last_write = CB_TRANSFER_NONE;
    if (!out.write) return;
    in.last_write = fails ? ways[way] : CB_TRANSFER_OK;
    if (!fails) in.exchange_us = 3000 + next_random(world) % 9000;
    if (!fails || way == 3) memcpy(world->held, out.registers, sizeof world->held);
}

/* The clock: mostly one period on; now and then a tick is missed, or the box was suspended. */
static void advance(struct world *world) {
    in.missed_ticks = happens(world, 10) ? 1 : 0;
    world->now_us += PERIOD_US * (1 + (int64_t)in.missed_ticks) + next_random(world) % 300;
    if (happens(world, 1)) world->now_us += 1000000;
}

static void check_outputs(struct check *check) {
    const struct cb_config *config = &conformance_box.config;
    for (unsigned i = 0; i < config->channels_count; ++i) {
        const float limit_um = config->channels[i].limit_um;
        check_equal(check, "within the limit", cb_abs(out.channel_um[i]) <= limit_um, true);
        uint32_t bits;
        memcpy(&bits, &out.channel_um[i], sizeof bits);
        check_hash(check, bits);
    }
    const unsigned slope = config->channels[0].slope;
    check_equal(
        check, "slope within its limit",
        cb_abs(conformance_box.channels[slope].output_um) <= config->channels[slope].limit_um,
        true);
    const struct cb_pair_config *pair = &config->pairs[0];
    const float difference_um = out.channel_um[pair->a] - out.channel_um[pair->b];
    check_equal(check, "pair", cb_abs(difference_um) <= pair->max_difference_um + 1e-4f, true);
    for (unsigned i = 0; i < config->plc.write.count; ++i) check_hash(check, out.registers[i]);
    check_hash(check, (uint32_t)out.write | (uint32_t)in.last_write << 1);
}

void run_box(struct check *check) {
    static const struct cb_target target = {
        "conformance", 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN, 1u << CB_TRANSPORT_TCP, 0};
    struct cb_message message;
    struct world world = {.random = 2463534242u, .control = 0xB, .t1 = 215, .now_us = 1000000};
    check->subject = "loading";
    check_equal(check, "error",
                (uint32_t)cb_config_load(&conformance_box.config, text, sizeof text, &target,
                                         &scratch, &message),
                CB_OK);
    if (check->failures > 0) return;
    check->subject = "cycles";
    memset(&in, 0, sizeof in);
    memset(&out, 0, sizeof out);
    cb_box_start(&conformance_box);
    for (check->row = 0; check->row < CYCLES; ++check->row) {
        advance(&world);
        read_plc(&world);
        read_sensors(&world);
        cb_box_step(&conformance_box, &in, world.now_us, &out);
        check_outputs(check);
        write_plc(&world);
    }
    const struct cb_counters *seen = &conformance_box.counters;
    check_equal(check, "every kind of trouble was met",
                seen->holds && seen->ramps && seen->faults && seen->terms_faded &&
                    seen->outputs_limited && seen->outputs_slewed && seen->pairs_limited &&
                    seen->clock_jumps && seen->samples_implausible && seen->outside_curve &&
                    seen->models_extrapolated && seen->models_weakened && seen->slopes_limited,
                true);
    for (unsigned i = 0; i < CB_COUNTERS_COUNT; ++i) {
        uint32_t count;
        memcpy(&count, (const char *)&conformance_box.counters + i * sizeof count, sizeof count);
        check_hash(check, count);
    }
}
