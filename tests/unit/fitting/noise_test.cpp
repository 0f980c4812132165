// SPDX-License-Identifier: MIT
// compbox fit without a tolerance, judged against the truth on a dense grid. The generators and the
// interpolation that it is compared with use nothing of host-tools/fitting.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/support/fitting_fixture.h"

namespace compbox::fitting {
namespace {

using shape = std::function<double(double)>;

// Cubic interpolation without knots at the last but one points, by second derivatives.
class not_a_knot {
  public:
    not_a_knot(const std::vector<double> &x, const std::vector<double> &y) : x_(x), y_(y) {
        const auto n = static_cast<Eigen::Index>(x.size());
        Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
        Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
        for (Eigen::Index i = 1; i + 1 < n; ++i) {
            a(i, i - 1) = step(i - 1) / 6.0;
            a(i, i) = (step(i - 1) + step(i)) / 3.0;
            a(i, i + 1) = step(i) / 6.0;
            b(i) = slope(i) - slope(i - 1);
        }
        a(0, 0) = 1.0 / step(0);
        a(0, 2) = 1.0 / step(1);
        a(0, 1) = -a(0, 0) - a(0, 2);
        a(n - 1, n - 1) = 1.0 / step(n - 2);
        a(n - 1, n - 3) = 1.0 / step(n - 3);
        a(n - 1, n - 2) = -a(n - 1, n - 1) - a(n - 1, n - 3);
        bend_ = a.partialPivLu().solve(b);
    }
    double operator()(double x) const {
        const auto last = static_cast<Eigen::Index>(x_.size()) - 2;
        const auto above = std::upper_bound(x_.begin(), x_.end(), x) - x_.begin() - 1;
        const Eigen::Index i = std::clamp<Eigen::Index>(above, 0, last);
        const double h = step(i), a = (at(x_, i + 1) - x) / h, b = 1.0 - a;
        return a * at(y_, i) + b * at(y_, i + 1) +
               ((a * a * a - a) * bend_[i] + (b * b * b - b) * bend_[i + 1]) * h * h / 6.0;
    }

  private:
    static double at(const std::vector<double> &v, Eigen::Index i) {
        return v[static_cast<std::size_t>(i)];
    }
    double step(Eigen::Index i) const { return at(x_, i + 1) - at(x_, i); }
    double slope(Eigen::Index i) const { return (at(y_, i + 1) - at(y_, i)) / step(i); }
    std::vector<double> x_, y_;
    Eigen::VectorXd bend_;
};

struct scenario {
    shape truth;
    double length;
    std::vector<double> position;
};

// Cosines of random phase, the k-th of amplitude k^-exponent, scaled to 20 … 200 um; `waves` for
// each interval between two of the 25 … 80 positions, 1 being the shortest that they can show.
scenario cosines(std::mt19937_64 &engine, double exponent, double waves) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const double length = 1000.0 + 13000.0 * uniform(engine);
    const int n = 25 + static_cast<int>(55.99 * uniform(engine));
    const double amplitude = 20.0 * std::pow(10.0, uniform(engine));
    std::vector<double> phase;
    for (int k = 0; k < static_cast<int>(waves * n); ++k) phase.push_back(6.2832 * uniform(engine));
    const shape raw = [=](double x) {
        double sum = 0.0;
        for (std::size_t k = 0; k < phase.size(); ++k) {
            const double order = static_cast<double>(k) + 1.0;
            sum += std::pow(order, -exponent) * std::cos(M_PI * order * x / length + phase[k]);
        }
        return sum;
    };
    double low = raw(0.0), high = low;
    for (int i = 1; i <= 1000; ++i) {
        low = std::min(low, raw(length * i / 1000.0));
        high = std::max(high, raw(length * i / 1000.0));
    }
    const double scale = amplitude / (high - low);
    scenario made{[=](double x) { return scale * raw(x); }, length, {}};
    for (int i = 0; i < n; ++i) made.position.push_back(length * i / (n - 1));
    return made;
}

measurement measure(const scenario &from, std::mt19937_64 &engine, double noise, int runs) {
    std::normal_distribution<double> normal(0.0, noise);
    measurement data;
    data.file = "test.csv";
    for (int r = 0; r < runs; ++r) {
        measured_run run;
        for (const double x : from.position) {
            run.position.push_back(x);
            run.error.push_back(from.truth(x) + normal(engine));
            run.sigma.push_back(1.0);
        }
        data.runs.push_back(run);
    }
    average_runs(data);
    return data;
}

template <typename Curve>
double rms_error(const scenario &from, const Curve &curve) {
    double squares = 0.0;
    for (int i = 0; i <= 1000; ++i) {
        const double x = from.length * i / 1000.0, off = curve(x) - from.truth(x);
        squares += off * off / 1001.0;
    }
    return std::sqrt(squares);
}

// Error of the fit / error of the interpolation, over 20 seeds, ascending.
std::vector<double> against_interpolation(double exponent, double waves, double noise, int runs) {
    std::vector<double> ratio;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937_64 engine(seed);
        const scenario from = cosines(engine, exponent, waves);
        const measurement data = measure(from, engine, noise, runs);
        const fit_result fit = fit_curve(data, {});
        ratio.push_back(rms_error(from, [&](double x) { return fit.curve.value(x); }) /
                        rms_error(from, not_a_knot(data.position, data.mean)));
    }
    std::sort(ratio.begin(), ratio.end());
    return ratio;
}

TEST(FitNoise, OneRunOfRoughCurvesIsNotSmoothedAway) {
    for (const double exponent : {1.5, 2.5}) {
        for (const double waves : {0.5, 1.0, 2.0}) {
            const auto ratio = against_interpolation(exponent, waves, 0.3, 1);
            EXPECT_LE(ratio[10], 1.1) << exponent << " " << waves;
            EXPECT_LE(ratio.back(), 1.3) << exponent << " " << waves;
        }
    }
}

TEST(FitNoise, OneRunOfSmoothCurvesIsStillSmoothed) {
    EXPECT_LE(against_interpolation(2.5, 0.5, 0.3, 1)[10], 0.75);
    EXPECT_LE(against_interpolation(2.5, 0.5, 1.0, 1)[10], 0.75);
}

TEST(FitNoise, RepeatsBeatInterpolation) {
    for (const double noise : {0.3, 1.0, 3.0}) {
        const auto rough = against_interpolation(1.5, 0.5, noise, 3);
        EXPECT_LE(rough[10], 0.95) << noise;
        EXPECT_LE(rough.back(), 1.1) << noise;
        const auto smooth = against_interpolation(2.5, 0.5, noise, 3);
        EXPECT_LE(smooth[10], 0.7) << noise;
        EXPECT_LE(smooth.back(), 1.0) << noise;
    }
    EXPECT_LE(against_interpolation(2.5, 0.5, 5.0, 5)[10], 0.6);
}

TEST(FitNoise, UnmeasuredNoiseIsSaid) {
    std::mt19937_64 engine(1);
    const scenario from = cosines(engine, 2.5, 0.5);
    EXPECT_TRUE(warns(fit_curve(measure(from, engine, 0.3, 1), {}), "noise could not be measured"));
    EXPECT_FALSE(warns(fit_curve(measure(from, engine, 0.3, 3), {}), "could not be measured"));
    measurement stated = measure(from, engine, 0.3, 1);
    stated.sigma_given = true;
    EXPECT_FALSE(warns(fit_curve(stated, {}), "could not be measured"));
}

TEST(FitNoise, StatedSigmaIsBelieved) {
    // The same readings, once with the right sigma and once with a tenth of it.
    std::mt19937_64 engine(5);
    const scenario from = cosines(engine, 2.5, 0.5);
    measurement data = measure(from, engine, 2.0, 1);
    data.sigma_given = true;
    for (double &sigma : data.runs[0].sigma) sigma = 2.0;
    average_runs(data);
    const fit_result fit = fit_curve(data, {});
    EXPECT_NEAR(fit.noise, 1.0, 0.3);  // in units of sigma
    EXPECT_LT(rms_error(from, [&](double x) { return fit.curve.value(x); }), 1.5);
}

TEST(FitNoise, AWrongReadingIsNamedAndACleanCurveIsNot) {
    std::mt19937_64 engine(2);
    const scenario from = cosines(engine, 2.5, 0.3);
    measurement data = measure(from, engine, 0.3, 3);
    EXPECT_FALSE(warns(fit_curve(data, {}), "far from its neighbours"));
    for (auto &run : data.runs) run.error[11] += 15.0;
    average_runs(data);
    const fit_result fit = fit_curve(data, {});
    EXPECT_TRUE(warns(fit, "far from its neighbours"));
    EXPECT_TRUE(warns(fit, std::to_string(from.position[11]).substr(0, 5)));
}

TEST(FitNoise, ARunThatDisagreesIsNamed) {
    std::mt19937_64 engine(3);
    const scenario from = cosines(engine, 2.5, 0.3);
    measurement data = measure(from, engine, 0.3, 3);
    EXPECT_FALSE(warns(fit_curve(data, {}), "the runs disagree"));
    data.runs[1].error[7] += 10.0;
    average_runs(data);
    const fit_result fit = fit_curve(data, {});
    EXPECT_TRUE(
        warns(fit, "the runs disagree at " + std::to_string(from.position[7]).substr(0, 5)));
}

TEST(FitNoise, ExactReadingsAreNoTrouble) {
    measurement data;
    data.file = "test.csv";
    data.runs.resize(3);
    for (auto &run : data.runs) {
        for (int i = 0; i < 20; ++i) {
            run.position.push_back(10.0 * i);
            run.error.push_back(0.25 * i);
            run.sigma.push_back(1.0);
        }
    }
    for (const double bend : {0.0, 0.01}) {
        for (auto &run : data.runs) {
            for (std::size_t i = 0; i < 20; ++i)
                run.error[i] += bend * std::pow(run.position[i], 2);
        }
        average_runs(data);
        const fit_result fit = fit_curve(data, {});
        EXPECT_LT(std::abs(fit.summary.worst), 1e-3) << bend;
        EXPECT_LE(fit.curve.coefficient_count(), 12u) << bend;
    }
}

}  // namespace
}  // namespace compbox::fitting
