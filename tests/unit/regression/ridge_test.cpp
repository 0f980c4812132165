// SPDX-License-Identifier: MIT
// Linear maps with weight decay, and the folds that choose it.
#include "host-tools/regression/ridge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host-tools/algebra/solvers.h"
#include "tests/support/random_matrix.h"

namespace compbox::regression {
namespace {

TEST(Ridge, solves_the_normal_equations) {
    const Eigen::MatrixXd x = compbox_test::random_matrix(50, 3, 5),
                          t = compbox_test::random_matrix(50, 2, 6);
    const Eigen::Vector2d decay(0.1, 2.0);
    const linear_map map = ridge_solver(x, t).solve(decay);
    Eigen::MatrixXd xc = x.rowwise() - x.colwise().mean(), tc = t.rowwise() - t.colwise().mean();
    for (Eigen::Index k = 0; k < 2; ++k) {
        const Eigen::MatrixXd normal =
            xc.transpose() * xc / 50.0 + decay[k] * Eigen::MatrixXd::Identity(3, 3);
        const Eigen::VectorXd want =
            algebra::factor_positive_definite(normal).inverse * (xc.transpose() * tc.col(k)) / 50.0;
        EXPECT_LT((map.weights.col(k) - want).cwiseAbs().maxCoeff(), 1e-12);
    }
    EXPECT_LT((map.predict(x) - t).colwise().mean().cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Ridge, left_out_predictions_never_saw_their_run) {
    const Eigen::MatrixXd x = compbox_test::random_matrix(60, 4, 7);
    Eigen::MatrixXd t = x * compbox_test::random_matrix(4, 1, 8);
    std::vector<std::size_t> runs;
    for (std::size_t r = 0; r < 60; ++r) runs.push_back(r / 20);
    t.topRows(20).array() += 100.0;  // an offset of the first run, which no other run shows
    const ridge_choice choice = choose_by_folds(x, t, folds_of(runs));
    EXPECT_GT((choice.left_out - t).topRows(20).cwiseAbs().minCoeff(), 50.0);
}

TEST(Ridge, evidence_finds_noise_and_strength) {
    const Eigen::MatrixXd x = compbox_test::random_matrix(400, 10, 9),
                          w = compbox_test::random_matrix(10, 1, 10);
    const Eigen::MatrixXd t = x * w + 0.5 * compbox_test::random_matrix(400, 1, 11);
    const auto found = ridge_solver(x, t).find_evidence();
    const double want = 0.25 / (400.0 * w.squaredNorm() / 10.0);  // alpha / (beta N)
    EXPECT_NEAR(std::log(found.decay / want), 0.0, 0.6);
    EXPECT_GT(found.effective_parameters, 9.0);
}

TEST(Folds, are_runs_and_never_rows) {
    const row_folds folds = folds_of({7, 7, 3, 3, 9});
    EXPECT_EQ(folds.count, 3u);
    EXPECT_EQ(folds.fold, (std::vector<std::size_t>{1, 1, 0, 0, 2}));
    EXPECT_EQ(rows_inside(folds, 1), (std::vector<Eigen::Index>{0, 1}));
    std::vector<std::size_t> many;
    for (std::size_t r = 0; r < 46; ++r) many.push_back(r / 2);
    EXPECT_EQ(folds_of(many).count, 10u);
    EXPECT_EQ(folds_of(many).fold[45], 2u);
    EXPECT_FALSE(folds_of({0, 0, 1}).usable());
}

}  // namespace
}  // namespace compbox::regression
