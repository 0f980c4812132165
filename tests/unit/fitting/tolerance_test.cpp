// SPDX-License-Identifier: MIT
// compbox fit --tolerance-um: every residual inside, as close to the best estimate as that permits,
// no swings between the readings; with --fewest-knots few knots.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host-tools/formats/json.h"
#include "tests/support/fitting_fixture.h"

namespace compbox::fitting {
namespace {

double step(double x) {
    return x > 2013.0 ? 50.0 : 0.0;
}
double kink(double x) {
    return std::abs(x - 1777.0) * 0.03;
}
double spike(double x) {
    return 30.0 * std::exp(-std::pow((x - 1500.0) / 40.0, 2));
}

measurement readings_of(double (*truth)(double), int n, double noise) {
    std::mt19937 engine(3);
    std::normal_distribution<double> normal(0.0, 1.0);
    measurement data;
    data.file = "test.csv";
    data.runs.resize(2);
    for (auto &run : data.runs) {
        for (int i = 0; i < n; ++i) {
            run.position.push_back(4000.0 * i / (n - 1));
            run.error.push_back(truth(run.position.back()) + noise * normal(engine));
            run.sigma.push_back(1.0);
        }
    }
    average_runs(data);
    return data;
}

fit_result fit_within(const measurement &data, double tolerance, int degree = 0) {
    fit_options options;
    options.tolerance_um = tolerance;
    options.degree = degree;
    return fit_curve(data, options);
}

fit_result with_few_knots(const measurement &data, double tolerance) {
    fit_options options;
    options.tolerance_um = tolerance;
    options.fewest_knots = true;
    return fit_curve(data, options);
}

// Largest error of the curve against the truth, on a dense grid.
double largest_error(const fit_result &fit, double (*truth)(double)) {
    double most = 0.0;
    for (double x = 0.0; x <= 4000.0; x += 2.0) {
        most = std::max(most, std::abs(fit.curve.value(x) - truth(x)));
    }
    return most;
}

// How far the curve leaves the range of the two readings beside it, at most.
double overshoot(const fit_result &fit) {
    const auto &x = fit.data.position, &y = fit.data.mean;
    double most = 0.0;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
        for (int k = 1; k < 20; ++k) {
            const double value = fit.curve.value(x[i] + (x[i + 1] - x[i]) * k / 20.0);
            most = std::max(
                {most, value - std::max(y[i], y[i + 1]), std::min(y[i], y[i + 1]) - value});
        }
    }
    return most;
}

TEST(FitTolerance, IsKeptWhateverTheNoise) {
    for (const auto truth : {wave, step, kink, spike}) {
        for (const double noise : {0.0, 0.4}) {
            for (const int n : {9, 21, 61}) {
                const std::size_t free =
                    fit_within(readings_of(truth, n, noise), 0.0).curve.coefficient_count();
                for (const double tolerance : {0.0005, 0.05, 0.3, 1.0, 5.0, 30.0}) {
                    const fit_result fit = fit_within(readings_of(truth, n, noise), tolerance);
                    EXPECT_TRUE(fit.converged);
                    EXPECT_LE(std::abs(fit.summary.worst), tolerance);
                    EXPECT_LE(fit.curve.coefficient_count(),
                              std::max(free, fit.data.position.size()));
                    EXPECT_LT(overshoot(fit), 8.0 + tolerance) << n << " " << tolerance;
                }
            }
        }
    }
}

TEST(FitTolerance, IsNotSpentOnFewerKnots) {
    for (const double noise : {0.1, 0.4}) {
        const measurement data = readings_of(wave, 61, noise);
        const fit_result free = fit_within(data, 0.0);
        const double best = largest_error(free, wave);
        for (const double tolerance : {2.0, 4.5, 9.0}) {
            const fit_result fit = fit_within(data, tolerance);
            EXPECT_EQ(largest_error(fit, wave), best) << tolerance;
            EXPECT_EQ(fit.curve.coefficient_count(), free.curve.coefficient_count());
        }
        const fit_result few = with_few_knots(data, 4.5);
        EXPECT_GT(largest_error(few, wave), 5.0 * best);
        EXPECT_GT(estimate_distance(few).rms, 5.0 * estimate_distance(free).rms);
    }
}

TEST(FitTolerance, TakesTheCurveInsideThatIsClosestToTheEstimate) {
    const measurement data = readings_of(wave, 61, 0.4);
    double before = 0.0;
    for (const double tolerance : {0.6, 0.4, 0.2, 0.1, 0.05}) {
        const fit_result fit = fit_within(data, tolerance), few = with_few_knots(data, tolerance);
        const curve_distance own = estimate_distance(fit), other = estimate_distance(few);
        EXPECT_LE(own.rms, other.rms) << tolerance;
        EXPECT_GE(own.rms, 0.9 * before) << tolerance;
        before = own.rms;
    }
}

TEST(FitTolerance, StatesTheDistanceFromTheEstimate) {
    const fit_result fit = with_few_knots(readings_of(wave, 61, 0.4), 4.5);
    double squares = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < fit.best.x.size(); ++i) {
        const double off = std::abs(fit.best.mean[i] - fit.curve.value(fit.best.x[i]));
        squares += off * off / static_cast<double>(fit.best.x.size());
        largest = std::max(largest, off);
    }
    const json stated = fragment_of(fit)["provenance"]["EXX"]["from_best_estimate"];
    EXPECT_NEAR(stated["rms"].get<double>(), std::sqrt(squares), 1e-4 * largest);
    EXPECT_NEAR(stated["largest"].get<double>(), largest, 1e-4 * largest);
    EXPECT_NE(report_of(fit).find("from best estimate"), std::string::npos);
}

TEST(FitTolerance, CostsNoMoreKnotsThanItNeedsWhereFewAreWanted) {
    const measurement data = readings_of(wave, 61, 0.0);
    std::size_t before = 1000;
    for (const double tolerance : {0.01, 0.1, 1.0, 5.0, 60.0}) {
        const fit_result fit = with_few_knots(data, tolerance);
        EXPECT_LE(std::abs(fit.summary.worst), tolerance);
        EXPECT_LE(fit.curve.coefficient_count(), before);
        before = fit.curve.coefficient_count();
    }
    EXPECT_EQ(before, 4u);
    EXPECT_LE(with_few_knots(data, 1.0).curve.coefficient_count(), 12u);
    EXPECT_EQ(with_few_knots(readings_of([](double x) { return x * x * 1e-6; }, 30, 0.0), 0.01)
                  .curve.coefficient_count(),
              4u);
}

TEST(FitTolerance, BelowTheNoiseIsKeptWithAWarning) {
    const measurement data = readings_of(wave, 61, 0.4);
    const fit_result tight = fit_within(data, 0.05);
    EXPECT_TRUE(tight.converged);
    EXPECT_TRUE(warns(tight, "may follow noise"));
    const fit_result wide = fit_within(data, 2.0);
    EXPECT_TRUE(wide.converged);
    EXPECT_TRUE(wide.warnings.empty());
}

TEST(FitTolerance, EveryDegreeKeepsIt) {
    for (int degree = 1; degree <= 5; ++degree) {
        const fit_result fit = fit_within(readings_of(wave, 41, 0.4), 0.02, degree);
        EXPECT_TRUE(fit.converged) << degree;
        EXPECT_LE(std::abs(fit.summary.worst), 0.02) << degree;
    }
}

TEST(FitTolerance, SaysWhenNoCurveReachesIt) {
    // More positions than the box has coefficients, and readings that no fewer can follow.
    const fit_result fit = fit_within(readings_of(wave, 1200, 5.0), 0.01, 1);
    EXPECT_FALSE(fit.converged);
    EXPECT_TRUE(warns(fit, "did not converge")) << fit.warnings.front();
    EXPECT_FALSE(fragment_of(fit)["provenance"]["EXX"]["converged"].get<bool>());
}

TEST(FitTolerance, BelowWhatFloat32ResolvesIsNotReached) {
    const fit_result fit = fit_within(readings_of(wave, 21, 0.4), 1e-9);
    EXPECT_FALSE(fit.converged);
    EXPECT_LT(std::abs(fit.summary.worst), 1e-4);
}

TEST(FitTolerance, JudgesBaselinesToo) {
    fit_options options;
    options.method = fit_method::polynomial;
    options.tolerance_um = 1.0;
    const fit_result fit = fit_curve(readings_of(step, 41, 0.1), options);
    EXPECT_FALSE(fit.converged);
    EXPECT_TRUE(warns(fit, "this polynomial leaves a residual"));
    options.tolerance_um = 50.0;
    EXPECT_TRUE(fit_curve(readings_of(step, 41, 0.1), options).converged);
}

}  // namespace
}  // namespace compbox::fitting
