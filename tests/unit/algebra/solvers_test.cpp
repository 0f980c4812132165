// SPDX-License-Identifier: MIT
// What solvers promise beyond Eigen's own: rank, threshold, the least solution, and NaN.
#include "host-tools/algebra/solvers.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace compbox;
using namespace compbox::algebra;

// Third column = first + second, but for `off`.
Eigen::MatrixXd nearly_flat(double off) {
    Eigen::MatrixXd a(4, 3);
    a << 1, 0, 1, 0, 1, 1, 1, 1, 2, 2, -1, 1 + off;
    return a;
}

TEST(Solvers, TakeTheLeastSolutionWhereColumnsDependOnEachOther) {
    const Eigen::MatrixXd a = nearly_flat(0.0), b = a * Eigen::Vector3d(1, 2, 3);
    const least_squares found = solve_least_squares(a, b);
    EXPECT_EQ(found.rank, 2);
    EXPECT_LT((a * found.x - b).norm(), 1e-12);
    // (1, 1, -1) changes nothing, so the least solution has no part of it.
    EXPECT_NEAR(found.x(0) + found.x(1) - found.x(2), 0.0, 1e-12);
}

TEST(Solvers, CountSmallPivotsAsTheThresholdSays) {
    const Eigen::MatrixXd a = nearly_flat(1e-6), b = Eigen::MatrixXd::Identity(4, 4);
    EXPECT_EQ(solve_least_squares(a, b).rank, 3);
    EXPECT_EQ(solve_least_squares(a, b, 1e-9).rank, 3);
    EXPECT_EQ(solve_least_squares(a, b, 1e-4).rank, 2);
    const Eigen::MatrixXd pseudo = solve_least_squares(a, b).x;
    EXPECT_LT((a * pseudo * a - a).norm(), 1e-9);
    EXPECT_LT((pseudo * a - Eigen::MatrixXd::Identity(3, 3)).norm(), 1e-6);
}

TEST(Solvers, HandANotANumberOn) {
    Eigen::MatrixXd a = nearly_flat(0.5);
    a(0, 0) = std::nan("");
    EXPECT_TRUE(solve_least_squares(a, Eigen::MatrixXd::Identity(4, 4)).x.array().isNaN().all());
}

TEST(Solvers, GivePairsAndFactorsOfASymmetricMatrix) {
    const Eigen::MatrixXd a = nearly_flat(0.5), square = a.transpose() * a;
    const symmetric_eigen eigen = eigen_of_symmetric(square);
    EXPECT_LE(eigen.values(0), eigen.values(1));
    EXPECT_LE(eigen.values(1), eigen.values(2));
    EXPECT_LT((square * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-12);
    const positive_definite factor = factor_positive_definite(square);
    EXPECT_LT((factor.inverse * square - Eigen::MatrixXd::Identity(3, 3)).norm(), 1e-11);
    EXPECT_NEAR(factor.log_determinant, eigen.values.array().log().sum(), 1e-11);
}

}  // namespace
