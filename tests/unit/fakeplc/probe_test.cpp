// SPDX-License-Identifier: MIT
// The touch-probe cycle, over the PLC's registers.
#include <gtest/gtest.h>

#include <cmath>

#include "host-tools/formats/json.h"
#include "tests/support/fakeplc_rig.h"

namespace compbox::fakeplc {
namespace {

// small_map with a probe of X: value in 8 (int32, 0.01 um), count in 10, and the request in 26.
register_map probe_map() {
    register_map map = small_map();
    map.read.count = 12;
    map.write = {20, 8, false};
    map.status = 20, map.box_heartbeat = 21, map.request = 26;
    map.channels[0].address = 22;
    const auto word = number_format::parse("uint16").value();
    map.signals.push_back({"probe_x", 8, format("int32"), 0.01, 0.0, -500.0, 500.0});
    map.signals.push_back({"probe_x_n", 10, word, 1.0, 0.0, {}, {}});
    map.probes = {{"X", "probe_x", "probe_x_n"}};
    return map;
}

// A machine that is 14 um off in X, with a probe without noise.
twin::twin_config machine_14_um_off() {
    twin::twin_config config = small_machine();
    config.errors["EXX"].amplitude = 0.0;
    config.errors["EXX"].points = {{0.0, 14.0}, {1000.0, 14.0}};
    config.probe.sigma_um = 0.0;
    return config;
}

struct probe_rig : rig {
    explicit probe_rig(const twin::twin_config &config = machine_14_um_off())
        : rig(config, probe_map()) {}
    double value_um() { return int32_at(8) * 0.01; }
    unsigned count() { return reg(10); }
    // Runs scan by scan until the count changes, at most 3 s; false if it did not.
    bool until_counted() {
        const unsigned before = count();
        for (int scan = 0; scan < 375 && count() == before; ++scan) {
            write(active, 0.0);
            run_ms(8);
        }
        return count() != before;
    }
};

TEST(Probe, MeasuresOnceForEachCommand) {
    probe_rig r;
    r.run_ms(3000);
    EXPECT_EQ(r.count(), 0u);
    EXPECT_EQ(r.value_um(), 0.0);
    ASSERT_TRUE(r.plc.probe("X", 0.0));
    r.run_ms(3000);
    EXPECT_EQ(r.count(), 1u);
    EXPECT_NEAR(r.value_um(), 14.0, 0.006);
    EXPECT_EQ(r.plc.probes().measurements(), 1);
    EXPECT_TRUE(r.had("probe X 14.000 um count 1"));
    EXPECT_FALSE(r.plc.probe("Z", 0.0));
}

TEST(Probe, MeasuresWhatTheCompensationLeaves) {
    probe_rig r;
    r.box_runs_ms(3000, active, -9.0);
    ASSERT_EQ(r.applied(), -9.0);
    r.plc.probe("X", 0.0);
    r.box_runs_ms(1500, active, -9.0);
    ASSERT_EQ(r.count(), 1u);
    EXPECT_NEAR(r.value_um(), 5.0, 0.02);
}

TEST(Probe, WritesTheValueOneScanBeforeTheCount) {
    probe_rig r;
    r.plc.probe("X", 0.0);
    int scans_between = 0;
    for (int scan = 0; scan < 500 && r.count() == 0; ++scan) {
        r.run_ms(8);
        if (r.count() == 0 && r.value_um() != 0.0) ++scans_between;
    }
    EXPECT_EQ(r.count(), 1u);
    EXPECT_EQ(scans_between, 1);
}

TEST(Probe, WaitsUntilTheAxesStand) {
    probe_rig r;
    r.run_ms(1100);
    twin::twin_step way;
    way.target_mm[0] = 900.0;
    way.feed_mm_per_s = 200.0;
    r.plc.move(way);
    r.run_ms(20);
    r.plc.probe("X", 0.0);
    while (r.plc.moving()) {
        r.run_ms(8);
        ASSERT_EQ(r.count(), 0u);
    }
    r.run_ms(960);
    EXPECT_EQ(r.count(), 0u) << "a cycle takes a second at rest";
    r.run_ms(80);
    EXPECT_EQ(r.count(), 1u);
}

TEST(Probe, RepeatsOnRequestTwiceAtMost) {
    probe_rig r;
    r.box_runs_ms(1200, active, 0.0);
    r.set_reg(26, 1);
    EXPECT_FALSE(r.until_counted()) << "there is no cycle to repeat";
    r.set_reg(26, 0);
    r.plc.probe("X", 100.0);
    ASSERT_TRUE(r.until_counted());
    EXPECT_NEAR(r.value_um(), 114.0, 0.006);
    r.set_reg(26, 1);
    ASSERT_TRUE(r.until_counted());
    EXPECT_NEAR(r.value_um(), 14.0, 0.006) << "a wrong measurement is not repeated";
    ASSERT_TRUE(r.until_counted());
    EXPECT_FALSE(r.until_counted()) << "a bit that stays on is obeyed twice";
    r.set_reg(26, 0);
    r.run_ms(30);
    r.set_reg(26, 1);
    EXPECT_TRUE(r.until_counted());
}

TEST(Probe, HeedsNoRequestOfABoxThatIsGone) {
    probe_rig r;
    r.box_runs_ms(1200, active, 0.0);
    r.plc.probe("X", 0.0);
    ASSERT_TRUE(r.until_counted());
    r.set_reg(26, 1);
    r.run_ms(5000);
    EXPECT_EQ(r.count(), 1u);
}

TEST(Probe, RunsByItselfAtAnInterval) {
    twin::twin_config config = machine_14_um_off();
    config.probe.interval_s = 60.0;
    probe_rig r(config);
    r.run_ms(59000);
    EXPECT_EQ(r.count(), 0u);
    r.run_ms(10 * 60000);
    EXPECT_EQ(r.count(), 10u);
}

TEST(Probe, HasItsNoiseAndItsShareOfWrongMeasurements) {
    twin::twin_config config = machine_14_um_off();
    config.probe = {1.5, 0.1, 1.0, 0.2, 100.0};
    probe_rig r(config);
    int wrong = 0, good = 0;
    double sum_um2 = 0.0;
    unsigned seen = 0;
    for (int second = 0; second < 1000; ++second) {
        r.run_ms(1000);
        if (r.count() == seen) continue;
        seen = r.count();
        const double off_um = r.value_um() - 14.0;
        if (std::fabs(off_um) > 50.0) {
            EXPECT_NEAR(std::fabs(off_um), 100.0, 9.0 * 1.5);
            ++wrong;
            continue;
        }
        sum_um2 += off_um * off_um;
        ++good;
    }
    ASSERT_GT(wrong + good, 900);
    const double share = wrong / static_cast<double>(wrong + good);
    EXPECT_NEAR(share, 0.2, 4.0 * std::sqrt(0.2 * 0.8 / 900.0));
    EXPECT_NEAR(std::sqrt(sum_um2 / good), 1.5, 0.15);
}

TEST(Probe, KeepsItsCountOverARestartOfThePlc) {
    probe_rig r;
    r.plc.probe("X", 0.0);
    r.run_ms(3000);
    ASSERT_EQ(r.count(), 1u);
    r.plc.probe("X", 0.0);
    r.plc.restart();
    r.run_ms(3000);
    EXPECT_EQ(r.count(), 1u) << "the cycle that waited is dropped";
    EXPECT_NEAR(r.value_um(), 14.0, 0.006);
}

json file_with(const json &signals, const json &terms) {
    return {
        {"plc",
         {{"read", {{"start", 0}, {"count", 40}}},
          {"write", {{"start", 100}, {"count", 16}}},
          {"control", 0},
          {"plc_heartbeat", 1},
          {"status", 100},
          {"box_heartbeat", 101},
          {"request", 115}}},
        {"signals", signals},
        {"terms", terms},
        {"channels", {{{"name", "Z1"}, {"plc", 104}, {"type", "int32"}, {"sum", {"adapted"}}}}}};
}

TEST(Probe, TheMapHasTheProbesOfTermsAndOfTheirUsualNames) {
    const json signals = {{{"name", "probe_x"}, {"plc", 8}},
                          {{"name", "probe_x_n"}, {"plc", 9}, {"type", "uint16"}},
                          {{"name", "probe_y"}, {"plc", 10}},
                          {{"name", "touched"}, {"plc", 12}},
                          {{"name", "touches"}, {"plc", 13}, {"type", "uint16"}}};
    const json terms = {{{"name", "adapted"},
                         {"type", "adapt"},
                         {"probe", {{"value", "touched"}, {"count", "touches"}}}}};
    const register_map map = register_map_of(file_with(signals, terms), "f.json");
    EXPECT_EQ(map.request, 115);
    ASSERT_EQ(map.probes.size(), 2u) << "probe_y has no count";
    EXPECT_EQ(map.probes[0].axis, "Z1");
    EXPECT_EQ(map.probes[0].value, "touched");
    EXPECT_EQ(map.probes[1].axis, "X");
    EXPECT_EQ(map.probes[1].count, "probe_x_n");
}

}  // namespace
}  // namespace compbox::fakeplc
