// SPDX-License-Identifier: MIT
// Simulated probes: the box's filter over made errors whose drift is known.
#include "host-tools/adaptation/probing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace compbox::adaptation {
namespace {

constexpr double row_s = 300.0;

struct made_errors {
    double drift_um_per_sqrt_h = 4.0, noise_um = 0.8, gain = 0.0;
    std::size_t rows = 20000;
};

// A model that swings by 30 um in a day, an error that is (1 + gain) times that, a random walk, and
// the probe's noise.
error_series walk_of(const made_errors &made, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    error_series series;
    double walk_um = 0.0;
    for (std::size_t r = 0; r < made.rows; ++r) {
        const double time_s = static_cast<double>(r) * row_s;
        series.time_s.push_back(time_s);
        series.model_um.push_back(30.0 * std::sin(time_s * 2.0 * 3.14159 / 86400.0));
        walk_um += made.drift_um_per_sqrt_h * std::sqrt(row_s / 3600.0) * normal(engine);
        series.error_um.push_back((1.0 + made.gain) * series.model_um.back() + walk_um +
                                  made.noise_um * normal(engine));
        series.begins.push_back(r == 0);
        series.run.push_back(r / 288);
    }
    return series;
}

double rms_of(const std::vector<double> &values) {
    double sum = 0.0;
    for (const double value : values) sum += value * value;
    return std::sqrt(sum / static_cast<double>(values.size()));
}

cb_adapt_settings settings_for(double drift, double sigma) {
    return {1e4F, 0.5F, 1e4F, static_cast<float>(drift), 1e-3F, static_cast<float>(sigma), 60.0F};
}

double share_within_two(const probed_course &course) {
    double within = 0.0;
    for (std::size_t i = 0; i < course.innovation_um.size(); ++i) {
        within += std::fabs(course.innovation_um[i]) <= 2.0 * course.expected_um[i];
    }
    return within / static_cast<double>(course.innovation_um.size());
}

TEST(probing, finds_the_drift_and_the_noise_that_made_the_errors) {
    for (const double drift : {1.5, 4.0, 9.0}) {
        for (const double noise : {0.6, 2.0}) {
            const error_series series = walk_of({drift, noise, 0.0}, 7);
            const drift_rates rates = estimate_drift(series, {1800.0, 3600.0}, 0.0);
            EXPECT_NEAR(rates.drift_um_per_sqrt_h, drift, 0.12 * drift);
            EXPECT_NEAR(rates.sigma_um, noise, 0.25 * noise + 0.1 * drift);
            EXPECT_LT(rates.gain_drift_per_sqrt_h, 0.02);
            const drift_rates given = estimate_drift(series, {1800.0, 3600.0}, noise);
            EXPECT_EQ(given.sigma_um, noise);
            EXPECT_NEAR(given.drift_um_per_sqrt_h, drift, 0.12 * drift);
        }
    }
}

TEST(probing, two_sigma_hold_for_random_walks) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const error_series series = walk_of({}, seed);
        const drift_rates rates = estimate_drift(series, {1800.0, 3600.0}, 0.0);
        for (const double interval_s : {1800.0, 3600.0}) {
            const probed_course course = simulate_probes(
                series, settings_for(rates.drift_um_per_sqrt_h, rates.sigma_um), {interval_s});
            const double share = share_within_two(course);
            EXPECT_GT(share, 0.92) << seed;
            EXPECT_LT(share, 0.98) << seed;
        }
    }
}

TEST(probing, leaves_the_root_of_half_an_interval_of_drift) {
    // Between probes a walk of 4 um / sqrt(h) leaves a mean square of 16 um2 * 1 h / 2 and the
    // noise of the error itself; the probe's own error comes on top of it.
    const error_series series = walk_of({}, 3);
    const double left_um =
        rms_of(simulate_probes(series, settings_for(4.0, 0.8), {3600.0}).left_um);
    const double least_um = std::sqrt(8.67 + 0.64);
    EXPECT_GT(left_um, least_um);
    EXPECT_LT(left_um, 1.1 * least_um);
    EXPECT_LT(left_um, 1.05 * rms_of(rezero(series, {3600.0})));
}

TEST(probing, learns_a_gain_that_a_probe_alone_cannot) {
    const error_series series = walk_of({1.0, 0.5, 0.3}, 5);
    const double adapted_um =
        rms_of(simulate_probes(series, settings_for(1.0, 0.5), {3600.0}).left_um);
    EXPECT_LT(adapted_um, 1.2);
    EXPECT_GT(rms_of(rezero(series, {3600.0})), 4.0);
}

TEST(probing, a_term_never_leaves_its_bounds) {
    error_series series = walk_of({20.0, 1.0, 0.4}, 9);
    cb_adapt_settings tight = settings_for(20.0, 1.0);
    tight.bias_max_um = 6.0F, tight.gain_max = 0.1F;
    const probed_course course = simulate_probes(series, tight, {1800.0, 0.05, 100.0, true});
    for (std::size_t r = 0; r < series.rows(); ++r) {
        const double term_um = series.error_um[r] - course.left_um[r];
        const double off_um = std::fabs(term_um - series.model_um[r]);
        ASSERT_LE(off_um, 6.0 + 0.1 * std::fabs(series.model_um[r]) + 1e-4);
    }
    EXPECT_EQ(course.most_bias_um, 6.0);
}

TEST(probing, a_tenth_more_with_one_of_twenty_probes_wrong) {
    const error_series series = walk_of({}, 11);
    cb_adapt_settings settings = settings_for(4.0, 0.8);
    settings.step_max_um = 15.0F;  // two wrong ones in a row that agree move it no further
    const double right_um = rms_of(simulate_probes(series, settings, {3600.0}).left_um);
    EXPECT_LT(rms_of(simulate_probes(series, settings, {3600.0, 0.05}).left_um), 1.1 * right_um);
    const probed_course again = simulate_probes(series, settings, {3600.0, 0.05, 100.0, true});
    EXPECT_LT(rms_of(again.left_um), 1.05 * right_um);
    EXPECT_GT(again.asked, 40U);
    EXPECT_GT(rms_of(rezero(series, {3600.0, 0.05})), 3.0 * right_um);
}

TEST(probing, starts_anew_where_the_box_does) {
    error_series series = walk_of({0.1, 0.5, 0.0, 600}, 1);
    for (double &error : series.error_um) error += 10.0;
    series.begins[300] = true;
    const probed_course course = simulate_probes(series, settings_for(2.0, 0.5), {3600.0});
    EXPECT_LT(std::fabs(course.left_um[299]), 4.0);
    EXPECT_GT(std::fabs(course.left_um[300]), 6.0);
    EXPECT_GT(std::fabs(rezero(series, {3600.0})[300]), 6.0);
}

TEST(probing, quantiles) {
    EXPECT_EQ(quantile({}, 0.5), 0.0);
    EXPECT_EQ(quantile({3.0, 1.0, 2.0}, 0.5), 2.0);
    EXPECT_EQ(quantile({3.0, 1.0, 2.0}, 1.0), 3.0);
}

}  // namespace
}  // namespace compbox::adaptation
