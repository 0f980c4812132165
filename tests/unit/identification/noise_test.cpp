// SPDX-License-Identifier: MIT
// Sigma of the lines by their runs.
#include "host-tools/identification/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using namespace compbox::identification;

TEST(noise, lines_of_one_direction_are_pooled_and_the_mean_counts) {
    std::vector<line_repeats> lines(9, {1.0, 40, 0.2});
    lines[0].variance_um2 = 0.05, lines[3].variance_um2 = 0.04, lines[6].variance_um2 = 0.03;
    lines[8].mean_share = 0.5;
    const line_sigma sigma = sigma_by_runs(lines);
    ASSERT_EQ(sigma.size(), 9);
    for (const int line : {0, 3, 6}) EXPECT_NEAR(sigma(line), std::sqrt(0.04 * 0.2), 1e-12);
    for (const int line : {1, 2, 4, 5, 7}) EXPECT_NEAR(sigma(line), std::sqrt(0.2), 1e-12);
    EXPECT_NEAR(sigma(8), std::sqrt(0.5), 1e-12);
}

TEST(noise, lines_that_differ_beyond_chance_keep_their_own) {
    std::vector<line_repeats> lines(9, {1.0, 40, 1.0});
    lines[4].variance_um2 = 9.0;
    const line_sigma sigma = sigma_by_runs(lines);
    EXPECT_NEAR(sigma(4), 3.0, 1e-12);
    EXPECT_NEAR(sigma(1), 1.0, 1e-12);
    lines[4].freedom = 2;  // may be chance
    EXPECT_NEAR(sigma_by_runs(lines)(4), std::sqrt((40 + 40 + 2 * 9.0) / 82.0), 1e-12);
}

TEST(noise, a_line_of_one_run_has_the_sigma_of_its_direction) {
    std::vector<line_repeats> lines(9, {4.0, 40, 0.2});
    lines[7] = {0.0, 0, 1.0};
    EXPECT_NEAR(sigma_by_runs(lines)(7), 2.0, 1e-12);
    lines[1] = lines[4] = lines[7];
    EXPECT_EQ(sigma_by_runs(lines).size(), 0);  // y has no repeats
}

TEST(noise, readings_that_repeat_to_the_last_digit_are_not_without_noise) {
    std::vector<line_repeats> lines(9, {0.0, 40, 1.0});
    EXPECT_EQ(sigma_by_runs(lines).size(), 0);
    lines[2].variance_um2 = lines[5].variance_um2 = lines[8].variance_um2 = 4.0;
    const line_sigma sigma = sigma_by_runs(lines);
    EXPECT_NEAR(sigma(2), 2.0, 1e-12);
    EXPECT_NEAR(sigma(0), 0.02, 1e-12);
}

// Runs with slopes of their own: the readings about them are the noise, the slopes are apart.
TEST(noise, slopes_of_the_runs_are_apart_from_the_noise_of_readings) {
    std::mt19937 generator(4);
    std::normal_distribution<double> normal;
    std::vector<double> at_mm;
    for (int i = 0; i < 21; ++i) at_mm.push_back(100.0 * i);
    for (const double slope : {0.0, 0.005}) {
        std::vector<line_repeats> lines;
        for (int line = 0; line < 9; ++line) {
            std::vector<line_run> runs(6);
            for (std::size_t r = 0; r < runs.size(); ++r) {
                runs[r].backward = r % 2 == 1;
                const double own = slope * normal(generator), offset = 9.0 * normal(generator);
                for (const double x : at_mm) {
                    const double lost = runs[r].backward ? 7.0 : 0.0;
                    const double curve = std::sin(x) + lost;
                    runs[r].error_um.push_back(curve + offset + own * x + 0.5 * normal(generator));
                }
            }
            lines.push_back(repeats_of(at_mm, runs));
            EXPECT_EQ(lines.back().freedom, 4 * 19);
            EXPECT_EQ(lines.back().slope_freedom, 4);
            EXPECT_NEAR(std::sqrt(lines.back().variance_um2), 0.5, 0.15);
        }
        // Squares of t: 100^2 x 770. A slope of 0.005 is 27.7 times that of readings with 0.5.
        const double expected = slope > 0.0 ? std::hypot(1.0, 0.005 * std::sqrt(7.7e6) / 0.5) : 1.0;
        for (const double factor : slope_factors(lines)) {
            EXPECT_NEAR(factor, expected, 0.3 * expected - 0.3);
        }
    }
}

TEST(noise, one_run_or_exact_runs_have_no_slope_factor) {
    const std::vector<double> at_mm{0, 1, 2, 3};
    const line_repeats one = repeats_of(at_mm, {{{1, 2, 1, 5}}});
    EXPECT_EQ(one.freedom, 0);
    const line_repeats same = repeats_of(at_mm, {{{1, 2, 1, 5}}, {{1, 2, 1, 5}}});
    EXPECT_EQ(same.freedom, 2);
    EXPECT_EQ(same.variance_um2, 0.0);
    EXPECT_EQ(same.slope_freedom, 0);
    EXPECT_EQ(slope_factors(std::vector<line_repeats>(9, same)), Eigen::VectorXd::Ones(9));
    // A direction whose runs have slopes, beside two whose runs have none.
    std::vector<line_repeats> lines(9, {1.0, 76, 1.0, 1.0, 4});
    lines[0].slope_ratio = lines[3].slope_ratio = lines[6].slope_ratio = 100.0;
    const Eigen::VectorXd factors = slope_factors(lines);
    EXPECT_DOUBLE_EQ(factors(3), 10.0);
    EXPECT_DOUBLE_EQ(factors(4), 1.0);
}

// As often as the normal distribution says.
TEST(noise, largest_chance_is_rare) {
    std::mt19937 generator(3);
    std::normal_distribution<double> normal;
    for (const int freedom : {2, 9, 57}) {
        int more = 0;
        for (int round = 0; round < 5000; ++round) {
            double sum = 0.0;
            for (int i = 0; i < freedom; ++i) sum += std::pow(normal(generator), 2.0);
            more += sum > largest_chance(freedom, 2.326);
        }
        EXPECT_NEAR(more / 5000.0, 0.01, 0.005) << freedom;
    }
}

}  // namespace
