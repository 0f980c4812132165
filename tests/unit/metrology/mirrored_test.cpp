// SPDX-License-Identifier: MIT
// Runs and errors whose sign is wrong, on exact curves.
#include "host-tools/metrology/mirrored.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace compbox;
using namespace compbox::metrology;
using indices = std::vector<std::size_t>;

const std::vector<double> targets{0, 100, 200, 300, 400, 500};

// A bow of 10, a slope, and an offset that each set-up has by itself.
directed_run bow(int direction, double factor, double offset = 0.0) {
    directed_run run{direction, {}};
    for (const double x : targets) {
        run.deviation.push_back(offset +
                                factor * (0.02 * x + 10.0 * std::sin(3.14159 * x / 500.0)));
    }
    return run;
}

directed_run line(double slope) {
    directed_run run{1, {}};
    for (const double x : targets) run.deviation.push_back(slope * x);
    return run;
}

TEST(mirrored, a_turned_run_is_found_whatever_its_offset) {
    EXPECT_EQ(mirrored_runs(targets, {bow(1, 1), bow(1, 1.02), bow(1, -0.98, 30)}), indices{2});
    EXPECT_EQ(mirrored_runs(targets, {bow(1, -1), bow(-1, 1, 3), bow(1, 1), bow(-1, 1, 3)}),
              indices{0});
    EXPECT_EQ(mirrored_runs(targets, {bow(0, 1), bow(0, -1), bow(0, 1), bow(0, 1), bow(0, -1)}),
              (indices{1, 4}));
}

TEST(mirrored, two_even_runs_of_a_direction_are_judged_by_the_other_direction) {
    EXPECT_EQ(mirrored_runs(targets, {bow(1, -1), bow(1, 1), bow(-1, 1)}), indices{0});
}

TEST(mirrored, lost_motion_that_bends_is_no_turned_run) {
    EXPECT_EQ(mirrored_runs(targets, {bow(1, 1), bow(-1, -1), bow(1, 1), bow(-1, -1)}), indices{});
    EXPECT_EQ(mirrored_runs(targets, {bow(1, 1), bow(1, 1), bow(-1, -1)}), indices{});
}

TEST(mirrored, another_size_is_no_mirror_image) {
    EXPECT_EQ(mirrored_runs(targets, {bow(1, 1), bow(1, 1), bow(1, 1), bow(1, -0.2)}), indices{});
}

TEST(mirrored, two_runs_or_four_targets_decide_nothing) {
    EXPECT_EQ(mirrored_runs(targets, {bow(1, 1), bow(1, -1)}), indices{});
    EXPECT_EQ(
        mirrored_runs({0, 1, 2, 3}, {{1, {0, 5, 5, 0}}, {1, {0, 5, 5, 0}}, {1, {0, -5, -5, 0}}}),
        indices{});
}

TEST(mirrored, lines_alone_take_four_runs_that_agree) {
    EXPECT_EQ(mirrored_runs(targets, {line(0.02), line(0.02), line(-0.02)}), indices{});
    EXPECT_EQ(mirrored_runs(targets, {line(0.02), line(0.0202), line(-0.02), line(0.0199)}),
              indices{2});
    EXPECT_EQ(mirrored_runs(targets, {line(0.02), line(0.03), line(-0.02), line(0.01)}), indices{});
}

TEST(mirrored, zeros_have_no_sign) {
    const directed_run none{1, {0, 0, 0, 0, 0, 0}};
    EXPECT_EQ(mirrored_runs(targets, {none, none, none, none}), indices{});
    EXPECT_FALSE(doubled_error(targets, none.deviation, none.deviation, 0.0));
}

TEST(doubled, the_factor_is_that_of_the_shape_without_offset) {
    const auto factor = doubled_error(targets, bow(1, 1).deviation, bow(1, 1.9, 40).deviation, 0.1);
    ASSERT_TRUE(factor);
    EXPECT_NEAR(*factor, 1.9, 1e-12);
}

TEST(doubled, a_good_a_partial_and_an_overdone_compensation_are_not_named) {
    for (const double left : {0.0, 0.05, 0.5, 1.0, -0.3, -1.0, -2.0, 1.4, 3.0}) {
        EXPECT_FALSE(doubled_error(targets, bow(1, 1).deviation, bow(1, left).deviation, 0.1))
            << left;
    }
}

TEST(doubled, an_error_as_small_as_the_noise_is_not_named) {
    EXPECT_FALSE(doubled_error(targets, bow(1, 0.01).deviation, bow(1, 0.02).deviation, 0.1));
}

}  // namespace
