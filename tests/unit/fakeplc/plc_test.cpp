// SPDX-License-Identifier: MIT
// The PLC's duties, in virtual time and over its Modbus requests only.
#include <gtest/gtest.h>

#include <cmath>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "tests/support/fakeplc_rig.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::fakeplc {
namespace {

TEST(Plc, StartsWithZerosThenReferencesThenEnables) {
    rig r;
    for (int address = 0; address < 16; ++address) EXPECT_EQ(r.reg(address), 0);
    r.run_ms(0);
    EXPECT_EQ(r.reg(0), 8);  // permit resume only
    r.run_ms(495);
    EXPECT_EQ(r.reg(0), 8);
    r.run_ms(20);
    EXPECT_EQ(r.reg(0), 8 | 2);
    r.run_ms(480);
    EXPECT_EQ(r.reg(0), 8 | 2);
    r.run_ms(20);
    EXPECT_EQ(r.reg(0), 8 | 2 | 1);
    EXPECT_TRUE(r.had("referenced"));
    EXPECT_TRUE(r.had("enable on"));
}

TEST(Plc, HandsOnTheSwitchesWinOverTheStartUp) {
    rig r;
    r.plc.set_enable(false);
    r.run_ms(3000);
    EXPECT_EQ(r.reg(0), 8 | 2);
    r.plc.set_referenced(false);
    r.plc.set_permit(false);
    r.plc.set_enable(true);
    r.run_ms(10);
    EXPECT_EQ(r.reg(0), 1);
    r.run_ms(3000);
    EXPECT_EQ(r.reg(0), 1);
}

TEST(Plc, ReferencedMayBeOneBitForEachAxis) {
    register_map map = small_map();
    map.referenced_mask = 1 << 4 | 1 << 5;
    rig r(small_machine(), map);
    r.run_ms(1100);
    EXPECT_EQ(r.reg(0), 1 | 8 | 1 << 4 | 1 << 5);
}

TEST(Plc, ResetIsAPulse) {
    rig r;
    r.run_ms(2000);
    r.plc.press_reset();
    r.run_ms(10);
    EXPECT_EQ(r.reg(0) & 4, 4);
    r.run_ms(400);
    EXPECT_EQ(r.reg(0) & 4, 4);
    r.run_ms(150);
    EXPECT_EQ(r.reg(0) & 4, 0);
}

TEST(Plc, ShowsSignalsInTheirScaleAndZero) {
    rig r;
    r.run_ms(10);
    EXPECT_EQ(r.int32_at(2), 123456.0);
    EXPECT_EQ(r.reg(4), 715);  // 21.5 = 715 × 0.1 − 50
    ASSERT_TRUE(r.plc.force_signal("X", -1.5));
    r.run_ms(10);
    EXPECT_EQ(r.int32_at(2), -15000.0);
    ASSERT_TRUE(r.plc.release_signal("X"));
    r.run_ms(10);
    EXPECT_EQ(r.int32_at(2), 123456.0);
    EXPECT_FALSE(r.plc.force_signal("U", 0.0));
    EXPECT_FALSE(r.plc.release_signal("X"));
}

TEST(Plc, ShowsTheVelocityOfAPosition) {
    for (const char *unit : {"mm/s", "mm/min"}) {
        json root = {{"plc",
                      {{"read", {{"start", 0}, {"count", 8}}},
                       {"write", {{"start", 10}, {"count", 6}}},
                       {"control", 0},
                       {"plc_heartbeat", 1},
                       {"status", 10},
                       {"box_heartbeat", 11}}}};
        root["signals"] = {{{"name", "v"}, {"unit", unit}, {"plc", 4}, {"type", "int32"}},
                           {{"name", "X"}, {"plc", 2}, {"type", "int32"}, {"velocity", "v"}}};
        rig r(small_machine(), register_map_of(root, "map.json"));
        const double per_s = std::string(unit) == "mm/s" ? 1 : 60;
        twin::twin_step step;
        step.feed_mm_per_s = 100;
        for (const double target_mm : {500.0, 100.0}) {
            step.target_mm[0] = target_mm;
            r.plc.move(step);
            r.run_ms(1000);
            EXPECT_EQ(r.int32_at(4), (target_mm == 500 ? 100 : -100) * per_s);
            r.run_ms(10000);
            EXPECT_EQ(r.int32_at(4), 0);
        }
    }
}

TEST(Plc, HeartbeatCountsScansWithFreshPositionsOnly) {
    rig r;
    r.run_ms(799);  // scans at 0, 8 … 792
    EXPECT_EQ(r.reg(1), 100);
    r.plc.freeze_nc(true);
    twin::twin_step step;
    step.target_mm[0] = 500.0;
    step.feed_mm_per_s = 100.0;
    r.plc.move(step);
    const double before = r.int32_at(2);
    r.run_ms(1000);
    EXPECT_EQ(r.reg(1), 100);
    EXPECT_EQ(r.int32_at(2), before);
    r.plc.freeze_nc(false);
    r.run_ms(80);
    EXPECT_EQ(r.reg(1), 110);
    EXPECT_GT(r.int32_at(2), before + 500000.0);  // the axis had moved on: over 50 mm

    twin::twin_config config = small_machine();
    config.plc.scan_s = 0.002;  // two scans for each interpolation cycle
    rig fast(config);
    fast.run_ms(399);
    EXPECT_EQ(fast.reg(1), 100);
}

TEST(Plc, AppliesOnlyWhileEnabledReferencedAndTheBoxSaysSo) {
    for (const unsigned mode : {standby, active, hold, ramp, faulty, stopped, 77u}) {
        rig r;
        r.run_ms(1100);
        r.box_runs_ms(300, mode, 20.0);
        const bool applies = mode >= active && mode <= faulty;
        EXPECT_EQ(r.applied(), applies ? 20.0 : 0.0) << mode;
        EXPECT_EQ(r.int32_at(6), applies ? 2000.0 : 0.0) << mode;
        EXPECT_EQ(r.plc.state().displacement_um[0], applies ? 20.0 : 0.0) << mode;
    }
    rig r;  // 60 ms after power-on nothing is referenced yet
    r.box_runs_ms(60, active, 20.0);
    EXPECT_EQ(r.applied(), 0.0);
    r.run_ms(1100);
    r.box_runs_ms(300, active, 20.0);
    EXPECT_EQ(r.applied(), 20.0);
    r.plc.set_referenced(false);
    r.box_runs_ms(600, active, 20.0);
    EXPECT_EQ(r.applied(), 0.0);
}

TEST(Plc, NeverMovesFasterThanItsSlopeWhateverTheBoxWrites) {
    rig r;
    r.run_ms(1100);
    const double step_um = 1000.0 * 0.008 * (1.0 + 1e-9);
    twin::random_stream random(8, "writes");
    double before = r.applied();
    for (int i = 0; i < 2000; ++i) {
        r.write(active, random.symmetric(300.0));
        r.run_ms(8);
        ASSERT_LE(std::fabs(r.applied() - before), step_um);
        before = r.applied();
    }
}

TEST(Plc, WatchdogRampsToZeroAndComesBackWithoutAStep) {
    rig r;
    r.run_ms(1100);
    r.box_runs_ms(600, active, -40.0);
    ASSERT_EQ(r.applied(), -40.0);
    r.run_ms(150);  // silence for less than 200 ms: nothing happens
    EXPECT_EQ(r.applied(), -40.0);
    double before = r.applied();
    for (int i = 0; i < 120; ++i) {
        r.run_ms(8);
        ASSERT_LE(std::fabs(r.applied() - before), 50.0 * 0.008 + 1e-9);
        ASSERT_GE(r.applied(), before);
        before = r.applied();
    }
    EXPECT_EQ(r.applied(), 0.0);  // 40 µm at 50 µm/s: 0.8 s
    EXPECT_TRUE(r.had("watchdog"));
    EXPECT_FALSE(r.plc.state().box_alive);
    r.write(active, -40.0);
    r.run_ms(8);
    EXPECT_NEAR(r.applied(), -8.0, 8.0);
    r.box_runs_ms(90, active, -40.0);
    EXPECT_EQ(r.applied(), -40.0);
    EXPECT_TRUE(r.had("box heartbeat is back"));
}

TEST(Plc, ABoxWhoseHeartbeatNeverMovedIsNotObeyed) {
    rig r;
    r.run_ms(1100);
    r.write(active, 10.0);
    r.set_reg(11, 0);
    for (int i = 0; i < 50; ++i) {
        r.run_ms(8);
        EXPECT_EQ(r.applied(), 0.0);
    }
}

TEST(Plc, EnableOffRampsToZero) {
    rig r;
    r.run_ms(1100);
    r.box_runs_ms(300, active, 10.0);
    r.plc.set_enable(false);
    r.box_runs_ms(90, active, 10.0);
    EXPECT_LT(r.applied(), 7.0);
    EXPECT_GT(r.applied(), 3.0);
    r.box_runs_ms(300, active, 10.0);
    EXPECT_EQ(r.applied(), 0.0);
}

TEST(Plc, TornBlocksAndNonFiniteNumbersAreNotTakenOver) {
    register_map map = small_map();
    map.write.counters = true;  // registers 10 and 15
    map.status = 14;
    rig r(small_machine(), map);
    r.run_ms(1100);
    const auto write = [&r](unsigned first, unsigned raw, unsigned last) {
        r.set_reg(10, first), r.set_reg(15, last);
        r.set_reg(14, active), r.set_reg(11, ++r.beat);
        r.set_reg(12, 0), r.set_reg(13, raw);
        r.run_ms(40);
    };
    write(1, 500, 1);
    EXPECT_EQ(r.applied(), 5.0);
    write(2, 900, 1);
    EXPECT_EQ(r.applied(), 5.0);
    write(2, 900, 2);
    EXPECT_EQ(r.applied(), 9.0);

    register_map floats = small_map();
    floats.channels[0].format = number_format::parse("float32").value();
    rig f(small_machine(), floats);
    f.run_ms(1100);
    f.write(active, 0.0);
    f.set_reg(12, 0x447A), f.set_reg(13, 0);  // 1000.0: 10 µm
    f.run_ms(100);
    EXPECT_EQ(f.applied(), 10.0);
    f.set_reg(11, ++f.beat);
    f.set_reg(12, 0x7FC0);  // NaN
    f.run_ms(100);
    EXPECT_EQ(f.applied(), 10.0);
}

TEST(Plc, ReadBlockCountersMoveTogetherWithEveryScan) {
    register_map map = small_map();
    map.read = {0, 9, true};
    map.control = 5, map.plc_heartbeat = 1;
    rig r(small_machine(), map);
    for (int i = 1; i < 20; ++i) {
        r.run_ms(i == 1 ? 0 : 8);
        EXPECT_EQ(r.reg(0), i);
        EXPECT_EQ(r.reg(8), i);
        const auto torn = r.plc.answer({3, 0, 0, 0, 9}, true);
        EXPECT_EQ(torn.at(3), i);
        EXPECT_EQ(torn.at(19), i - 1);
    }
}

TEST(Plc, SignOfTheControlDecidesWhereTheToolGoes) {
    twin::twin_config config = small_machine();
    config.axes[0].compensation_sign = -1;
    rig r(config);
    r.run_ms(1100);
    r.box_runs_ms(300, active, 10.0);
    const plc_state &state = r.plc.state();
    EXPECT_EQ(r.int32_at(6), 1000.0);  // what is returned is in the register's own sense
    EXPECT_EQ(state.displacement_um[0], -10.0);
    EXPECT_DOUBLE_EQ(state.error_after_um[0], state.error_before_um[0] - 10.0);
}

TEST(Plc, TwoChannelsOnOneAxisActByTheirMean) {
    register_map map = small_map();
    map.write.count = 8;
    map.channels.push_back({"X2", 14, std::nullopt, map.channels[0].format, 0.01});
    twin::twin_config config = small_machine();
    EXPECT_THROW(rig(config, map), input_error);  // nobody printed what X2 moves
    config.channels["X2"] = 'X';
    rig r(config, map);
    r.run_ms(1100);
    r.set_reg(15, 3000);
    r.box_runs_ms(300, active, 10.0);
    EXPECT_EQ(r.plc.state().displacement_um[0], 20.0);
}

// Value, slope and reference: the control goes on along the tangent in its own cycles.
register_map tangent_map() {
    register_map map = small_map();
    const auto i16 = number_format::parse("int16").value();
    map.write.count = 8;
    map.channels[0].tangent = taken_tangent{14, 15, i16, i16, 1e-6, 0.1};
    return map;
}

TEST(Plc, ATangentIsFollowedBetweenTwoWrites) {
    rig r(small_machine(), tangent_map());
    r.run_ms(1100);
    r.set_reg(14, 200);  // 0.0002
    r.set_reg(15, 100);  // at 10 mm
    r.box_runs_ms(300, active, 10.0);
    const auto expected = [&] {
        return 10.0 + 1e3 * 0.0002 * (r.plc.nc().position_mm()[0] - 10.0);
    };
    EXPECT_NEAR(r.plc.state().displacement_um[0], expected(), 1e-9);
    twin::twin_step step;
    step.target_mm[0] = 500.0;
    step.feed_mm_per_s = 100.0;
    r.plc.move(step);
    r.box_runs_ms(900, active, 10.0);  // the same three numbers all the time
    ASSERT_GT(r.plc.nc().position_mm()[0], 40.0);
    EXPECT_NEAR(r.plc.nc().displacement_um()[0], expected(), 1e-9);
    EXPECT_NEAR(r.plc.state().applied_um[0], 10.0, 1e-9) << "K0 is what the PLC shows";
}

TEST(Plc, TheControlClampsASlopeWithoutAnAlarm) {
    twin::twin_config config = small_machine();
    config.nc.comp_add_velo_factor = 0.0001;
    config.plc.size_um = 2000.0;
    rig r(config, tangent_map());
    r.run_ms(1100);
    r.set_reg(14, 30000);
    r.set_reg(15, 0);
    r.box_runs_ms(2500, active, 10.0);
    EXPECT_NEAR(r.plc.nc().displacement_um()[0], 10.0 + 1e3 * 0.0001 * 12.3456, 1e-6);
}

TEST(Plc, WithoutTheBoxATangentGoesToZeroFromWhereItIs) {
    rig r(small_machine(), tangent_map());
    r.run_ms(1100);
    r.set_reg(14, 2000);
    r.set_reg(15, 0);
    r.box_runs_ms(300, active, 10.0);
    double last = r.plc.nc().displacement_um()[0];
    EXPECT_NEAR(last, 10.0 + 2 * 12.3456, 1e-6);
    for (int i = 0; i < 300; ++i) {
        r.run_ms(4);
        const double now = r.plc.nc().displacement_um()[0];
        EXPECT_LE(now, last + 1e-9);
        EXPECT_GE(now, last - 0.5) << "50 um/s, taken over every 8 ms";
        last = now;
    }
    EXPECT_EQ(last, 0.0);
}

TEST(Plc, ProgramStartsOnceTheBoxIsActive) {
    twin::twin_config config = small_machine();
    twin::twin_step step;
    step.target_mm[0] = 112.3456;
    step.feed_mm_per_s = 100.0;
    config.program = {step};
    rig r(config);
    r.run_ms(1100);
    r.box_runs_ms(300, standby, 0.0);
    EXPECT_FALSE(r.plc.moving());
    r.box_runs_ms(600, active, 0.0);
    EXPECT_TRUE(r.plc.moving());
    r.box_runs_ms(900, active, 0.0);
    EXPECT_EQ(r.plc.state().position_mm[0], 112.3456);
    r.box_runs_ms(300, standby, 0.0);
    r.box_runs_ms(300, active, 0.0);
    EXPECT_FALSE(r.plc.moving());  // not a second time
}

TEST(Plc, IsTheSameHoweverTimeIsCutUp) {
    const auto trace = [](std::int64_t step_us) {
        rig r;
        std::vector<double> seen;
        twin::twin_step step;
        step.target_mm[0] = 400.0;
        step.feed_mm_per_s = 100.0;
        r.plc.move(step);
        for (std::int64_t t = 0; t <= 3000000; t += step_us) {
            r.plc.run_to(t, [&seen](const plc_state &s) {
                seen.insert(seen.end(), {s.time_s, s.position_mm[0], s.error_after_um[0]});
            });
        }
        return seen;
    };
    const auto fine = trace(1000), coarse = trace(100000);
    ASSERT_GT(fine.size(), 1000u);
    EXPECT_EQ(fine, coarse);
}

TEST(Plc, AfterALongStandstillItGoesOnInsteadOfCatchingUp) {
    rig r;
    r.run_ms(100);
    const double before_s = r.plc.state().time_s;
    r.plc.forget_standstill(r.now_us + 900 * ms);  // short enough to catch up
    EXPECT_LT(r.plc.next_due_us(), r.now_us + 10 * ms);
    r.now_us += 60000 * ms;
    r.plc.forget_standstill(r.now_us);
    r.run_ms(8);
    EXPECT_LT(r.plc.state().time_s, before_s + 0.02);
    EXPECT_TRUE(r.had("stood still"));
}

// ---- files

std::string complaint(const std::string &text) {
    const std::string path = compbox_test::temporary("map.json");
    formats::write_file(path, text);
    try {
        load_register_map(path);
    } catch (const input_error &error) {
        return error.what();
    }
    return "none";
}

std::string map_with(const std::string &plc, const std::string &rest = "") {
    return R"({"plc": {"read": {"start": 0, "count": 10}, "write": {"start": 20, "count": 10},
        "control": 0, "plc_heartbeat": 1, "status": 20, "box_heartbeat": 21)" +
           plc + "}" + rest + "}";
}

TEST(RegisterMap, SaysWhatIsWrongAndWhere) {
    const std::pair<std::string, std::string> cases[] = {
        {map_with(""), "none"},
        {map_with("", R"(, "channels": [{"name": "X", "sum": null, "plc": 22}])"), "none"},
        {"[]", "plc: must be an object"},
        {"{", "is not valid JSON"},
        {R"({"plc": {}})", "plc.read: is missing"},
        {R"({"plc": {"read": 3}})", "plc.read: must be an object"},
        {R"({"plc": {"read": {"start": 0.5, "count": 1}}})",
         "plc.read.start: must be a whole number from 0 to 65535"},
        {R"({"plc": {"read": {"start": 65535, "count": 2}}})", "plc.read.count: must be a whole"},
        {R"({"plc": {"read": {"start": 0, "count": 4}, "write": {"start": 4, "count": 4},
            "control": 4}})",
         "plc.control: register 4 is outside the block 0 to 3"},
        {map_with(R"(, "referenced_bits": [1, 16])"), "plc.referenced_bits: must be a list"},
        {map_with("", R"(, "signals": [{"name": "X", "plc": 9, "type": "int32"}])"),
         "signals[0].plc: register 9 is outside the block"},
        {map_with("", R"(, "signals": [{"name": "X", "plc": 8, "type": "int64"}])"),
         "signals[0].type: 'int64' is not a number type"},
        {map_with("", R"(, "signals": [{"name": "X", "plc": 8, "scale": 0}])"),
         "signals[0].scale: must not be 0"},
        {map_with("", R"(, "signals": [{"name": "X", "plc": 8, "scale": "1"}])"),
         "signals[0].scale: must be a number"},
        {map_with("", R"(, "signals": [{"name": "X", "plc": 3, "min": 1, "max": 1}])"),
         "signals[0].max: must be above min"},
        {map_with(R"(, "referenced_bits": 1)"), "plc.referenced_bits: must be a list"},
        {map_with("", R"(, "signals": {})"), "signals: must be a list"},
        {map_with("", R"(, "channels": [7])"), "channels[0]: must be an object"},
        {map_with("", R"(, "channels": [{"name": "X", "plc": 9}])"),
         "channels[0].plc: register 9 is outside the block 20 to 29"},
    };
    for (const auto &[text, expected] : cases) {
        EXPECT_NE(complaint(text).find(expected), std::string::npos)
            << text << "\n  gives: " << complaint(text);
    }
}

TEST(RegisterMap, ExampleIsServed) {
    plc_options options;
    options.machine = from_source("examples/gantry-straightness/machine_twin.json");
    options.seed = 4;
    const plc_setup setup = prepare(options);
    EXPECT_EQ(setup.twin.seed, 4u);
    EXPECT_EQ(setup.map.channels.size(), 3u);
    EXPECT_EQ(setup.map.signals.size(), 3u);
    EXPECT_EQ(setup.profile.name, setup.map.profile);
    EXPECT_NO_THROW(fake_plc(setup.twin, setup.map, setup.profile, 0));

    plc_options plain;  // without a twin: straight axes over the plausible ranges
    plain.map = from_source("examples/gantry-straightness/machine.json");
    const plc_setup straight = prepare(plain);
    EXPECT_TRUE(straight.twin.errors.empty());
    EXPECT_TRUE(straight.twin.axes[2].present);
}

bool same(const shown_signal &a, const shown_signal &b) {
    return a.name == b.name && a.address == b.address && a.scale == b.scale && a.zero == b.zero &&
           a.format.what == b.format.what && a.format.bytes == b.format.bytes &&
           a.format.registers == b.format.registers;
}

bool same(const taken_channel &a, const taken_channel &b) {
    return a.name == b.name && a.address == b.address && a.scale_um == b.scale_um &&
           a.applied_address == b.applied_address && a.format.what == b.format.what &&
           a.format.bytes == b.format.bytes && a.format.registers == b.format.registers &&
           a.tangent.has_value() == b.tangent.has_value() &&
           (!a.tangent || (a.tangent->slope_address == b.tangent->slope_address &&
                           a.tangent->reference_address == b.tangent->reference_address));
}

// The registers of the machine file that compbox init writes.
register_map map_of_init(const std::string &profile) {
    coefficients::machine_options options;
    options.axes = "XYZ";
    options.profile = profile;
    return register_map_of(coefficients::new_machine(options), "init");
}

bool same(const register_block &a, const register_block &b) {
    return a.start == b.start && a.count == b.count && a.counters == b.counters;
}

TEST(UsualRegisterMap, IsTheOneOfInit) {
    for (const auto &profile : plc_profile::names()) {
        SCOPED_TRACE(profile);
        const register_map usual = prepare({profile, "", "", {}}).map, init = map_of_init(profile);
        EXPECT_EQ(usual.profile, init.profile);
        EXPECT_TRUE(same(usual.read, init.read) && same(usual.write, init.write));
        EXPECT_EQ(std::make_tuple(usual.control, usual.plc_heartbeat, usual.handshake),
                  std::make_tuple(init.control, init.plc_heartbeat, init.handshake));
        EXPECT_EQ(std::make_pair(usual.status, usual.box_heartbeat),
                  std::make_pair(init.status, init.box_heartbeat));
        ASSERT_EQ(usual.signals.size(), init.signals.size());
        ASSERT_EQ(usual.channels.size(), init.channels.size());
        for (std::size_t i = 0; i < usual.signals.size(); ++i) {
            EXPECT_TRUE(same(usual.signals[i], init.signals[i]));
            EXPECT_TRUE(same(usual.channels[i], init.channels[i]));
            EXPECT_EQ(usual.channels[i].tangent.has_value(), profile == "sinumerik-840d");
        }
    }
}

TEST(Setup, NeedsNoOption) {
    const plc_setup setup = prepare({});
    EXPECT_EQ(setup.profile.name, "generic");
    EXPECT_EQ(setup.map.channels.size(), 3u);
    for (const auto &axis : setup.twin.axes) {
        EXPECT_TRUE(axis.present);
        EXPECT_EQ(axis.min_mm, 0.0);
        EXPECT_EQ(axis.max_mm, 1000.0);
    }
    EXPECT_TRUE(setup.twin.errors.empty());
    EXPECT_NO_THROW(fake_plc(setup.twin, setup.map, setup.profile, 0));
}

plc_setup prepared_with_map(const std::string &text, const std::string &machine = "") {
    const std::string path = compbox_test::temporary("map.json");
    formats::write_file(path, text);
    plc_options options;
    options.map = path;
    options.machine = machine;
    return prepare(options);
}

// Channels without a position beside them (build leaves unused signals out) and without an axis.
TEST(Setup, AMachineMadeFromTheMapServesEveryChannel) {
    const std::string text = map_with("", R"(,
        "signals": [{"name": "X", "plc": 2, "type": "int16", "max": -5}],
        "channels": [{"name": "Z", "plc": 22}, {"name": "Y2", "plc": 23}, {"name": "U", "plc": 24}])");
    const plc_setup setup = prepared_with_map(text);
    EXPECT_EQ(setup.twin.axes[0].min_mm, -1005.0);
    rig r(setup.twin, setup.map);
    r.run_ms(1100);
    for (int i = 0; i < 60; ++i) {
        r.set_reg(20, active);
        r.set_reg(21, ++r.beat);
        for (unsigned address = 22; address < 25; ++address)
            r.set_reg(static_cast<int>(address), 10 * address);
        r.run_ms(30);
    }
    EXPECT_EQ(r.plc.state().applied_um, (std::vector<double>{220, 230, 240}));
    EXPECT_EQ(r.plc.state().displacement_um, (twin::xyz{0, 230, 220}));

    const std::string twin = from_source("examples/gantry-straightness/machine_twin.json");
    const plc_setup strict = prepared_with_map(text, twin);  // a real twin tells what it has
    EXPECT_THROW(fake_plc(strict.twin, strict.map, strict.profile, 0), input_error);
}

// The way of X1 and X2, two motors of one stage, after each scan.
struct two_motors : rig {
    std::vector<std::vector<double>> ways;
    static register_map two(double interpolate_s) {
        register_map map = small_map();
        map.interpolate_s = interpolate_s;
        map.channels.push_back({"X2", 14, {}, map.channels[0].format, 0.01});
        map.channels[0].name = "X1";
        return map;
    }
    static twin::twin_config stage() {
        twin::twin_config config = small_machine();
        config.channels = {{"X1", 'X'}, {"X2", 'X'}};
        return config;
    }
    explicit two_motors(double interpolate_s) : rig(stage(), two(interpolate_s)) {}
    void go(double x1_um, double x2_um, int duration_ms = 30) {
        const auto raw = static_cast<std::uint32_t>(std::lround(x2_um * 100.0));
        set_reg(14, raw >> 16);
        set_reg(15, raw & 0xFFFF);
        write(active, x1_um);
        now_us += duration_ms * ms;
        plc.run_to(now_us, [this](const plc_state &state) { ways.push_back(state.applied_um); });
    }
};

TEST(Plc, GoesToEachValueInAStraightLineWhereTheFileSaysSo) {
    two_motors r(0.03);
    while (r.now_us < 1200 * ms) r.go(0, 0);  // a multiple of the scan and of the box's period
    r.ways.clear();
    r.go(3, -6);
    ASSERT_EQ(r.ways.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        const double share = 8.0 * static_cast<double>(i + 1) / 30.0;
        EXPECT_NEAR(r.ways[i][0], 3 * share, 1e-9) << i;
        EXPECT_NEAR(r.ways[i][1], -6 * share, 1e-9) << i;
    }
    r.run_ms(8);
    EXPECT_EQ(r.applied(), 3.0) << "reached, and it stays";
    r.box_runs_ms(90, hold, 3);
    EXPECT_EQ(r.applied(), 3.0);
    two_motors at_once(0);
    while (at_once.now_us < 1200 * ms) at_once.go(0, 0);
    at_once.go(3, -6);
    EXPECT_EQ(at_once.applied(), 3.0);
}

TEST(Plc, OnALineTwoMotorsAreNeverFurtherApartThanInTheBlocks) {
    two_motors r(0.03);
    while (r.now_us < 1200 * ms) r.go(0, 0);
    for (int i = 0; i < 2000; ++i) {
        const double x1 = 20 * std::sin(1.7 * i), apart = 2 * std::cos(0.9 * i);
        r.go(x1, x1 + apart, 17 + i % 29);
    }
    double most = 0;
    for (const auto &way : r.ways) most = std::max(most, std::fabs(way[1] - way[0]));
    EXPECT_LE(most, 2.0 + 0.011) << "and one unit of the register";
    EXPECT_GT(most, 1.0);
}

TEST(Plc, WithoutTheBoxALineEndsInTheRamp) {
    two_motors r(0.03);
    while (r.now_us < 1200 * ms) r.go(0, 0);
    r.go(20, 20);
    r.run_ms(1500);
    EXPECT_TRUE(r.had("watchdog"));
    EXPECT_EQ(r.applied(), 0.0);
}

}  // namespace
}  // namespace compbox::fakeplc
