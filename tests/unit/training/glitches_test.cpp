// SPDX-License-Identifier: MIT
// Glitches of a logger: found in a smooth column, and only there.
#include "host-tools/training/glitches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace compbox::training {
namespace {

// Two warm-ups of 100 rows with the noise of a sensor.
const std::vector<std::size_t> starts = {0, 100};
Eigen::VectorXd two_warm_ups(double noise = 0.02) {
    std::mt19937 engine(3);
    std::normal_distribution<double> normal;
    return Eigen::VectorXd::NullaryExpr(200, [&](Eigen::Index row) {
        return 20.0 + 8.0 * (1.0 - std::exp(-static_cast<double>(row % 100) / 30.0)) +
               noise * normal(engine);
    });
}

TEST(Glitches, a_smooth_column_has_none) {
    for (const double noise : {0.0, 0.02, 0.3}) {
        EXPECT_TRUE(find_glitches(two_warm_ups(noise), starts).empty()) << noise;
    }
}

TEST(Glitches, single_readings_and_short_stretches_are_found_and_bridged) {
    const Eigen::VectorXd right = two_warm_ups();
    for (const double size : {3.0, -20.0, 1e4}) {
        Eigen::VectorXd wrong = right;
        wrong[40] += size, wrong.segment(150, 4).array() += size;
        const auto found = find_glitches(wrong, starts);
        ASSERT_EQ(found.size(), 2u) << size;
        EXPECT_EQ(found[0].first, 40u);
        EXPECT_EQ(found[0].last, 40u);
        EXPECT_EQ(found[0].reached, wrong[40]);
        EXPECT_EQ(found[0].before, right[39]);
        EXPECT_EQ(found[0].after, right[41]);
        EXPECT_EQ(found[1].first, 150u);
        EXPECT_EQ(found[1].last, 153u);
        bridge(wrong, found);
        EXPECT_LT((wrong - right).cwiseAbs().maxCoeff(), 0.2) << size;
    }
}

TEST(Glitches, the_first_and_last_readings_of_a_run_are_found) {
    for (const std::size_t row : {0u, 99u, 100u, 199u}) {
        Eigen::VectorXd wrong = two_warm_ups();
        wrong[static_cast<Eigen::Index>(row)] = 85.0;
        const auto found = find_glitches(wrong, starts);
        ASSERT_EQ(found.size(), 1u) << row;
        EXPECT_EQ(found[0].first, row);
        EXPECT_EQ(found[0].last, row);
        bridge(wrong, found);
        EXPECT_LT(wrong.maxCoeff(), 29.0);
    }
}

TEST(Glitches, a_speed_in_steps_and_a_position_have_none) {
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> uniform(0.0, 400.0);
    const auto speed = [](Eigen::Index row) {
        return row % 30 < 3 ? 4000.0 : row < 120 ? 1500.0 : 0.0;  // with short pauses
    };
    EXPECT_TRUE(find_glitches(Eigen::VectorXd::NullaryExpr(200, speed), starts).empty());
    const auto one_burst = [](Eigen::Index row) { return row == 77 ? 3000.0 : 0.0; };
    EXPECT_TRUE(find_glitches(Eigen::VectorXd::NullaryExpr(200, one_burst), starts).empty());
    const auto position = [&](Eigen::Index) { return uniform(engine); };
    EXPECT_TRUE(find_glitches(Eigen::VectorXd::NullaryExpr(200, position), starts).empty());
}

TEST(Glitches, a_step_that_remains_is_none) {
    Eigen::VectorXd moved = two_warm_ups();
    moved.tail(60).array() += 5.0;  // a probe that was touched
    EXPECT_TRUE(find_glitches(moved, starts).empty());
}

}  // namespace
}  // namespace compbox::training
