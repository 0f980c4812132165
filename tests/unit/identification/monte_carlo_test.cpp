// SPDX-License-Identifier: MIT
// S2's comparison against the closed forms, which know nothing of runs.
#include "host-tools/identification/monte_carlo.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace compbox;
using namespace compbox::identification;

const points_mm triangle{{125, 300, 75}, {250, -300, 325}, {-250, -300, 75}};

// in : sigma of each line. Both methods show their closed form within 3 percent over 10000 runs.
void expect_closed_form(const monte_carlo_options &options) {
    const auto result = monte_carlo(triangle, options);
    ASSERT_TRUE(result.traditional);
    for (const auto *method : {&result.improved, &*result.traditional}) {
        for (std::size_t k = 0; k < 6; ++k) {
            EXPECT_NEAR(method->sigma[k] / method->closed_form[k], 1.0, 0.03);
            EXPECT_NEAR(method->mean[k], options.preset[k], 0.05 * method->closed_form[k]);
            EXPECT_LE(result.improved.closed_form[k],
                      result.traditional->closed_form[k] * (1.0 + 1e-9));
        }
    }
    EXPECT_EQ(result.improved.closed_form, closed_form_sigma(triangle, options.sigma_um));
}

TEST(monte_carlo, both_methods_show_their_closed_form_within_3_percent_over_10000_runs) {
    for (int axis = 0; axis < 3; ++axis) {
        monte_carlo_options options;
        options.axis = axis;
        options.preset = {12, -7, 5, 20, -15, 9};
        options.sigma_um = line_sigma::Constant(9, 0.7);
        options.runs = 10000;
        expect_closed_form(options);
        options.sigma_um = sigma_of_lines(0.2, 1.5, axis, 3);
        expect_closed_form(options);
    }
}

TEST(monte_carlo, a_seed_is_one_series_of_runs) {
    monte_carlo_options options;
    const auto first = monte_carlo(triangle, options), again = monte_carlo(triangle, options);
    EXPECT_EQ(first.improved.mean, again.improved.mean);
    EXPECT_EQ(first.traditional->sigma, again.traditional->sigma);
    options.seed = 2;
    EXPECT_NE(first.improved.mean, monte_carlo(triangle, options).improved.mean);
}

TEST(monte_carlo, a_singular_sequence_has_no_traditional_figures) {
    const points_mm singular{{0, 0, 0}, {1, 0, 0}, {2, 5, 0}};  // eps y unseen by d1x, d2x, d3x
    const auto result = monte_carlo(singular, {});
    EXPECT_FALSE(result.traditional);
    EXPECT_TRUE(std::isfinite(result.improved.sigma[0]));
}

}  // namespace
