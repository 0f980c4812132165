// SPDX-License-Identifier: MIT
// Terms with a bank: the bits of a linear term of lagged signals, whatever happens to the inputs;
// columns without a lag, slopes, and the training range.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bank_rig.h"
#include "tests/support/cases.h"
#include "tests/support/dice.h"

namespace compbox {
namespace {

const std::string lags = R"(,
 {"name": "T1_60", "unit": "degC", "lag_of": "T1", "tau_s": 60}, {"name": "T1_9", "unit": "degC", "lag_of": "T1", "tau_s": 0.9},
 {"name": "T1_sq", "unit": "K2", "lag_of": "T1", "tau_s": 60, "power": 2}, {"name": "T1_sq9", "unit": "K2", "lag_of": "T1", "tau_s": 0.9, "power": 2},
 {"name": "rpm_60", "unit": "1/min", "lag_of": "rpm", "tau_s": 60}, {"name": "rpm_9", "unit": "1/min", "lag_of": "rpm", "tau_s": 0.9},
 {"name": "lag_60", "unit": "degC", "lag_of": "T1_60", "tau_s": 60}, {"name": "lag_9", "unit": "degC", "lag_of": "T1_60", "tau_s": 0.9})";
const std::string both_kinds = R"(
 {"name": "of_lags", "type": "linear", "inputs": ["rpm_9", "rpm_60", "T1_9", "T1_60", "T1_sq9", "T1_sq", "lag_9", "lag_60"],
  "weights": [0.01, -0.02, 0.3, 0.4, -0.005, 0.006, 0.7, -0.8], "constant": -3.5},
 {"name": "warm", "type": "linear", "outputs": ["banked", "other"],
  "bank": {"inputs": ["rpm", "T1", "T1_60"], "powers": {"T1": [1, 2]}, "tau_s": [0.9, 60],
   "weights": [[0.01, -0.02, 0.3, 0.4, -0.005, 0.006, 0.7, -0.8], [0, 0, 0, 1, 0, 0, 0, 0]], "bias": [-3.5, 0]}},
 {"name": "third", "type": "linear", "bank": {"inputs": ["T1"], "tau_s": [60], "weights": [[1]]}})";

// The inputs jump, go missing, are implausible and too fast; the clock jumps; the PLC is away.
TEST(bank, has_the_bits_of_a_linear_term_of_lags_whatever_happens) {
    for (uint32_t seed = 0; seed < compbox_test::cases(50u); ++seed) {
        compbox_test::dice dice(seed);
        bank_rig rig(both_kinds, lags);
        for (int i = 0; i < 400; ++i) {
            if (dice(9) == 0) rig.t1 = -20.0 + static_cast<double>(dice(13000)) * 0.01;
            if (dice(9) == 0) rig.rpm = -400.0 + static_cast<double>(dice(1000));
            if (dice(30) == 0) rig.heard[AT_T1] = !rig.heard[AT_T1];
            if (dice(60) == 0) rig.reading = !rig.reading;
            const int64_t jumps_us[] = {10000000, -5000000, 149000, 1};
            rig.go(dice(60) == 0 ? jumps_us[dice(4)] : 30000 + dice(200) - 100);
            ASSERT_EQ(cb_bits_of(rig.term("banked")), cb_bits_of(rig.term("of_lags")))
                << "seed " << seed << ", step " << i;
            ASSERT_EQ(rig.live("banked"), rig.live("of_lags")) << seed << ", " << i;
            if (rig.live("third") && rig.live("other")) {
                ASSERT_EQ(cb_bits_of(rig.term("third")), cb_bits_of(rig.term("other")));
            }
        }
    }
}

// After a while without T1 the terms fade, and come back with the lag over the whole gap.
TEST(bank, a_stale_input_fades_all_outputs) {
    bank_rig rig(both_kinds, lags);
    rig.go();
    EXPECT_TRUE(rig.live("banked"));
    EXPECT_FLOAT_EQ(rig.term("other"), 20);
    rig.heard[AT_T1] = false;
    for (int i = 0; i < 35; ++i) rig.go();
    EXPECT_FALSE(rig.live("banked"));
    EXPECT_LT(rig.term("other"), 20);
    EXPECT_GT(rig.term("other"), 0);
    EXPECT_EQ(rig.box->counters.terms_faded, 3u);
    rig.heard[AT_T1] = true;
    rig.t1 = 50;
    rig.go();
    EXPECT_TRUE(rig.live("banked"));
    const double h = 36 * 0.03 / 60;  // linear from 20 to 50 over the gap
    EXPECT_NEAR(rig.term("other"), 20 + 30 * (1 - (1 - std::exp(-h)) / h), 1e-4);
}

// A wrong reading of two minutes would stay in a lag of hours long after the sensor is trusted
// again.
TEST(bank, lags_of_a_doubted_sensor_follow_what_the_others_predict) {
    const config_builder file = from_text(bank_file(both_kinds, lags));
    cb_config &c = *file.config;
    const uint8_t sensors[] = {AT_T1, AT_T2, AT_RPM};
    // 1 of each alone, and 20 of all together
    const float matrix[] = {20,      20,     0,       0.667f,  -0.333f, -0.333f,
                            -0.333f, 0.667f, -0.333f, -0.333f, -0.333f, 0.667f};
    c.sensors_count = 3;
    c.sensors.pool = c.pool_count;
    c.sensors.after_us = 3000000;
    c.sensors.threshold_square = 36.0f;
    std::copy(sensors, sensors + 3, c.sensors.signal);
    std::copy(matrix, matrix + 12, c.pool + c.pool_count);
    c.pool_count = static_cast<uint16_t>(c.pool_count + 12);
    bank_rig rig(file);
    rig.t1 = rig.t2 = 20;
    for (int i = 0; i < 100; ++i) rig.go();
    EXPECT_FLOAT_EQ(rig.term("third"), 20);
    rig.t1 = 21;
    while (rig.t1 < 40) {  // as fast as it may change
        rig.t1 += 1;
        rig.go();
    }
    for (int i = 0; i < 4000; ++i) rig.go();
    EXPECT_FALSE(rig.live("third"));
    rig.t1 = 20;
    for (int i = 0; i < 1200; ++i) rig.go();
    EXPECT_TRUE(rig.live("third"));
    EXPECT_NEAR(rig.term("third"), 20, 1.5);
    EXPECT_EQ(cb_bits_of(rig.term("banked")), cb_bits_of(rig.term("of_lags")));
}

TEST(bank, columns_without_a_lag_have_the_input_of_this_step) {
    bank_rig rig(
        R"({"name": "banked", "type": "linear", "bank": {"inputs": ["rpm", "X"], "tau_s": [0],
        "powers": {"rpm": [1, 2, 3, 4], "X": [3]}, "weights": [[1, 0.1, 1e-3, 1e-6, 2e-6]], "bias": [7]}})");
    EXPECT_EQ(rig.box->config.bank_lags_count, 0);
    for (const double rpm : {0.0, 3.0, -300.0, 500.0}) {
        rig.rpm = rpm;
        rig.x = 10 + rpm;
        for (int i = 0; i < 60; ++i) rig.go();  // at rest, so the lead is 0
        EXPECT_NEAR(rig.term("banked"),
                    7 + rpm + 0.1 * rpm * rpm + 1e-3 * std::pow(rpm, 3) + 1e-6 * std::pow(rpm, 4) +
                        2e-6 * std::pow(rig.x, 3),
                    2e-7 * (std::fabs(rpm) + 0.1 * rpm * rpm + 1e-3 * std::pow(std::fabs(rpm), 3) +
                            1e-6 * std::pow(rpm, 4)) +
                        1e-4);
    }
    rig.x += 3;  // 100 mm/s
    rig.go();
    const double ahead = rig.box->signals[AT_X].used;
    EXPECT_GT(ahead, rig.x + 1) << "a position has its lead";
    EXPECT_NEAR(rig.term("banked") - 7 - 500 - 25000 - 125000 - 62500, 2e-6 * std::pow(ahead, 3),
                0.1);
}

// A lag stays within the range of its power, as a lag of a signal does.
TEST(bank, a_lag_stays_within_its_range) {
    bank_rig rig(R"({"name": "banked", "type": "linear", "bank": {"inputs": ["T2"], "tau_s": [60],
        "powers": {"T2": [2]}, "weights": [[1]]}})");
    rig.go();
    EXPECT_FLOAT_EQ(rig.term("banked"), 625);
    rig.box->bank.lags[0].hi = 1e6f;
    rig.go();
    EXPECT_EQ(rig.term("banked"), 1600);
    rig.box->bank.lags[0].hi = -1e6f;
    rig.go();
    EXPECT_EQ(rig.term("banked"), 100);
}

const std::string trained = R"({"name": "w", "type": "linear", "outputs": ["other", "banked"],
  "bank": {"inputs": ["T2", "rpm"], "tau_s": [0, 0.03], "powers": {"rpm": [1, 2]}, "weights": [[0, 1, 0, 0, 0, 0],
   [3, 2, 0.5, 0.25, 0.01, 0.02]], "bias": [0, 5],
   "input_min": [20, -100], "input_max": [30, 100], "margin": [2, 10], "fade": [4, 200]}})";

TEST(bank, beyond_its_training_range_an_input_is_held_and_the_outputs_fade) {
    const auto after = [](double t2, double rpm) {
        bank_rig rig(trained);
        rig.t2 = t2;
        rig.rpm = rpm;
        for (int i = 0; i < 100; ++i) rig.go();
        return rig;
    };
    const auto model = [](double t2, double rpm) {
        return 5 + 5 * t2 + 0.75 * rpm + 0.03 * rpm * rpm;
    };
    bank_rig inside = after(25, 50);
    EXPECT_NEAR(inside.term("banked"), model(25, 50), 1e-4);
    EXPECT_EQ(inside.box->counters.models_extrapolated, 0u);
    bank_rig beyond = after(31, -105);
    EXPECT_NEAR(beyond.term("banked"), model(31, -105), 1e-4);
    EXPECT_EQ(beyond.box->counters.models_extrapolated, 100u);
    EXPECT_EQ(beyond.box->counters.models_weakened, 0u);
    bank_rig weak = after(33, 160);  // 1 of 4 and 50 of 200 beyond the margins
    EXPECT_NEAR(weak.term("banked"), 0.75 * model(32, 110), 1e-3);
    EXPECT_NEAR(weak.term("other"), 0.75 * 32, 1e-4) << "the lag has the held input";
    EXPECT_EQ(weak.box->counters.models_weakened, 100u);
    EXPECT_EQ(after(38, 0).term("banked"), 0);
}

TEST(bank, slopes_are_those_of_the_columns_without_a_lag) {
    const auto by_differences = [](bank_rig &rig, double &input, const char *name) {
        input += 0.5;
        rig.go();
        const double up = rig.term(name);
        input -= 1;
        rig.go();
        const double down = rig.term(name);
        input += 0.5;
        rig.go();
        return up - down;
    };
    bank_rig rig(R"({"name": "w", "type": "linear", "outputs": ["other", "banked"],
        "bank": {"inputs": ["T2", "rpm"], "tau_s": [0, 80000], "powers": {"rpm": [1, 2, 4], "T2": [3]},
        "weights": [[1e-3, 5, 0, 0, 0, 0, 0, 0], [-2e-3, 9, 0.5, 9, 0.01, 9, 1e-5, 0.009]]}})");
    rig.rpm = 40;
    rig.go();
    EXPECT_NEAR(rig.slope("banked", AT_RPM), by_differences(rig, rig.rpm, "banked"), 2e-3);
    EXPECT_NEAR(rig.slope("banked", AT_T2), by_differences(rig, rig.t2, "banked"), 2e-3);
    EXPECT_NEAR(rig.slope("other", AT_T2), 3e-3 * 625, 1e-5);
    EXPECT_EQ(rig.slope("banked", AT_T1), 0) << "no input";
    bank_rig lagged(
        R"({"name": "banked", "type": "linear", "bank": {"inputs": ["T2"], "tau_s": [60], "weights": [[1]]}})");
    lagged.go();
    EXPECT_EQ(lagged.slope("banked", AT_T2), 0) << "a lag does not follow at once";
}

TEST(bank, slopes_beyond_the_training_range) {
    bank_rig rig(trained);
    rig.rpm = 50;
    rig.go();
    EXPECT_NEAR(rig.slope("banked", AT_RPM), 0.5 + 0.02 * 50, 1e-5);
    rig.t2 = 33;  // weight 3/4, which falls by a fourth of the model for each K
    rig.go();
    const double model = rig.term("banked") / 0.75;
    EXPECT_NEAR(rig.slope("banked", AT_RPM), 0.75 * 1.5, 1e-5);
    EXPECT_NEAR(rig.slope("banked", AT_T2), -model / 4, 1e-3) << "the input itself is held";
    rig.t2 = 37;
    rig.go();
    EXPECT_EQ(rig.slope("banked", AT_T2), 0);
    EXPECT_EQ(rig.slope("banked", AT_RPM), 0);
}

}  // namespace
}  // namespace compbox
