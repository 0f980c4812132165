// SPDX-License-Identifier: MIT
// compbox prior and train --prior: what brothers know, which of them are used, and how a map is
// drawn to them.
#include "host-tools/training/prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host-tools/training/shrinkage.h"

namespace compbox::training {
namespace {

constexpr Eigen::Index columns = 4;

// Machines whose two inputs, each with one lag, are independent; weights around (4, 0, -2, 0).
struct brothers_fixture {
    std::mt19937 engine{7};
    std::normal_distribution<double> normal;
    std::vector<bank_moments> moments;

    Eigen::VectorXd weights_of_a_brother(double spread) {
        Eigen::VectorXd weights(columns);
        weights << 4.0, 0.0, -2.0, 0.0;
        return weights +
               spread * Eigen::VectorXd::NullaryExpr(columns, [&] { return normal(engine); });
    }

    void add(const Eigen::VectorXd &weights, double noise, Eigen::Index rows = 400) {
        const Eigen::MatrixXd x =
            Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
        const Eigen::VectorXd t = x * weights + noise * Eigen::VectorXd::NullaryExpr(
                                                            rows, [&] { return normal(engine); });
        const double count = static_cast<double>(rows);
        bank_moments one;
        one.file = "m" + std::to_string(moments.size());
        one.space = {{"T1", "T2"}, {}, {"e_um"}, {600.0}};
        one.xx = x.transpose() * x / count;
        one.xt = x.transpose() * t / count;
        one.tt = Eigen::VectorXd::Constant(1, t.squaredNorm() / count);
        one.noise = Eigen::VectorXd::Constant(1, noise * noise);
        one.rows = Eigen::VectorXd::Constant(1, count);
        moments.push_back(one);
    }
};

TEST(prior, mean_and_covariance_are_those_of_the_machines) {
    brothers_fixture brothers;
    for (int m = 0; m < 200; ++m) brothers.add(brothers.weights_of_a_brother(0.5), 1.0);
    const bank_prior prior = priors_of(brothers.moments).spaces[0];
    const weight_spread &spread = prior.outputs[0];
    const Eigen::Vector4d mean(4.0, 0.0, -2.0, 0.0);
    EXPECT_LT((spread.mean - mean).cwiseAbs().maxCoeff(), 4.0 * 0.5 / std::sqrt(200.0));
    const Eigen::MatrixXd covariance = spread.factor * spread.factor.transpose();
    const Eigen::MatrixXd wanted = 0.25 * Eigen::MatrixXd::Identity(columns, columns);
    EXPECT_LT((covariance - wanted).cwiseAbs().maxCoeff(), 4.0 * 0.25 * std::sqrt(2.0 / 200.0));
    EXPECT_TRUE(prior.strange[0].empty());
}

TEST(prior, noise_of_short_records_is_not_taken_for_a_difference_of_machines) {
    brothers_fixture brothers;
    for (int m = 0; m < 60; ++m) brothers.add(brothers.weights_of_a_brother(0.0), 3.0, 30);
    const weight_spread spread = priors_of(brothers.moments).spaces[0].outputs[0];
    const double variance = (spread.factor * spread.factor.transpose()).trace() / columns;
    EXPECT_LT(variance, 0.5 * 9.0 / 30.0);  // that of the single estimates
}

TEST(prior, wrong_brothers_are_named_and_move_the_mean_little) {
    brothers_fixture brothers;
    for (int m = 0; m < 32; ++m) brothers.add(brothers.weights_of_a_brother(0.3), 1.0);
    for (int m = 0; m < 8; ++m) brothers.add(-2.0 * brothers.weights_of_a_brother(0.3), 1.0);
    const bank_prior prior = priors_of(brothers.moments).spaces[0];
    ASSERT_GE(prior.strange[0].size(), 8u);
    EXPECT_LE(prior.strange[0].size(), 9u);
    EXPECT_EQ(prior.strange[0].back(), "m39");
    EXPECT_NEAR(prior.outputs[0].mean[0], 4.0, 0.3);
}

TEST(prior, other_lags_are_refused) {
    brothers_fixture brothers;
    for (int m = 0; m < 3; ++m) brothers.add(brothers.weights_of_a_brother(0.3), 1.0);
    brothers.moments[2].space.tau_s = {900.0};
    try {
        priors_of(brothers.moments);
        FAIL();
    } catch (const std::runtime_error &error) {
        EXPECT_STREQ(error.what(), "m2: and m0 have the lags 600 and 900, s");
    }
}

TEST(prior, a_short_record_gets_the_shorter_lags) {
    brothers_fixture brothers;
    for (int m = 0; m < 3; ++m) brothers.add(brothers.weights_of_a_brother(0.3), 1.0);
    for (auto &one : brothers.moments) one.space.tau_s = {43200.0};
    const bank_priors priors = priors_of(brothers.moments);
    ASSERT_EQ(priors.spaces.size(), 2u);
    EXPECT_TRUE(priors.spaces[1].space.tau_s.empty());
    EXPECT_EQ(priors.spaces[1].outputs[0].mean.size(), 2);
    EXPECT_EQ(&prior_for(priors, {600.0, 43000.0}), &priors.spaces[0]);
    EXPECT_EQ(&prior_for(priors, {600.0, 10800.0}), &priors.spaces[1]);
}

TEST(prior, rows_alike_is_the_time_of_an_autoregression) {
    std::mt19937 engine(3);
    std::normal_distribution<double> normal;
    constexpr double keeps = 0.8;
    Eigen::VectorXd off(20000);
    off[0] = 0.0;
    for (Eigen::Index r = 1; r < off.size(); ++r) off[r] = keeps * off[r - 1] + normal(engine);
    const std::vector<std::size_t> one_run(20000, 0);
    EXPECT_NEAR(rows_alike(off, one_run), (1.0 + keeps) / (1.0 - keeps), 1.5);
    for (double &value : off) value = normal(engine);
    EXPECT_NEAR(rows_alike(off, one_run), 1.0, 0.2);
}

TEST(prior, best_mix_has_the_least_square_of_all_mixes) {
    std::mt19937 engine(5);
    std::normal_distribution<double> normal;
    for (int round = 0; round < 200; ++round) {
        Eigen::MatrixXd off = Eigen::MatrixXd::NullaryExpr(20, 3, [&] { return normal(engine); });
        off.col(0) *= 1.0 + round % 5;
        const Eigen::Matrix3d square = off.transpose() * off;
        const auto share = best_mix(square, 0.0);
        const Eigen::Map<const Eigen::Vector3d> best(share.data());
        EXPECT_NEAR(best.sum(), 1.0, 1e-12);
        EXPECT_GE(best.minCoeff(), 0.0);
        const double least = best.dot(square * best);
        for (int i = 0; i <= 10; ++i) {
            for (int j = 0; i + j <= 10; ++j) {
                const Eigen::Vector3d other(0.1 * i, 0.1 * j, 1.0 - 0.1 * (i + j));
                EXPECT_GE(other.dot(square * other), least * (1.0 - 1e-6));
            }
        }
    }
}

TEST(prior, best_mix_keeps_the_third_model_where_the_gain_is_in_doubt) {
    Eigen::Matrix3d square = Eigen::Matrix3d::Constant(90.0);
    square.diagonal() << 98.0, 100.0, 100.0;
    EXPECT_GT(best_mix(square, 0.0)[0], 0.3);
    EXPECT_LT(best_mix(square, 1000.0)[0], 0.02);
}

}  // namespace
}  // namespace compbox::training
