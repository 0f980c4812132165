// SPDX-License-Identifier: MIT
// A bit of the configuration in memory that flips while the box runs: in every word of it.
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/support/box_fixture.h"
#include "tests/support/box_from_text.h"
#include "tests/support/dice.h"
#include "tests/support/every_term.h"

namespace compbox {
namespace {

constexpr int pass = CB_CONFIG_PASS_STEPS;

// Bytes of the configuration that every step checks before it uses them: what holds a count, an
// index, a register or a scale. Written down here from docs/faults.md, not from box/check.c.
struct checked_bytes {
    std::vector<bool> is = std::vector<bool>(sizeof(cb_config), false);
    const cb_config &config;

    explicit checked_bytes(const cb_config &c) : config(c) {
        all(c.period_us, c.lead_us, c.hold_us, c.ramp_um_per_s, c.ceiling_um, c.lead_measured);
        all(c.signals_count, c.terms_count, c.outputs_count, c.channels_count, c.pairs_count);
        all(c.lags_count, c.branches_count, c.slopes_count, c.grids_count, c.other_terms_count);
        all(c.plain_count, c.plain_age_us, c.other_terms, c.measured);
        const cb_plc_config &p = c.plc;
        all(p.exchange, p.read, p.write, p.control, p.plc_heartbeat, p.status, p.box_heartbeat);
        all(p.heartbeat_timeout_ms, p.referenced_mask, p.handshake, p.step_units, p.has_handshake);
        all(p.axes_at_once, p.scan_us, p.deadband_um, p.interpolate_us);
        for (unsigned i = 0; i < c.signals_count; ++i) {
            const cb_signal_config &s = c.signals[i];
            if (s.source == CB_SOURCE_LAG) continue;
            all(s.source, s.type, s.essential, s.leads, s.reg, s.velocity, s.velocity_scale);
            all(s.scale, s.zero, s.min, s.max, s.max_age_ms, s.rate_per_s, s.change_unit, s.plain);
        }
        unsigned curves = 0;
        for (unsigned i = 0; i < c.grids_count; ++i) curves += c.grids[i].curves;
        first(c.grids, c.grids_count);
        first(c.plain_curves, curves);
        first(c.lag_links, c.lags_count);
        first(c.branches, c.branches_count);
        first(c.pairs, c.pairs_count);
        first(c.output_terms, c.outputs_count);
        first(c.links, c.links_count);
        for (unsigned i = 0; i < c.other_terms_count; ++i) all(c.terms[c.other_terms[i]]);
        if (c.slopes_count > 0) first(c.terms, c.terms_count);
        for (unsigned i = 0; i < cb_all_channels(&c); ++i) {
            const cb_channel_config &k = c.channels[i];
            all(k.sum, k.sum_count, k.type, k.sign, k.has_applied, k.is_slope, k.tangent, k.slope);
            all(k.tangent_signal, k.reference_type, k.reference_reg, k.reference_scale, k.reg);
            all(k.applied_reg, k.limit_um, k.error_um, k.slew_um_per_s, k.deadband_um, k.step_um);
            all(k.scale, k.unit_um, k.most_um, k.top_um);
        }
    }
    void mark(const void *from, std::size_t size) {
        const std::size_t at = static_cast<std::size_t>(reinterpret_cast<const char *>(from) -
                                                        reinterpret_cast<const char *>(&config));
        for (std::size_t i = at; i < at + size; ++i) is[i] = true;
    }
    template <class... Fields>
    void all(const Fields &...fields) {
        (mark(&fields, sizeof fields), ...);
    }
    template <class Entry>
    void first(const Entry *entries, std::size_t count) {
        mark(entries, count * sizeof *entries);
    }
};

// A box that is ACTIVE; every signal moves in each step, inside its plausible range.
struct flip_rig : box_rig {
    const config_builder given;  // the rig itself must not follow what has flipped
    cb_box snapshot;

    explicit flip_rig(const config_builder &b) : box_rig(b), given(copy_of(b)) {
        for (int i = 0; i < 100; ++i) moving_step();
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_TRUE(out.write);
        snapshot = *box;
    }
    static config_builder copy_of(const config_builder &b) {
        config_builder c;
        *c.config = *b.config;
        return c;
    }
    // A lag is never read; a slow rate of change is kept by going a little way.
    void move_signals() {
        const cb_config &c = *given.config;
        in.sample_count = 0;
        for (unsigned i = 0; i < c.signals_count; ++i) {
            const cb_signal_config &s = c.signals[i];
            if (s.source == CB_SOURCE_LAG) continue;
            const float part = 0.5f + 1e-5f * static_cast<float>(heartbeat % 1000);
            const float raw = (s.min + part * (s.max - s.min) - s.zero) / s.scale;
            if (s.source == CB_SOURCE_PLC)
                cb_number_encode(static_cast<cb_number_type>(s.type), raw, in.registers + s.reg);
            else
                in.samples[in.sample_count++] = {static_cast<uint8_t>(i), raw, now_us};
        }
    }
    void moving_step() {
        const cb_plc_config &plc = given.config->plc;
        now_us += 30000;
        ++heartbeat;
        move_signals();
        if (plc.read.counters) in.registers[0] = in.registers[plc.read.count - 1] = heartbeat;
        in.registers[plc.control] = static_cast<uint16_t>(1 | 8 | plc.referenced_mask);
        in.registers[plc.plc_heartbeat] = heartbeat;
        in.read_ok = true;
        in.read_us = now_us;
        in.held = CB_TRANSFER_OK;
        in.last_write = static_cast<uint8_t>(out.write ? CB_TRANSFER_OK : CB_TRANSFER_NONE);
        cb_box_step(box.get(), &in, now_us, &out);
    }
    void flip(std::size_t bit) {
        reinterpret_cast<unsigned char *>(&box->config)[bit / 8] ^=
            static_cast<unsigned char>(1u << bit % 8);
    }
    void restore() {
        *box = snapshot;
        now_us = box->life.now_us;
        out.write = true;
    }
};

config_builder subject(bool tangent) {
    if (!tangent) return from_text(compbox_test::every_term());
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned first = b.polyline("EXX", x, {0, 500, 1000}, {0, 40, 30});
    b.channel("X", {first}, 4).tangent = true;
    b.channel("Y", {b.polynomial("EYX", x, {0, 0.1f})}, 6);
    cb_channel_config slope = b.channel("X", {}, 8);
    slope.is_slope = true;
    b.config->channels[2] = slope;
    b.config->channels_count = 2;
    b.config->slopes_count = 1;
    cb_channel_config &channel = b.config->channels[0];
    channel.slope = 2;
    channel.tangent_signal = static_cast<uint8_t>(x);
    channel.reference_reg = 10;
    channel.reference_scale = 0.01f;
    channel.reference_type = CB_NUMBER_INT32;
    b.pair(0, 1, 200);
    return b;
}

class flipped : public testing::TestWithParam<bool> {};

// From the step on in which the box meets it, nothing is written; and wherever the bit is, no step
// leaves its memory, which the sanitizers see.
TEST_P(flipped, a_bit_in_any_word_of_the_configuration) {
    flip_rig rig(subject(GetParam()));
    const checked_bytes checked(rig.snapshot.config);
    compbox_test::dice d(7);
    unsigned at_once = 0;
    for (std::size_t word = 0; word < sizeof(cb_config) / 4; ++word) {
        rig.restore();
        const std::size_t bit = word * 32 + d(32u);
        rig.flip(bit);
        const uint32_t faults = rig.box->counters.faults;
        rig.moving_step();
        if (checked.is[bit / 8]) {
            ++at_once;
            ASSERT_FALSE(rig.out.write) << "byte " << bit / 8;
            ASSERT_EQ(rig.mode(), CB_MODE_FAULT);
            ASSERT_EQ(rig.reason(), CB_REASON_CONFIG_CORRUPT);
            ASSERT_EQ(rig.box->counters.faults, faults + 1);
        }
        rig.moving_step();
        ASSERT_EQ(rig.out.write,
                  rig.mode() != CB_MODE_FAULT || rig.reason() != CB_REASON_CONFIG_CORRUPT);
    }
    EXPECT_GT(at_once, 100u);
}

TEST_P(flipped, elsewhere_it_is_found_within_two_passes) {
    flip_rig rig(subject(GetParam()));
    compbox_test::dice d(11);
    for (int i = 0; i < 12; ++i) {
        rig.restore();
        rig.flip(d(sizeof(cb_config) * 8));
        int steps = 0;
        while (rig.out.write && steps < 3 * pass) rig.moving_step(), ++steps;
        EXPECT_LE(steps, 2 * pass);
        EXPECT_EQ(rig.reason(), CB_REASON_CONFIG_CORRUPT);
    }
}
INSTANTIATE_TEST_SUITE_P(box, flipped, testing::Bool());

// Whatever the PLC sends and even if the bit flips back: latched until the start.
TEST(box_flip, nothing_is_written_until_the_restart) {
    flip_rig rig(subject(false));
    rig.flip(offsetof(cb_config, channels_count) * 8 + 2);
    rig.moving_step();
    rig.flip(offsetof(cb_config, channels_count) * 8 + 2);
    for (unsigned word : {1u | 2 | 4, 1u | 2 | 8, 0u, 1u | 2 | 4 | 8}) {
        rig.moving_step();
        rig.in.registers[rig.box->config.plc.control] = static_cast<uint16_t>(word);
        cb_box_step(rig.box.get(), &rig.in, rig.now_us += 30000, &rig.out);
        EXPECT_FALSE(rig.out.write);
        EXPECT_EQ(rig.reason(), CB_REASON_CONFIG_CORRUPT);
    }
    cb_box_start(rig.box.get());
    for (int i = 0; i < 10; ++i) rig.moving_step();
    EXPECT_TRUE(rig.out.write);
}

// The target's own deadline ends the stop: the PLC has not confirmed zero, and nobody claims it.
TEST(box_flip, a_stop_neither_writes_nor_says_stopped) {
    flip_rig rig(subject(true));
    rig.in.stop = true;
    rig.moving_step();
    rig.flip(offsetof(cb_config, ramp_um_per_s) * 8 + 30);
    for (int i = 0; i < 1000; ++i) {
        rig.moving_step();
        ASSERT_FALSE(rig.out.write);
        ASSERT_FALSE(rig.out.stopped);
    }
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
}

// The limits are unknown, and no output moves any more.
TEST(box_flip, a_stop_takes_no_time_for_ramps) {
    box_rig rig(simple());
    rig.steps(10);
    ASSERT_GT(cb_box_stop_us(rig.box.get()), 0);
    rig.box->config.channels[0].limit_um = 1e30f;
    EXPECT_EQ(cb_box_stop_us(rig.box.get()), 0);
}

// A fault of before keeps no reason that would hide why the writes end.
TEST(box_flip, it_replaces_the_reason_of_another_fault) {
    config_builder b = simple();
    b.config->channels[0].error_um = 90;
    b.config->channels[0].limit_um = 80;
    box_rig rig(b);
    rig.position(8, 901);
    rig.steps(5);
    ASSERT_EQ(rig.reason(), CB_REASON_DEMAND);
    rig.box->config.channels[0].reg ^= 1;
    rig.step();
    EXPECT_EQ(rig.reason(), CB_REASON_CONFIG_CORRUPT);
    EXPECT_EQ(rig.box->counters.faults, 1u);
}

// A reload follows counts and indices of the box that runs.
TEST(box_flip, no_other_box_takes_over_from_a_corrupt_one) {
    box_rig rig(simple()), fresh(simple());
    rig.steps(10);
    rig.box->config.channels_count = 255;
    EXPECT_EQ(cb_box_obstacle(&fresh.box->config, rig.box.get()), static_cast<unsigned>(CB_NONE));
    EXPECT_FALSE(cb_box_adopt(fresh.box.get(), rig.box.get()));
}

}  // namespace
}  // namespace compbox
