// SPDX-License-Identifier: MIT
// Noise that is correlated within a run: the filters against the dense formulas of Gaussian
// processes, and the decision between such noise and offsets of the runs.
#include "host-tools/fitting/run_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "host-tools/fitting/matern.h"

namespace compbox::fitting {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Targets at uneven distances with unlike variances; some between them are not measured.
process_points uneven_points() {
    std::mt19937 engine(4);
    std::normal_distribution<double> normal(0.0, 1.0);
    process_points points;
    double x = -3.0;
    for (int i = 0; i < 23; ++i) {
        x += 0.4 + std::abs(normal(engine));
        points.x.push_back(x);
        points.y.push_back(4.0 * std::sin(0.5 * x) + 0.7 * normal(engine));
        const bool measured = i % 5 != 2;
        points.variance.push_back(measured ? 0.3 + 0.02 * i : 0.0);
        points.step.push_back(0.8 * i);
        points.drift.push_back(std::sqrt(0.3 + 0.02 * i));
        points.measured += measured;
    }
    return points;
}

double kernel(const matern &model, double apart) {
    const double d = std::abs(apart) / model.length, root = std::sqrt(3.0) * d;
    return model.ratio * (model.kind == 0 ? std::exp(-d) : (1.0 + root) * std::exp(-root));
}

// Everything by matrices of all points.
struct dense_answer {
    VectorXd mean, variance, reading_mean, reading_variance, covariance;
    double noise_variance, log_likelihood;
};

dense_answer by_matrices(const process_points &points, const matern &model) {
    const auto n = static_cast<Eigen::Index>(points.x.size());
    std::vector<Eigen::Index> in;
    MatrixXd curve(n, n), drift(n, n), line(n, 2);
    VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto a = static_cast<std::size_t>(i);
        y[i] = points.y[a];
        line.row(i) << 1.0, points.x[a];
        if (points.variance[a] > 0.0) in.push_back(i);
        for (Eigen::Index k = 0; k < n; ++k) {
            const auto b = static_cast<std::size_t>(k);
            curve(i, k) = kernel(model, points.x[a] - points.x[b]);
            drift(i, k) = model.noise.share * points.drift[a] * points.drift[b] *
                          std::exp(-std::abs(points.step[a] - points.step[b]) / model.noise.length);
        }
    }
    const MatrixXd reading = curve + drift, h = line(in, Eigen::all);
    MatrixXd all = reading(in, in);
    for (Eigen::Index i = 0; i < all.rows(); ++i) {
        const auto a = static_cast<std::size_t>(in[static_cast<std::size_t>(i)]);
        all(i, i) += points.variance[a] * (1.0 - model.noise.share);
    }
    const MatrixXd inverse = all.inverse(), of_line = (h.transpose() * inverse * h).inverse();
    const VectorXd coefficients = of_line * h.transpose() * inverse * y(in);
    const VectorXd rest = y(in) - h * coefficients;
    dense_answer found;
    const double freedom = static_cast<double>(all.rows()) - 2.0 + points.prior_freedom;
    found.noise_variance =
        (rest.dot(inverse * rest) + points.prior_freedom * points.prior_variance) / freedom;
    found.log_likelihood = -0.5 * (freedom * std::log(found.noise_variance) +
                                   std::log(all.determinant()) - std::log(of_line.determinant()));
    const MatrixXd to_curve = curve(Eigen::all, in) * inverse,
                   to_reading = reading(Eigen::all, in) * inverse;
    const MatrixXd left = line - to_curve * h, right = line - to_reading * h;
    found.mean = line * coefficients + to_curve * rest;
    found.reading_mean = line * coefficients + to_reading * rest;
    const auto spread = [&](const MatrixXd &prior, const MatrixXd &gain, const MatrixXd &other,
                            const MatrixXd &a, const MatrixXd &b) {
        const MatrixXd covariance =
            prior - gain * other(Eigen::all, in).transpose() + a * of_line * b.transpose();
        return VectorXd(found.noise_variance * covariance.diagonal());
    };
    found.variance = spread(curve, to_curve, curve, left, left);
    found.reading_variance = spread(reading, to_reading, reading, right, right);
    found.covariance = spread(curve, to_curve, reading, left, right);
    return found;
}

void expect_near(const std::vector<double> &found, const VectorXd &expected) {
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_NEAR(found[i], expected[static_cast<Eigen::Index>(i)], 2e-7) << i;
    }
}

TEST(FitRunNoise, TheFilterIsTheDenseFormula) {
    process_points points = uneven_points();
    points.prior_variance = 0.5;
    points.prior_freedom = 12.0;
    for (const int kind : {0, 1}) {
        const matern white{kind, 3.0, 20.0, {}};
        const double first =
            likelihood_of(points, white).log_likelihood - by_matrices(points, white).log_likelihood;
        for (const noise_kind noise :
             {noise_kind{}, noise_kind{0.5, 2.0}, noise_kind{0.9, 10.0}, noise_kind{0.99, 60.0}}) {
            const matern model{kind, 3.0, 20.0, noise};
            const matern_curve found = regress(points, model);
            const dense_answer expected = by_matrices(points, model);
            EXPECT_NEAR(found.likelihood.noise_variance, expected.noise_variance, 2e-7);
            EXPECT_NEAR(found.likelihood.log_likelihood - expected.log_likelihood, first, 1e-6);
            expect_near(found.mean, expected.mean);
            expect_near(found.variance, expected.variance);
            expect_near(found.reading_mean, expected.reading_mean);
            expect_near(found.reading_variance, expected.reading_variance);
            expect_near(found.covariance, expected.covariance);
        }
    }
}

struct noise_recipe {
    double correlation, offsets;
};

measurement runs_with(const noise_recipe &recipe, std::size_t runs, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    measurement data;
    data.file = "test.csv";
    data.runs.resize(runs);
    for (auto &run : data.runs) {
        const double offset = recipe.offsets * normal(engine);
        double noise = normal(engine);
        for (int i = 0; i < 40; ++i) {
            run.position.push_back(50.0 * i);
            run.error.push_back(10.0 * std::sin(0.2 * i) + offset + noise);
            run.sigma.push_back(1.0);
            noise = recipe.correlation * noise +
                    std::sqrt(1.0 - recipe.correlation * recipe.correlation) * normal(engine);
        }
    }
    average_runs(data);
    return data;
}

// Twice the restricted log likelihood of all differences between runs, for a noise of given size.
double of_differences(const measurement &data, const noise_kind &kind, double variance) {
    const auto runs = static_cast<Eigen::Index>(data.runs.size()), n = Eigen::Index{40};
    MatrixXd readings(n, runs), covariance(n, n);
    for (Eigen::Index r = 0; r < runs; ++r) {
        const auto &run = data.runs[static_cast<std::size_t>(r)];
        readings.col(r) = Eigen::Map<const VectorXd>(run.error.data(), n);
    }
    for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index k = 0; k < n; ++k) {
            const double apart = std::abs(static_cast<double>(i - k));
            covariance(i, k) = kind.share * std::exp(-apart / kind.length);
        }
        covariance(i, i) += 1.0 - kind.share;
    }
    covariance *= variance;
    const MatrixXd inverse = covariance.inverse();
    const double log_determinant = std::log(covariance.determinant());
    double sum = 0.0;
    for (Eigen::Index r = 1; r < runs;
         ++r) {  // Helmert's contrasts: independent, of one covariance
        const VectorXd contrast =
            (readings.leftCols(r).rowwise().sum() - static_cast<double>(r) * readings.col(r)) /
            std::sqrt(static_cast<double>(r * (r + 1)));
        sum -= log_determinant + contrast.dot(inverse * contrast);
    }
    return sum;
}

TEST(FitRunNoise, TheRepeatsEvidenceIsThatOfTheDifferencesBetweenRuns) {
    const measurement data = runs_with({0.8, 0.0}, 4, 7);
    ASSERT_FALSE(data.runs_aligned);
    const auto all = noise_of_runs(data);
    ASSERT_GT(all.size(), 10u);
    EXPECT_TRUE(all.front().kind.white());
    EXPECT_NEAR(all.front().mean_square, data.repeat_variance, 1e-9);
    EXPECT_NEAR(all.front().freedom, data.repeat_freedom, 1e-9);
    const auto twice = [&](const noise_evidence &one) {
        return of_differences(data, one.kind, one.mean_square);
    };
    for (const auto &one : all) {
        EXPECT_NEAR(2.0 * (one.log_likelihood() - all.front().log_likelihood()),
                    twice(one) - twice(all.front()), 1e-6)
            << one.kind.share << " " << one.kind.length;
    }
}

TEST(FitRunNoise, OffsetsOfTheRunsAreEvenedOutAndCorrelatedNoiseIsNot) {
    int offsets = 0, drifts = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        offsets += runs_with({0.0, 5.0}, 5, seed).runs_aligned;
        drifts += runs_with({0.9, 0.0}, 5, seed).runs_aligned;
    }
    EXPECT_GE(offsets, 18);
    EXPECT_LE(drifts, 1);
}

TEST(FitRunNoise, EvenedOutOffsetsCountInTheUncertaintyOfTheMean) {
    const measurement data = runs_with({0.0, 5.0}, 5, 3);
    double squares = 0.0;
    for (const auto &run : data.runs) squares += run.offset * run.offset;
    const double widened = 2.87 / 2.0;  // Student's t of 4 degrees of freedom at 95.45 %, by two
    EXPECT_NEAR(std::sqrt(data.line_variance[0]), widened * std::sqrt(squares / 20.0), 0.02);
    EXPECT_EQ(runs_with({0.0, 0.0}, 5, 3).line_variance[0], 0.0);
}

// The slopes of many measurements scatter as stated, however the noise is correlated.
TEST(FitRunNoise, TheSlopesVarianceIsThatOfTheirScatter) {
    for (const double correlation : {0.0, 0.7, 0.9}) {
        double squares = 0.0, stated = 0.0;
        for (unsigned seed = 1; seed <= 300; ++seed) {
            const measurement data = runs_with({correlation, 0.0}, 5, seed);
            VectorXd t = Eigen::Map<const VectorXd>(data.position.data(), 40), error(40);
            t.array() -= t.mean();
            for (Eigen::Index i = 0; i < 40; ++i) {
                error[i] = data.mean[static_cast<std::size_t>(i)] -
                           10.0 * std::sin(0.2 * static_cast<double>(i));
            }
            const double slope = t.dot(error) / t.squaredNorm();
            squares += slope * slope;
            stated += variance_of_slope(data);
        }
        EXPECT_NEAR(std::sqrt(stated / squares), 1.0, 0.25) << correlation;
    }
}

TEST(FitRunNoise, OneRunShowsNothing) {
    const auto all = noise_of_runs(runs_with({0.9, 0.0}, 1, 1));
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all.front().freedom, 0.0);
}

}  // namespace
}  // namespace compbox::fitting
