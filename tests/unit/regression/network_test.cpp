// SPDX-License-Identifier: MIT
// Networks: derivatives against differences, and both ways of descending.
#include "host-tools/regression/network.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host-tools/regression/optimise.h"
#include "tests/support/random_matrix.h"

namespace compbox::regression {
namespace {

network_shape shape_of(bool linear, activation kind) {
    return {4, 3, 2, linear, kind};
}

class Derivatives : public testing::TestWithParam<std::tuple<bool, activation>> {
  protected:
    network_shape shape = shape_of(std::get<0>(GetParam()), std::get<1>(GetParam()));
    // More than one block of samples, the last one not full.
    Eigen::MatrixXd x = compbox_test::random_matrix(4, 300, 1),
                    t = compbox_test::random_matrix(2, 300, 2);
    weight_decay decay{0.02, 0.05, Eigen::Vector2d(0.3, 0.7)};
    Eigen::VectorXd p = compbox_test::random_matrix(shape.count(), 1, 3);
};

TEST_P(Derivatives, gradient_is_that_of_the_loss) {
    network_loss loss(shape, x, t, decay);
    Eigen::VectorXd gradient(shape.count());
    const double value = loss(p.data(), gradient.data());
    EXPECT_NEAR(loss(p.data(), nullptr), value, 1e-13 * value);
    for (Eigen::Index i = 0; i < p.size(); ++i) {
        Eigen::VectorXd above = p, below = p;
        above[i] += 1e-5, below[i] -= 1e-5;
        const double slope = (loss(above.data(), nullptr) - loss(below.data(), nullptr)) / 2e-5;
        EXPECT_NEAR(gradient[i], slope, 1e-8 * (1.0 + std::abs(slope))) << "parameter " << i;
    }
}

TEST_P(Derivatives, residuals_are_the_loss_as_squares) {
    network_loss loss(shape, x, t, decay);
    Eigen::VectorXd gradient(shape.count()), r(loss.residual_count());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(r.size(), p.size());
    const double value = loss(p.data(), gradient.data());
    loss.residuals(p.data(), r.data(), j.data());
    EXPECT_NEAR(0.5 * r.squaredNorm(), value, 1e-13 * value);
    EXPECT_LT((j.transpose() * r - gradient).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(Derivatives, both_ways_of_descending_arrive_where_the_slope_is_zero) {
    network_loss loss(shape, x, t, decay);
    optimise_options options;
    options.max_iterations = 2000, options.least_decrease = 1e-14;
    Eigen::VectorXd by_lbfgs = p, by_squares = p, slope(p.size());
    const auto gradient = [&](const double *q, double *g) { return loss(q, g); };
    const auto residuals = [&](const double *q, double *r, double *j) { loss.residuals(q, r, j); };
    const optimise_result one = minimise(gradient, by_lbfgs, options);
    const optimise_result other =
        minimise_squares(residuals, loss.residual_count(), by_squares, options);
    for (const Eigen::VectorXd &q : {by_lbfgs, by_squares}) {
        EXPECT_LT(loss(q.data(), slope.data()), loss(p.data(), nullptr));
        EXPECT_LT(slope.cwiseAbs().maxCoeff(), 1e-6);
    }
    EXPECT_NEAR(one.value, loss(by_lbfgs.data(), nullptr), 1e-12);
    EXPECT_NEAR(other.value, loss(by_squares.data(), nullptr), 1e-12);
}

TEST_P(Derivatives, jacobian_is_that_of_the_predictions) {
    const network_loss loss(shape, x, t, decay);
    const Eigen::Index from = 255, n = 4;
    const Eigen::MatrixXd rows = loss.jacobian(p, from, n);
    for (Eigen::Index i = 0; i < p.size(); ++i) {
        Eigen::VectorXd above = p, below = p;
        above[i] += 1e-5, below[i] -= 1e-5;
        const Eigen::MatrixXd slope = (predict(shape, above, x.middleCols(from, n)) -
                                       predict(shape, below, x.middleCols(from, n))) /
                                      2e-5;
        const Eigen::Map<const Eigen::VectorXd> wanted(slope.data(), slope.size());
        EXPECT_LT((rows.col(i) - wanted).cwiseAbs().maxCoeff(), 1e-8) << "parameter " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Networks, Derivatives,
                         testing::Combine(testing::Bool(),
                                          testing::Values(activation::tansig, activation::logsig)));

TEST(Network, activation_survives_any_argument) {
    for (const auto kind : {activation::tansig, activation::logsig}) {
        const network_shape shape{1, 1, 1, false, kind};
        const Eigen::Vector4d p(1.0, 0.0, 1.0, 0.0);
        for (const double x : {0.0, 1e-9, 0.3, -20.0, 400.0, -400.0, 1e6, -1e6}) {
            const double want = kind == activation::tansig ? std::tanh(x) : 1 / (1 + std::exp(-x));
            EXPECT_NEAR(predict(shape, p, Eigen::MatrixXd::Constant(1, 1, x))(0, 0), want, 3e-16);
        }
    }
}

TEST(Optimise, finds_the_minimum_of_rosenbrock) {
    Eigen::VectorXd p = Eigen::Vector2d(-1.2, 1.0);
    optimise_options options;
    options.least_decrease = 1e-15;
    int calls = 0;
    options.after = [&](int iteration, double, const Eigen::VectorXd &) {
        EXPECT_EQ(iteration, calls++);
        return true;
    };
    const auto rosenbrock = [](const double *v, double *g) {
        const double a = 1.0 - v[0], b = v[1] - v[0] * v[0];
        if (g != nullptr) g[0] = -2.0 * a - 400.0 * v[0] * b, g[1] = 200.0 * b;
        return a * a + 100.0 * b * b;
    };
    const optimise_result result = minimise(rosenbrock, p, options);
    EXPECT_NEAR(p[0], 1.0, 1e-6);
    EXPECT_NEAR(p[1], 1.0, 1e-6);
    EXPECT_GE(calls, result.iterations);
}

}  // namespace
}  // namespace compbox::regression
