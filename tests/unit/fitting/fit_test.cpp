// SPDX-License-Identifier: MIT
// compbox fit: the readings, the mathematics behind the curve, and every refusal.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fitting_fixture.h"

namespace compbox::fitting {
namespace {

// A measurement made of a function, noise from a fixed seed, `runs` journeys over n targets.
template <typename Function>
measurement measure(const Function &truth, int n, double length, double noise, int runs,
                    unsigned seed = 1) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    measurement data;
    data.file = "test.csv";
    for (int r = 0; r < runs; ++r) {
        measured_run run;
        run.name = std::to_string(r + 1);
        for (int i = 0; i < n; ++i) {
            run.position.push_back(length * i / (n - 1));
            run.error.push_back(truth(run.position.back()) + noise * normal(engine));
            run.sigma.push_back(1.0);
        }
        data.runs.push_back(run);
    }
    average_runs(data);
    return data;
}

TEST(Fit, StaysNearTheTruthBetweenThePoints) {
    const measurement data = measure(wave, 61, 4000.0, 0.4, 3);
    const fit_result result = fit_curve(data, {});
    double squares = 0.0;
    for (int i = 0; i <= 1000; ++i) {
        const double off = result.curve.value(4.0 * i) - wave(4.0 * i);
        squares += off * off / 1001.0;
    }
    EXPECT_LT(std::sqrt(squares), 0.4 / std::sqrt(3.0));
    EXPECT_NEAR(result.noise, 0.4, 0.06);
}

}  // namespace
}  // namespace compbox::fitting
