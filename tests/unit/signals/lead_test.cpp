// SPDX-License-Identifier: MIT
// The lead: measured from exchanges and the PLC's heartbeat, and the PLC's own velocity.
#include <gtest/gtest.h>

#include "tests/support/box_fixture.h"
#include "tests/support/config_fixture.h"
#include "tests/support/virtual_registers.h"

extern "C" {
#include "firmware/signals/lead.h"
#include "hal/cycle.h"
}

namespace compbox {
namespace {

using compbox_test::full_example;
using compbox_test::load;
using compbox_test::with;

cb_config measured(uint32_t period_us = 30000) {
    cb_config config = {};
    config.period_us = period_us;
    config.lead_measured = true;
    return config;
}

TEST(lead, is_what_the_file_says_unless_measured) {
    cb_config config = measured();
    cb_lead_state state = {};
    EXPECT_EQ(cb_lead_us(&config, &state), 15000u) << "half a period before anything is known";
    cb_lead_take_exchange(&state, 9000);
    EXPECT_EQ(cb_lead_us(&config, &state), 24000u);
    config.lead_measured = false;
    config.lead_us = 45000;
    EXPECT_EQ(cb_lead_us(&config, &state), 45000u);
}

TEST(lead, has_the_handshakes_of_a_fanuc_control_in_it) {
    cb_config config = measured();
    cb_lead_state state = {};
    config.plc.profile = CB_PROFILE_FANUC;
    config.plc.scan_us = 8000;
    config.channels_count = 3;
    EXPECT_EQ(cb_lead_us(&config, &state), 15000u + (32000u + 96000u) / 2);
}

TEST(lead, of_a_plc_that_goes_to_each_value_in_a_line) {
    cb_config config = measured();
    config.plc.interpolate_us = 30000;
    const cb_lead_state state = {9000, 8000, 0, 0};
    EXPECT_EQ(cb_lead_us(&config, &state), 9000u + 4000u + 30000u);
    config.plc.interpolate_us = 10000;
    EXPECT_EQ(cb_lead_us(&config, &state), 9000u + 4000u + 20000u);
    config.plc.interpolate_us = 0;
    EXPECT_EQ(cb_lead_us(&config, &state), 9000u + 8000u + 15000u);
}

TEST(lead, positions_are_as_far_apart_as_the_heartbeat_counted) {
    cb_lead_state state = {};
    EXPECT_EQ(cb_lead_apart_us(&state, 4, 30000), 30000) << "nothing is known yet";
    state.update_us = 8000;
    EXPECT_EQ(cb_lead_apart_us(&state, 3, 30000), 24000);
    EXPECT_EQ(cb_lead_apart_us(&state, 4, 30000), 32000);
    EXPECT_EQ(cb_lead_apart_us(&state, 5, 30000), 30000) << "more than one update off";
    EXPECT_EQ(cb_lead_apart_us(&state, 1, 30000), 30000);
    EXPECT_EQ(cb_lead_apart_us(&state, 65535, 30000), 30000) << "a PLC that restarted";
    state.update_us = 40000;
    EXPECT_EQ(cb_lead_apart_us(&state, 0, 30000), 0) << "the same position again";
    EXPECT_EQ(cb_lead_apart_us(&state, 1, 30000), 40000);
    state.update_us = 1000000;
    EXPECT_EQ(cb_lead_apart_us(&state, 0, 30000), 30000) << "a clock of the PLC's, no count";
}

TEST(lead, filters_exchanges_and_never_exceeds_its_maximum) {
    const cb_config config = measured(1000000);
    cb_lead_state state = {};
    cb_lead_take_exchange(&state, 8000);
    cb_lead_take_exchange(&state, 16000);
    EXPECT_EQ(state.exchange_us, 9000u);
    for (int i = 0; i < 100; ++i) cb_lead_take_exchange(&state, 16000);
    EXPECT_NEAR(state.exchange_us, 16000, 8);
    cb_lead_take_exchange(&state, 0);
    cb_lead_take_exchange(&state, 3000000);
    EXPECT_NEAR(state.exchange_us, 16000, 8) << "no measurement, and one beyond belief";
    for (int i = 0; i < 100; ++i) cb_lead_take_exchange(&state, 400000);
    EXPECT_EQ(cb_lead_us(&config, &state), 500000u);
}

TEST(lead, counts_the_plc_by_its_heartbeat) {
    cb_lead_state state = {};
    for (int i = 0; i < 34; ++i) cb_lead_take_heartbeat(&state, i % 4 == 3 ? 3 : 4, 30000);
    EXPECT_NEAR(state.update_us, 8000, 100);
    for (int i = 0; i < 34; ++i) cb_lead_take_heartbeat(&state, 0, 30000);
    EXPECT_NEAR(state.update_us, 8000, 100) << "a heartbeat that stands says nothing";
    for (int i = 0; i < 40; ++i) cb_lead_take_heartbeat(&state, 60000, 30000);
    EXPECT_NEAR(state.update_us, 8000, 100) << "a PLC that restarted";
    cb_lead_take_heartbeat(&state, 4, -5);
    cb_lead_take_heartbeat(&state, 4, 3000000);
    EXPECT_NEAR(state.update_us, 8000, 100);
}

TEST(lead, hardly_moves_by_a_window_in_which_the_heartbeat_stood) {
    cb_lead_state state = {0, 8000, 0, 0};
    for (int i = 0; i < 34; ++i) cb_lead_take_heartbeat(&state, i < 2 ? 4 : 0, 30000);
    EXPECT_EQ(state.update_us, 9000u);
    for (int i = 0; i < 34 * 40; ++i) cb_lead_take_heartbeat(&state, i % 2 == 1 ? 1 : 0, 30000);
    EXPECT_NEAR(state.update_us, 60000, 600) << "a PLC that is slower now";
    cb_lead_take_heartbeat(&state, 1, 30000);
    cb_lead_lose_heartbeat(&state);
    EXPECT_EQ(state.window_us, 0u);
    EXPECT_EQ(state.beats, 0u);
}

// An axis at 100 mm/s with an error of 1 µm/mm; the reading says x, the box computes x + v lead.
struct moving_axis : box_rig {
    double x = 100, v = 100;
    double reported = 6000;  // mm/min
    explicit moving_axis(bool velocity, bool lead_measured = false)
        : box_rig(builder(velocity, lead_measured)) {}
    static config_builder builder(bool velocity, bool lead_measured) {
        config_builder b;
        const unsigned x = b.position("X", 8, -1000, 1000);
        cb_signal_config &v = b.signal("VX", "mm/min", CB_SOURCE_PLC, CB_NUMBER_INT32, 10);
        v.min = -60000;
        v.max = 60000;
        if (velocity) {
            b.config->signals[x].velocity = 1;
            b.config->signals[x].velocity_scale = 1.0f / 60;
        }
        b.config->lead_us = lead_measured ? 0 : 40000;
        b.config->lead_measured = lead_measured;
        b.channel("X", {b.polynomial("EXX", x, {0, 1})}, 4).slew_um_per_s = 1000000;
        return b;
    }
    double ahead() {
        position(8, x += v * 0.03);
        put_int32(in.registers + 10, reported);
        step();
        return box->outputs[0] - x;
    }
};

TEST(lead, takes_the_velocity_of_the_plc_at_once) {
    moving_axis rig(true), without(false);
    EXPECT_NEAR(rig.ahead(), 4, 1e-3) << "in the first cycle";
    EXPECT_NEAR(without.ahead(), 0, 1e-3);
    for (int i = 0; i < 30; ++i) without.ahead();
    EXPECT_NEAR(without.ahead(), 4, 1e-3);
    rig.reported = -3000;
    EXPECT_NEAR(rig.ahead(), -2, 1e-3);
}

// Readings every 30 ms of a PLC that scans every 8 ms: what it shows is 24 or 32 ms further.
struct scanned_axis : moving_axis {
    double t_ms = 0, shown_ms = 0, stops_ms = 1e9;
    // The PLC goes in lines: what it shows goes with its heartbeat.
    scanned_axis() : moving_axis(false) {
        box->config.plc.interpolate_us = 30000;
        cb_box_start(box.get());
    }
    // One step; out: by how much the box is wrong about where the axis will be in 40 ms, if it goes
    // on as it does.
    double wrong_by() {
        t_ms += 30;
        const double scan_ms = std::floor(t_ms / 8) * 8;
        heartbeat = static_cast<uint16_t>(heartbeat + (scan_ms - shown_ms) / 8 - 1);  // step(): + 1
        shown_ms = scan_ms;
        const auto at = [&](double ms) { return 0.1 * std::min(ms, stops_ms); };
        position(8, at(scan_ms));
        put_int32(in.registers + 10, 0);
        step();
        const double mm_per_ms = scan_ms < stops_ms ? 0.1 : 0;
        return box->outputs[0] - (at(scan_ms) + mm_per_ms * 40);
    }
};

TEST(lead, the_scan_of_the_plc_does_not_shake_the_velocity) {
    scanned_axis rig;
    for (int i = 0; i < 100; ++i) rig.wrong_by();
    for (int i = 0; i < 100; ++i) EXPECT_NEAR(rig.wrong_by(), 0, 0.05) << i;
    rig.stops_ms = rig.shown_ms + 0.5;
    rig.wrong_by();
    for (int i = 0; i < 100; ++i) EXPECT_NEAR(rig.wrong_by(), 0, 1e-3) << "at rest at once " << i;
}

// A PLC that shows where the axis is at each reading, and counts its heartbeat at its own pace: the
// count says nothing of positions.
TEST(lead, nor_does_a_heartbeat_that_counts_something_else) {
    for (const int beat_ms : {7, 11, 13, 20, 50, 80}) {
        moving_axis rig(false);
        int t_ms = 0;
        for (int i = 0; i < 200; ++i) {
            const int before = t_ms / beat_ms;
            t_ms += 30;
            rig.heartbeat = static_cast<uint16_t>(rig.heartbeat + t_ms / beat_ms - before - 1);
            const double ahead = rig.ahead();
            if (i > 30) {
                EXPECT_NEAR(ahead, 4, 0.05) << beat_ms << " ms, reading " << i;
            }
        }
    }
}

TEST(lead, falls_back_to_differences_while_the_velocity_is_missing) {
    moving_axis rig(true);
    for (int i = 0; i < 30; ++i) rig.ahead();
    rig.reported = 1e6;  // implausible: the last value serves for three periods
    rig.v = 50;
    EXPECT_NEAR(rig.ahead(), 4, 1e-3);
    for (int i = 0; i < 30; ++i) rig.ahead();
    EXPECT_NEAR(rig.ahead(), 2, 1e-3);
}

TEST(lead, measured_in_the_box) {
    moving_axis rig(true, true);
    EXPECT_NEAR(rig.ahead(), 1.5, 1e-3) << "half a period";
    rig.in.exchange_us = 7000;
    rig.ahead();
    EXPECT_NEAR(rig.ahead(), 2.2, 1e-3);
    for (int i = 0; i < 40; ++i) rig.ahead();
    EXPECT_NEAR(rig.ahead(), 2.2 + 3, 1e-2) << "one heartbeat for each reading";
    moving_axis fresh(true, true);
    ASSERT_TRUE(cb_box_adopt(fresh.box.get(), rig.box.get()));
    EXPECT_EQ(fresh.box->life.lead.exchange_us, rig.box->life.lead.exchange_us);
}

// The cycle measures what the box receives, on a wire where each request takes 4 ms.
TEST(lead, the_cycle_measures_from_reading_to_confirmation) {
    for (const bool fc23 : {false, true}) {
        virtual_registers sim(30000, 1000000);
        auto box = std::make_unique<cb_box>();
        config_builder b = moving_axis::builder(false, true);
        b.config->plc.exchange = fc23 ? CB_EXCHANGE_FC23 : CB_EXCHANGE_FC3_FC16;
        box->config = *b.config;
        cb_box_start(box.get());
        sim.wire = {4000, 4000};
        const cb_hal hal = sim.hal();
        cb_cycle cycle;
        cb_cycle_start(&cycle);
        for (int i = 0; i < 5; ++i) cb_cycle_run(&cycle, box.get(), &hal);
        EXPECT_EQ(cycle.in.exchange_us, fc23 ? 34000u : 8000u);
        sim.wire = {25000, 25000};
        cb_cycle_run(&cycle, box.get(), &hal);
        EXPECT_EQ(cycle.in.exchange_us, fc23 ? 34000u : 8000u) << "the newest that was confirmed";
    }
}

TEST(lead, in_the_file) {
    auto got = load(with("\"lead_ms\": 45", "\"lead_ms\": \"measured\""));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_TRUE(got.config->lead_measured);
    EXPECT_EQ(got.config->lead_us, 0u);
    EXPECT_FALSE(load(full_example).config->lead_measured);
    const std::string velocity =
        R"({"name": "VX", "unit": "mm/min", "plc": 12, "min": -30000, "max": 30000}, )";
    const std::string text = with(R"({"name": "X", "unit": "mm", )",
                                  velocity + R"({"name": "X", "unit": "mm", "velocity": "VX", )");
    got = load(text);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(got.config->signals[1].velocity, 0);
    EXPECT_FLOAT_EQ(got.config->signals[1].velocity_scale, 1.0f / 60);
    const struct {
        const char *piece, *other, *message;
    } mistakes[] = {
        {"\"lead_ms\": 45", "\"lead_ms\": \"auto\"",
         "cycle.lead_ms: \"auto\" is not known; use measured"},
        {"\"lead_ms\": 45", "\"lead_ms\": 501",
         "cycle.lead_ms: 501 is outside the range of 0 to 500"},
        {"\"lead_ms\": 45", "\"lead_ms\": -1",
         "cycle.lead_ms: -1 is outside the range of 0 to 500"},
        {"\"lead_ms\": 45", "\"lead_ms\": true", "cycle.lead_ms: must be a number, not true"},
        {"\"velocity\": \"VX\"", "\"velocity\": \"VY\"",
         "signals[1].velocity: no signal is called \"VY\""},
        {"\"velocity\": \"VX\"", "\"velocity\": \"X\"",
         "signals[1].velocity: the velocity of a position in mm has the unit mm/s or mm/min, and X "
         "has mm"},
        {"\"velocity\": \"VX\"", "\"velocity\": \"T1\"",
         "signals[1].velocity: \"T1\" is not from the PLC, as the position is"},
        {"\"velocity\": \"VX\"", "\"velocity\": 3",
         "signals[1].velocity: must be a text in double quotes, not 3"},
        {"\"unit\": \"mm/min\"", "\"unit\": \"m/min\"",
         "signals[1].velocity: the velocity of a position in mm has the unit mm/s or mm/min, and "
         "VX "
         "has m/min"},
        {"\"name\": \"T1\",", "\"name\": \"T1\", \"velocity\": \"VX\",",
         "signals[2].velocity: only a position from the PLC, in mm or deg, has a "
         "velocity"},
    };
    for (const auto &[piece, other, message] : mistakes)
        EXPECT_EQ(load(with(piece, other, text)).text, message) << other;
}

// The PLC's program stands for 2 s, within a window and over the end of some.
TEST(lead, is_the_same_behind_a_plc_program_that_stood) {
    for (int stands_at = 100; stands_at < 140; stands_at += 3) {
        moving_axis rig(true, true);
        const cb_lead_state &lead = rig.box->life.lead;
        for (int i = 0; i < stands_at; ++i) rig.ahead();
        ASSERT_NEAR(lead.update_us, 30000, 300);
        for (int i = 0; i < 67; ++i) {
            --rig.heartbeat;  // ahead(): + 1
            rig.ahead();
        }
        for (int i = 0; i < 40; ++i) rig.ahead();
        EXPECT_NEAR(lead.update_us, 30000, 30000 / 8) << stands_at;
    }
}

TEST(lead, begins_to_count_when_the_heartbeat_begins) {
    moving_axis rig(true, true);
    for (int i = 0; i < 30; ++i) {
        --rig.heartbeat;
        rig.ahead();
    }
    for (int i = 0; i < 40; ++i) rig.ahead();
    EXPECT_NEAR(rig.box->life.lead.update_us, 30000, 300);
}

}  // namespace
}  // namespace compbox
