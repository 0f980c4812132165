// SPDX-License-Identifier: MIT
// ISO 230-1 and 230-2 figures against values worked out by hand and against brute force.
#include "host-tools/metrology/iso230_2.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host-tools/metrology/straightness.h"

namespace {

using namespace compbox;
using namespace compbox::metrology;

// Three targets, two runs each way. By hand:
//   forward  means 1, 3, 2    s = sqrt(2), 0, sqrt(2)
//   backward means 0, 2, 4    s = 0, sqrt(2), 0
//   B = 1, 1, -2
axis_readings small_axis() {
    axis_readings axis;
    axis.target_mm = {0, 100, 200};
    axis.forward = {{0, 2}, {3, 3}, {1, 3}};
    axis.backward = {{0, 0}, {1, 3}, {4, 4}};
    return axis;
}

TEST(iso230_2, figures_worked_out_by_hand) {
    const double s = std::sqrt(2.0);
    const auto figures = evaluate_positioning(small_axis());
    EXPECT_NEAR(*figures.B, 2.0, 1e-12);
    EXPECT_NEAR(*figures.B_mean, 0.0, 1e-12);
    EXPECT_NEAR(*figures.E, 4.0, 1e-12);                           // 0 … 4
    EXPECT_NEAR(*figures.M, 3.0 - 0.5, 1e-12);                     // 0.5, 2.5, 3
    EXPECT_NEAR(*figures.R, std::max(4 * s, 2 * s + 2.0), 1e-12);  // max over targets
    EXPECT_NEAR(*figures.A, (2 + 2 * s) - std::min(1 - 2 * s, 2 - 2 * s), 1e-12);
    EXPECT_NEAR(figures.forward->E, 2.0, 1e-12);
    EXPECT_NEAR(*figures.forward->R, 4 * s, 1e-12);
    EXPECT_NEAR(*figures.forward->A, (2 + 2 * s) - (1 - 2 * s), 1e-12);
    EXPECT_NEAR(*figures.backward->A, (2 + 2 * s) - (2 - 2 * s) > 4.0 ? 4 * s : 4.0, 1e-12);
    ASSERT_EQ(figures.remarks.size(), 2u);  // 2 runs, 3 targets
}

TEST(iso230_2, one_run_has_no_spread) {
    axis_readings axis;
    axis.target_mm = {0, 1, 2, 3, 4};
    axis.forward = {{1}, {2}, {3}, {2}, {1}};
    const auto figures = evaluate_positioning(axis);
    EXPECT_FALSE(figures.forward->A || figures.forward->R || figures.A || figures.B);
    EXPECT_DOUBLE_EQ(figures.forward->E, 2.0);
}

TEST(iso230_2, long_axis_keeps_to_its_own_rule) {
    axis_readings axis;
    for (int i = 0; i <= 12; ++i) {
        axis.target_mm.push_back(250.0 * i);
        axis.forward.push_back({1.0 * i, 1.0 * i + 1});
        axis.backward.push_back({1.0 * i - 1, 1.0 * i});
    }
    auto figures = evaluate_positioning(axis);
    EXPECT_TRUE(figures.long_axis);
    EXPECT_TRUE(figures.E && figures.M && figures.B);
    EXPECT_FALSE(figures.A || figures.R);
    EXPECT_TRUE(figures.remarks.empty());
    for (auto &target : axis.target_mm) target *= 1.2;  // every 300 mm
    EXPECT_EQ(evaluate_positioning(axis).remarks.size(), 1u);
    for (auto *values : {&axis.forward, &axis.backward}) {
        for (auto &target : *values) target.resize(5, target[0]);
    }
    figures = evaluate_positioning(axis);  // five runs: the full evaluation
    EXPECT_FALSE(figures.long_axis);
    EXPECT_TRUE(figures.A && figures.R);
}

TEST(iso230_2, uneven_readings_are_refused) {
    auto axis = small_axis();
    axis.backward[1].pop_back();
    EXPECT_THROW(evaluate_positioning(axis), std::logic_error);
}

TEST(straightness, lines_of_a_known_curve) {
    const std::vector<double> x{0, 1, 2, 3}, y{0, 1, 1, 0};
    EXPECT_DOUBLE_EQ(deviation_about(end_point_line(x, y), x, y), 1.0);
    EXPECT_DOUBLE_EQ(least_squares_line(x, y).at(1.5), 0.5);
    EXPECT_DOUBLE_EQ(deviation_about(minimum_zone_line(x, y), x, y), 1.0);
    const std::vector<double> tilted{0, 3, 3, 0};
    const auto zone = minimum_zone_line(x, tilted);
    EXPECT_DOUBLE_EQ(zone.offset, 1.5);
}

// No line of a fine fan of slopes has a narrower zone, and the line lies in the zone's middle.
TEST(straightness, minimum_zone_is_the_narrowest) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (int round = 0; round < 200; ++round) {
        std::vector<double> x, y;
        for (int i = 0; i < 3 + round % 30; ++i) {
            x.push_back(i + 0.5 * std::fabs(normal(random)) / 3.0);
            y.push_back(normal(random) * 10.0);
        }
        std::sort(x.begin(), x.end());
        const auto line = minimum_zone_line(x, y);
        const double width = deviation_about(line, x, y);
        double highest = -INFINITY, lowest = INFINITY;
        for (std::size_t i = 0; i < x.size(); ++i) {
            highest = std::max(highest, y[i] - line.at(x[i]));
            lowest = std::min(lowest, y[i] - line.at(x[i]));
        }
        EXPECT_NEAR(highest, -lowest, 1e-9);
        EXPECT_LE(width, deviation_about(end_point_line(x, y), x, y) + 1e-9);
        EXPECT_LE(width, deviation_about(least_squares_line(x, y), x, y) + 1e-9);
        for (int k = -2000; k <= 2000; ++k) {
            const straight_line other{0.0, line.slope + 0.01 * k};
            ASSERT_LE(width, deviation_about(other, x, y) + 1e-9);
        }
    }
}

}  // namespace
