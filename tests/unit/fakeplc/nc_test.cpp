// SPDX-License-Identifier: MIT
// The way from the PLC into the NC: setting data that can tear, the handshake, alarms, restart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host-tools/fakeplc/nc_handshake.h"
#include "host-tools/fakeplc/nc_setting_data.h"
#include "tests/support/fakeplc_rig.h"

namespace compbox::fakeplc {
namespace {

// ---- the PLC's scan

std::vector<double> scan_lengths_ms(const char *profile, std::uint64_t seed) {
    twin::twin_config config = small_machine();
    config.seed = seed;
    rig r(config, small_map(), profile);
    std::vector<double> lengths;
    double before = 0.0;
    r.plc.run_to(2000 * ms, [&](const plc_state &state) {
        if (state.time_s > 0.0) lengths.push_back(1e3 * (state.time_s - before));
        before = state.time_s;
    });
    return lengths;
}

TEST(Scan, IsJitteredFromTheSeedAndKeepsItsPace) {
    for (const double length : scan_lengths_ms("generic", 1)) EXPECT_NEAR(length, 8.0, 1e-9);
    const auto one = scan_lengths_ms("sinumerik-840d", 1);
    EXPECT_EQ(one, scan_lengths_ms("sinumerik-840d", 1));
    EXPECT_NE(one, scan_lengths_ms("sinumerik-840d", 2));
    ASSERT_NEAR(static_cast<double>(one.size()), 250.0, 1.0);
    const auto [least, most] = std::minmax_element(one.begin(), one.end());
    EXPECT_GE(*least, 5.0);
    EXPECT_LE(*most, 11.0);
    EXPECT_GT(*most - *least, 3.0);
}

TEST(Scan, TheSlopeLimitHoldsOverScansOfAnyLength) {
    twin::twin_config config = small_machine();
    rig r(config, small_map(), "sinumerik-840d");
    r.box_runs_ms(1500, active, 0.0);
    double before_um = 0.0, before_s = r.plc.state().time_s;
    r.write(active, 300.0);
    r.now_us += 250 * ms;
    r.plc.run_to(r.now_us, [&](const plc_state &state) {
        const double most_um = 1000.0 * (state.time_s - before_s) + 1e-9;
        EXPECT_LE(std::fabs(state.applied_um[0] - before_um), most_um);
        before_um = state.applied_um[0], before_s = state.time_s;
    });
    EXPECT_GT(before_um, 150.0);
}

// ---- setting data

TEST(SettingData, ReachTheNcOneAxisAfterTheOther) {
    register_map map = small_map();
    map.write.count = 8;
    map.channels.push_back({"X2", 14, std::nullopt, format("int32"), 0.01, std::nullopt});
    twin::twin_config config = small_machine();
    config.channels["X2"] = 'X';
    rig r(config, map, "sinumerik-840d");
    r.box_runs_ms(1500, active, 0.0);
    r.set_reg(15, 300);
    r.write(active, 3.0);
    bool apart = false;  // both are wanted in the same scan
    for (int i = 0; i < 100; ++i) {
        r.run_ms(1);
        const auto &held = r.plc.held();
        apart = apart || (held[0].um != held[1].um);
    }
    EXPECT_TRUE(apart);
    EXPECT_EQ(r.plc.held()[0].um, 3.0);
    EXPECT_EQ(r.plc.held()[1].um, 3.0);
}

TEST(SettingData, AreWrittenByADeadband) {
    rig r(small_machine(), small_map(), "sinumerik-840d");
    r.box_runs_ms(1800, active, 10.0);
    EXPECT_EQ(r.plc.held()[0].um, 10.0);
    r.box_runs_ms(300, active, 10.09);
    EXPECT_EQ(r.plc.held()[0].um, 10.0);
    r.box_runs_ms(300, active, 10.11);
    EXPECT_EQ(r.plc.held()[0].um, 10.11);
}

TEST(SettingData, TheDeadbandIsTheFilesWhereItHasOne) {
    register_map map = small_map();
    map.deadband_um = 2.0;
    rig r(small_machine(), map, "sinumerik-840d");
    r.box_runs_ms(1800, active, 10.0);
    const double before_um = r.plc.held()[0].um;
    EXPECT_NEAR(before_um, 10.0, 2.0);
    r.box_runs_ms(300, active, before_um + 1.9);
    EXPECT_EQ(r.plc.held()[0].um, before_um);
    r.box_runs_ms(300, active, before_um + 2.1);
    EXPECT_NE(r.plc.held()[0].um, before_um);
}

TEST(SettingData, EnterTheAxisWithAPartOfItsVelocityOnly) {
    twin::twin_config config = small_machine();
    config.axes[0].max_velocity_mm_per_s = 10.0;  // x 0.01 x 4 ms: 0.4 um a cycle
    rig r(config, small_map(), "sinumerik-840d");
    r.box_runs_ms(1500, active, 0.0);
    double before = 0.0;
    for (int i = 0; i < 300; ++i) {
        if (i % 30 == 0) r.write(active, 20.0);
        r.run_ms(1);
        const double now = r.plc.nc().displacement_um()[0];
        EXPECT_LE(std::fabs(now - before), 0.4 + 1e-9);
        before = now;
    }
    EXPECT_NEAR(before, 20.0, 1e-9);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
}

// Half-written sets as an interpolation cycle may find them: how far the correction at the axis'
// position is at most from what it was and what it will be, whichever is nearer.
double worst_tear_um(const correction &held, const correction &set, double position_mm) {
    const double before = held.at_um(position_mm), after = set.at_um(position_mm);
    double worst = 0.0;
    correction partly = held;
    const auto look = [&] {
        const double now = partly.at_um(position_mm);
        worst = std::max(worst, std::min(std::fabs(now - before), std::fabs(now - after)));
    };
    partly.reference_mm = set.reference_mm;
    look();
    partly.um = set.um;
    look();
    return worst;
}

TEST(SettingData, APlannedSetIsExactAndNeverTearsByMoreThanStated) {
    twin::random_stream random(11, "tears");
    double naive = 0.0;
    for (int i = 0; i < 20000; ++i) {
        const correction held = {random.symmetric(300.0), random.symmetric(0.01),
                                 random.symmetric(10000.0)};
        const correction wanted = {random.symmetric(300.0), random.symmetric(0.01),
                                   held.reference_mm + random.symmetric(i % 2 ? 20.0 : 9000.0)};
        const double position_mm = wanted.reference_mm + random.symmetric(i % 3 ? 10.0 : 500.0);
        const double way_mm = i % 5 ? 0.0 : std::fabs(random.symmetric(10.0));
        const correction set = nc_setting_data::planned(held, wanted, position_mm, way_mm, 0.5);
        const double most = std::max(0.25, 1e3 * std::fabs(held.slope) * way_mm);
        ASSERT_LE(worst_tear_um(held, set, position_mm), most * (1 + 1e-9) + 1e-9);
        ASSERT_NEAR(set.at_um(position_mm), wanted.at_um(position_mm), 1e-6);
        naive = std::max(naive, worst_tear_um(held, wanted, position_mm));
    }
    EXPECT_GT(naive, 1000.0) << "without the steps it does tear";
}

TEST(SettingData, PlannedSetsArriveWhereTheAxisStands) {
    const correction wanted = {12.0, 0.0002, 700.0};
    correction held = {40.0, -0.0001, 500.0};
    int sets = 0;
    for (; sets < 1000 && (held.slope != wanted.slope || held.reference_mm != 700.0); ++sets) {
        held = nc_setting_data::planned(held, wanted, 700.0, 0.0, 0.5);
    }
    EXPECT_LT(sets, 400);
    EXPECT_NEAR(held.um, 12.0, 1e-9);
    held = nc_setting_data::planned({}, wanted, 700.0, 0.0, 0.5);
    EXPECT_EQ(held.reference_mm, 700.0) << "without a slope the reference is free to go";
}

// Value, slope and reference as a box in tangent mode writes them, over a curve.
struct tangent_rig {
    rig r;
    double a, wave_mm = 200.0;

    static register_map map() {
        register_map map = small_map();
        map.write.count = 10;
        map.channels[0].tangent =
            taken_tangent{14, 16, format("int16"), format("int32"), 1e-8, 1e-4};
        return map;
    }
    explicit tangent_rig(double tear_um) : r(small_machine(), map(), sinumerik(tear_um)), a(30.0) {}
    static plc_profile sinumerik(double tear_um) {
        plc_profile profile = plc_profile::find("sinumerik-840d").value();
        profile.nc.tear_um = tear_um;
        return profile;
    }

    double curve_um(double x) const { return a * std::sin(x / wave_mm); }
    void write() {
        const double x = r.plc.nc().position_mm()[0];
        const auto slope =
            static_cast<unsigned>(std::lround(1e-3 * a / wave_mm * std::cos(x / wave_mm) / 1e-8));
        const auto reference = static_cast<std::uint32_t>(std::lround(x / 1e-4));
        r.set_reg(14, slope & 0xFFFF);
        r.set_reg(16, reference >> 16), r.set_reg(17, reference & 0xFFFF);
        r.write(active, curve_um(x));
    }
};

// Largest distance between what the NC has and the curve, over a move at this feed and while the
// axis then stands; out: the last distance, too.
struct distances {
    double moving_um = 0.0, at_rest_um = 0.0;
};
distances off_the_curve(double tear_um, double feed_mm_per_s) {
    tangent_rig t(tear_um);
    distances worst;
    for (int i = 0; i < 60; ++i) t.write(), t.r.run_ms(30);
    twin::twin_step step;
    step.target_mm[0] = 900.0;
    step.feed_mm_per_s = feed_mm_per_s;
    t.r.plc.move(step);
    for (int i = 0, rest = 0; rest < 600; ++i) {
        if (i % 30 == 0) t.write();
        t.r.run_ms(1);
        if (!t.r.plc.moving()) ++rest;
        const double off_um = t.r.plc.held()[0].at_um(t.r.plc.nc().position_mm()[0]) -
                              t.curve_um(t.r.plc.nc().position_mm()[0]);
        worst.moving_um = std::max(worst.moving_um, std::fabs(off_um));
        worst.at_rest_um = std::fabs(off_um);
    }
    return worst;
}

// The curve turns by 0.15 um/mm at most. Between two sets the NC goes on along the tangent; what is
// written in the wrong order, or in one go, is off by the slope times the way since the last set.
TEST(SettingData, FollowATangentWhileTheAxisMovesWithoutASpike) {
    const distances planned = off_the_curve(0.5, 100.0), naive = off_the_curve(1e9, 100.0);
    EXPECT_LT(planned.moving_um, 0.7);
    EXPECT_GT(naive.moving_um, planned.moving_um + 0.2);
    EXPECT_LE(planned.at_rest_um, 0.11) << "the deadband";
    RecordProperty("planned_nm", static_cast<int>(1e3 * planned.moving_um));
    RecordProperty("naive_nm", static_cast<int>(1e3 * naive.moving_um));
}

// ---- FANUC

// The register map of the small machine for a FANUC: handshake at 5, int16 values of 0.1 um.
register_map fanuc_map(bool axes_at_once = false) {
    register_map map = small_map();
    map.read = {0, 16, false};
    map.write = {20, 6, false};
    map.status = 20, map.box_heartbeat = 21;
    map.handshake = 5;
    map.axes_at_once = axes_at_once;
    map.channels.clear();
    for (int i = 0; i < 3; ++i) {
        map.channels.push_back({std::string(1, twin::axis_letters[i]), 22 + i, 8 + i,
                                format("int16"), 0.1, std::nullopt});
    }
    return map;
}

twin::twin_config three_axes() {
    twin::twin_config config = small_machine();
    config.axes[1] = config.axes[2] = config.axes[0];
    return config;
}

struct fanuc_rig : rig {
    explicit fanuc_rig(bool axes_at_once = false, const twin::twin_config &config = three_axes())
        : rig(config, fanuc_map(axes_at_once), "fanuc") {}

    void write_units(int x, int y, int z) {
        set_reg(22, static_cast<unsigned>(x)), set_reg(23, static_cast<unsigned>(y));
        set_reg(24, static_cast<unsigned>(z));
    }
    void live_ms(int duration_ms) {
        for (int t = 0; t < duration_ms; t += 4) {
            if (t % 28 == 0) set_reg(20, active), set_reg(21, ++beat);
            run_ms(4);
            seen.push_back(reg(5));
        }
    }
    std::vector<unsigned> seen;  // the handshake register, every interpolation cycle
};

// Runs of the same low byte, without the zeros.
std::vector<unsigned> handed(const std::vector<unsigned> &seen) {
    std::vector<unsigned> order;
    unsigned before = 0;
    for (const unsigned word : seen) {
        const unsigned channel = word & 0xFF;
        if (channel != before && channel != 0) order.push_back(channel);
        before = channel;
    }
    return order;
}

TEST(Fanuc, HandsOverOneAxisAfterTheOtherInFourScansEach) {
    fanuc_rig r;
    r.live_ms(1500);
    EXPECT_EQ(handed(r.seen), (std::vector<unsigned>{1, 2, 3})) << "zeros, once, at the start";
    r.seen.clear();
    r.write_units(10, 20, -30);
    r.live_ms(60);
    const bool all_there = r.plc.held()[2].um != 0.0;
    EXPECT_FALSE(all_there) << "three axes take about 100 ms";
    r.live_ms(80);
    EXPECT_EQ(handed(r.seen), (std::vector<unsigned>{1, 2, 3}));
    EXPECT_NEAR(r.plc.held()[0].um, 1.0, 1e-9);
    EXPECT_NEAR(r.plc.held()[2].um, -3.0, 1e-9);
    EXPECT_EQ(r.reg(8), 10);
    EXPECT_EQ(static_cast<std::int16_t>(r.reg(10)), -30);
    r.seen.clear();
    r.live_ms(400);
    EXPECT_TRUE(handed(r.seen).empty()) << "nothing changes, nothing is handed over";
}

TEST(Fanuc, TheRegisterShowsEachStepOfTheHandshake) {
    fanuc_rig r;
    r.live_ms(1500);
    r.seen.clear();
    r.write_units(10, 0, 0);
    r.live_ms(60);
    std::vector<unsigned> steps;
    for (const unsigned word : r.seen) {
        if (steps.empty() || steps.back() != word) steps.push_back(word);
    }
    const std::vector<unsigned> whole = {0, 1, 0x101, 0x301, 0x201, 0};
    std::size_t next = 0;  // a scan of 8 ms may skip a state of 4 ms, but never swap two
    for (const unsigned step : steps) {
        const auto found =
            std::find(whole.begin() + static_cast<std::ptrdiff_t>(next), whole.end(), step);
        ASSERT_NE(found, whole.end()) << std::hex << step;
        next = static_cast<std::size_t>(found - whole.begin());
    }
    EXPECT_GE(steps.size(), 5u);
    EXPECT_EQ(steps.back(), 0u);
}

TEST(Fanuc, AControlWithTheExtendedShiftTakesAllAxesAtOnce) {
    fanuc_rig r(true);
    r.live_ms(1500);
    r.seen.clear();
    r.write_units(10, 20, 30);
    std::set<std::vector<double>> states;
    for (int t = 0; t < 60; t += 4) {
        r.live_ms(4);
        states.insert({r.plc.held()[0].um, r.plc.held()[1].um, r.plc.held()[2].um});
    }
    EXPECT_EQ(states.size(), 2u) << "before and after, nothing between";
    EXPECT_EQ(handed(r.seen), (std::vector<unsigned>{1}));
}

TEST(Fanuc, TheAxisMovesAtOnce) {
    twin::twin_config config = three_axes();
    config.axes[0].max_velocity_mm_per_s = 0.1;  // x 0.01 x 4 ms would be 4 nm
    fanuc_rig r(false, config);
    r.live_ms(1500);
    r.write_units(80, 0, 0);
    r.live_ms(60);
    EXPECT_NEAR(r.plc.nc().displacement_um()[0], 8.0, 1e-9);
}

TEST(Fanuc, AChangeOf9999UnitsIsAnAlarmThatStopsUntilReset) {
    twin::twin_config config = three_axes();
    config.plc.slope_um_per_s = 1e6;  // a ladder that does not divide large steps …
    config.plc.size_um = 2000.0;      // … nor bounds the value
    fanuc_rig r(false, config);
    r.live_ms(1500);
    EXPECT_EQ(r.reg(0) & 1, 1);
    r.write_units(9998, 0, 0);
    r.live_ms(100);
    EXPECT_NEAR(r.plc.held()[0].um, 999.8, 1e-6) << "a step of 9998 is taken";
    r.write_units(-1, 0, 0);
    r.live_ms(100);
    EXPECT_NEAR(r.plc.held()[0].um, 999.8, 1e-6) << "a step of 9999 is not";
    EXPECT_EQ(r.reg(5) & 0x8000, 0x8000);
    EXPECT_EQ(r.reg(0) & 1, 0) << "an NC alarm takes the enable";
    ASSERT_TRUE(r.plc.alarms().stands("nc-shift"));
    EXPECT_TRUE(
        r.had("alarm nc-shift came: external data input of X: -1 is 9999 or more from 9998"));
    r.write_units(9000, 5, 0);
    r.live_ms(300);
    EXPECT_TRUE(r.plc.alarms().stands("nc-shift")) << "only reset clears it";
    EXPECT_EQ(r.plc.held()[1].um, 0.0);
    r.plc.press_reset();
    r.live_ms(1500);
    EXPECT_FALSE(r.plc.alarms().stands("nc-shift"));
    EXPECT_TRUE(r.had("alarm nc-shift went"));
    EXPECT_EQ(r.reg(0) & 1, 1);
    EXPECT_NEAR(r.plc.held()[0].um, 900.0, 1e-6);
}

TEST(Fanuc, AValueBeyond9999IsAnAlarm) {
    twin::twin_config config = three_axes();
    config.plc.size_um = 2000.0;
    fanuc_rig r(false, config);
    r.live_ms(1500);
    r.write_units(0, 10000, 0);
    r.live_ms(2000);
    EXPECT_TRUE(r.had("external data input of Y: 1"));
    EXPECT_TRUE(r.plc.alarms().stands("nc-shift"));
    EXPECT_LE(r.plc.held()[1].um, 999.9 + 1e-9);
}

// ---- alarms and restart

TEST(Alarms, ComeAndGoWithTheirCause) {
    alarm_list list;
    list.set("a", "one", true, 1.0);
    list.set("a", "one", true, 2.0);
    list.set("b", "two", true, 3.0, true);
    EXPECT_EQ(list.standing().size(), 2u);
    EXPECT_EQ(list.standing()[0].since_s, 1.0);
    list.set("a", "one", false, 4.0);
    list.set("b", "two", false, 4.0);
    EXPECT_FALSE(list.stands("a"));
    EXPECT_TRUE(list.stands("b")) << "until reset";
    list.reset();
    EXPECT_TRUE(list.standing().empty());
    EXPECT_EQ(list.take_events(),
              (std::vector<std::string>{"alarm a came: one", "alarm b came: two", "alarm a went",
                                        "alarm b went"}));
    EXPECT_EQ(list.total(), 2);
}

TEST(Alarms, TellWhatTheBoxDoes) {
    rig r;
    r.box_runs_ms(1500, active, 1.0);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
    r.box_runs_ms(60, 4 | 9 << 8, 1.0);
    EXPECT_TRUE(r.had("alarm box-fault came: the box is in FAULT, reason 9"));
    r.box_runs_ms(60, active, 1.0);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
    r.run_ms(300);
    EXPECT_TRUE(r.plc.alarms().stands("box-lost"));
    r.box_runs_ms(60, active, 1.0);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
    r.write(5, 0.0);
    r.run_ms(300);
    EXPECT_TRUE(r.plc.alarms().standing().empty()) << "a clean stop is none";
    r.plc.freeze_nc(true);
    r.run_ms(20);
    EXPECT_TRUE(r.plc.alarms().stands("nc-coupling"));
}

TEST(Alarms, ABlockThatStaysTornIsOne) {
    register_map map = small_map();
    map.write.counters = true;
    map.status = 14;
    rig r(small_machine(), map);
    r.run_ms(100);
    r.set_reg(10, 7);
    r.run_ms(150);
    EXPECT_FALSE(r.plc.alarms().stands("box-torn"));
    r.run_ms(100);
    EXPECT_TRUE(r.plc.alarms().stands("box-torn"));
    r.set_reg(15, 7);
    r.run_ms(20);
    EXPECT_FALSE(r.plc.alarms().stands("box-torn"));
}

// What the NC remembers over a restart of the PLC is written to zero by the PLC.
TEST(Restart, LeavesNothingOfTheOldCompensation) {
    for (const char *profile : {"generic", "sinumerik-840d", "fanuc"}) {
        SCOPED_TRACE(profile);
        rig r(small_machine(), small_map(), profile);
        r.box_runs_ms(1800, active, 20.0);
        EXPECT_NEAR(r.plc.nc().displacement_um()[0], 20.0, 1e-9);
        r.plc.restart();
        EXPECT_EQ(r.reg(12), 0);
        EXPECT_EQ(r.reg(13), 0);
        const double time_s = r.plc.state().time_s;
        r.run_ms(200);
        EXPECT_EQ(r.plc.held()[0].um, 0.0);
        EXPECT_EQ(r.reg(0) & 3, 0) << "not referenced, not enabled";
        r.run_ms(1000);
        EXPECT_EQ(r.reg(0) & 3, 3);
        EXPECT_GT(r.plc.state().time_s, time_s) << "the log goes on";
        r.box_runs_ms(300, active, 20.0);
        EXPECT_NEAR(r.plc.nc().displacement_um()[0], 20.0, 1e-9);
    }
}

}  // namespace
}  // namespace compbox::fakeplc
