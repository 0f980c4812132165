// SPDX-License-Identifier: MIT
// compbox train: derivatives, lags, the linear baseline, and what is chosen when.
#include "host-tools/training/train.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/json.h"
#include "host-tools/training/network_training.h"
#include "host-tools/training/optimise.h"
#include "tests/support/training_fixture.h"

extern "C" {
#include "models/lag.h"
#include "tests/support/lag_step.h"
}

namespace compbox::training {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
}

network_shape shape_of(bool linear, activation kind) {
    return {4, 3, 2, linear, kind};
}

class Derivatives : public testing::TestWithParam<std::tuple<bool, activation>> {
  protected:
    network_shape shape = shape_of(std::get<0>(GetParam()), std::get<1>(GetParam()));
    // More than one block of samples, the last one not full.
    Eigen::MatrixXd x = random_matrix(4, 300, 1), t = random_matrix(2, 300, 2);
    weight_decay decay{0.02, 0.05, Eigen::Vector2d(0.3, 0.7)};
    Eigen::VectorXd p = random_matrix(shape.count(), 1, 3);
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

TEST(Lags, are_those_of_the_box) {
    training_data data = made_of(60, 1, [](const Eigen::RowVectorXd &) { return 0.0; });
    for (std::size_t r = 0; r < data.rows(); ++r) data.time_s[r] = 3.0 * static_cast<double>(r * r);
    lag_options options;
    options.lags_s = {40.0, 7200.0};
    options.squares = {"b"};
    const auto inputs = model_inputs(data, options);
    ASSERT_EQ(inputs.size(), 9u);
    EXPECT_EQ(inputs[3].name, "b_lag40");
    EXPECT_EQ(inputs[7].name, "b_sq_lag40");
    const model_rows rows = rows_of(data, inputs, lag_starts::each_run);
    for (std::size_t c = 0; c < inputs.size(); ++c) {
        cb_lag lag;
        for (std::size_t r = 0; r < data.rows(); ++r) {
            const auto at = static_cast<Eigen::Index>(r);
            double u = data.x(at, static_cast<Eigen::Index>(inputs[c].column));
            if (inputs[c].power == 2) u *= u;
            float want = static_cast<float>(u);
            if (inputs[c].tau_s > 0.0 && r == 0) cb_lag_start(&lag, want);
            if (inputs[c].tau_s > 0.0 && r > 0) {
                const auto dt = static_cast<float>(data.time_s[r] - data.time_s[r - 1]);
                want =
                    lag_step(&lag, cb_lag_gains_for(dt, static_cast<float>(inputs[c].tau_s)), want);
            }
            EXPECT_NEAR(rows.x(at, static_cast<Eigen::Index>(c)), want, 2e-6) << inputs[c].name;
        }
    }
}

TEST(Lags, start_with_the_run_or_the_file_or_both) {
    const training_data data = made_of(40, 2, [](const Eigen::RowVectorXd &) { return 0.0; });
    lag_options options;
    options.lags_s = {500.0};
    const auto inputs = model_inputs(data, options);
    const model_rows run = rows_of(data, inputs, lag_starts::each_run);
    const model_rows once = rows_of(data, inputs, lag_starts::once);
    const model_rows both = rows_of(data, inputs, lag_starts::both);
    EXPECT_EQ(run.x(20, 2), data.x(20, 0));
    EXPECT_NE(once.x(20, 2), data.x(20, 0));
    EXPECT_EQ(once.x.topRows(20), run.x.topRows(20));
    ASSERT_EQ(both.x.rows(), 80);
    EXPECT_EQ(both.x.topRows(40), once.x);
    EXPECT_EQ(both.x.bottomRows(40), run.x);
    EXPECT_EQ(both.source[45], 5u);
    EXPECT_EQ(both.run[75], 1u);
}

// Points that are probed line by line: every k-th row would be the same columns of every line.
TEST(Network, is_trained_on_rows_from_everywhere) {
    const training_data data =
        made_of(1000, 5, [](const Eigen::RowVectorXd &x) { return x[0] + 0.5 * x[0] * x[1]; });
    train_options options = small_options();
    options.max_rows = 200;
    options.max_iterations = 5;
    const train_result result = train(data, options);
    ASSERT_EQ(result.network_rows.size(), 200u);
    std::array<int, 10> columns = {};
    for (std::size_t i = 0; i < result.network_rows.size(); ++i) {
        ++columns[static_cast<std::size_t>(result.network_rows[i] % 10)];
    }
    for (const int count : columns) EXPECT_NEAR(count, 20, 10);
    EXPECT_TRUE(std::is_sorted(result.network_rows.begin(), result.network_rows.end()));
}

TEST(Ridge, solves_the_normal_equations) {
    const Eigen::MatrixXd x = random_matrix(50, 3, 5), t = random_matrix(50, 2, 6);
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
    const Eigen::MatrixXd x = random_matrix(60, 4, 7);
    Eigen::MatrixXd t = x * random_matrix(4, 1, 8);
    std::vector<std::size_t> runs;
    for (std::size_t r = 0; r < 60; ++r) runs.push_back(r / 20);
    t.topRows(20).array() += 100.0;  // an offset of the first run, which no other run shows
    const ridge_choice choice = choose_by_folds(x, t, folds_of(runs));
    EXPECT_GT((choice.left_out - t).topRows(20).cwiseAbs().minCoeff(), 50.0);
}

TEST(Ridge, evidence_finds_noise_and_strength) {
    const Eigen::MatrixXd x = random_matrix(400, 10, 9), w = random_matrix(10, 1, 10);
    const Eigen::MatrixXd t = x * w + 0.5 * random_matrix(400, 1, 11);
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

TEST(Train, a_linear_machine_gets_the_linear_map) {
    const training_data data = made_of(
        400, 5, [](const Eigen::RowVectorXd &x) { return 3.0 * x[0] - 2.0 * x[1] + 7.0; }, 0.05);
    const train_result result = train(data, small_options());
    EXPECT_FALSE(result.any_network()) << report_of(result);
    EXPECT_LT(result.chosen_figures.left_out.rms[0], 0.06);
    const json term = fragment_of(result)["terms"][0];
    EXPECT_EQ(term["hidden_weights"].size(), 1u);
    EXPECT_EQ(term["output_weights"][0][0], 0.0);
    EXPECT_NE(report_of(result).find("the network is not better"), std::string::npos);
}

TEST(Train, a_bent_machine_gets_the_network) {
    const training_data data = made_of(
        600, 6, [](const Eigen::RowVectorXd &x) { return 20.0 * std::tanh(2.0 * x[0]) + x[1]; },
        0.05);
    for (const bool linear_path : {true, false}) {
        train_options options = small_options();
        options.linear_path = linear_path;
        const train_result result = train(data, options);
        EXPECT_TRUE(result.any_network()) << report_of(result);
        EXPECT_LT(result.network.left_out.rms[0], 0.15);
        EXPECT_GT(result.linear.left_out.rms[0], 1.0);
        EXPECT_LT(result.network.trained.rms[0], 0.15);
    }
}

TEST(Train, each_output_gets_what_is_better_for_it) {
    training_data data = made_of(
        600, 6, [](const Eigen::RowVectorXd &x) { return 20.0 * std::tanh(2.0 * x[0]) + x[1]; },
        0.05);
    data.outputs.push_back("straight");
    data.y.conservativeResize(Eigen::NoChange, 2);
    data.y.col(1) = data.x.col(0) - 4.0 * data.x.col(1) + random_matrix(600, 1, 12);
    const train_result result = train(data, small_options());
    EXPECT_EQ(result.network_better, (std::vector<bool>{true, false})) << report_of(result);
    const Eigen::MatrixXd y = result.chosen.predict(result.learn.x);
    EXPECT_EQ(y.col(0), result.network.model.predict(result.learn.x).col(0));
    EXPECT_LT((y.col(1) - result.linear.model.predict(result.learn.x).col(1)).cwiseAbs().maxCoeff(),
              1e-9);
}

TEST(Train, evidence_tells_bent_from_straight) {
    train_options options = small_options();
    options.regularise = regularisation::evidence;
    const auto bent = [](const Eigen::RowVectorXd &x) { return 5.0 * x[0] * x[0] + x[1]; };
    const auto straight = [](const Eigen::RowVectorXd &x) { return 5.0 * x[0] + x[1]; };
    EXPECT_TRUE(train(made_of(300, 1, bent, 0.2), options).any_network());
    EXPECT_FALSE(train(made_of(300, 1, straight, 0.2), options).any_network());
}

TEST(Train, is_the_same_on_any_number_of_threads) {
    const training_data data = made_of(
        300, 4, [](const Eigen::RowVectorXd &x) { return std::sin(2.0 * x[0]) * x[1]; }, 0.02);
    for (const auto way : {regularisation::folds, regularisation::evidence}) {
        train_options options = small_options();
        options.regularise = way;
        options.threads = 1;
        const std::string one = formats::json_text(fragment_of(train(data, options)));
        options.threads = 3;
        EXPECT_EQ(formats::json_text(fragment_of(train(data, options))), one);
        options.seed = 2;
        EXPECT_NE(formats::json_text(fragment_of(train(data, options))), one);
    }
}

TEST(Train, runs_held_out_are_never_trained_on) {
    training_data data = made_of(
        400, 4, [](const Eigen::RowVectorXd &x) { return x[0] + x[1]; }, 0.02);
    data.y.bottomRows(100).array() += 1000.0;
    train_options options = small_options();
    options.hold_out = {"4"};
    const train_result result = train(data, options);
    EXPECT_EQ(result.learn.x.rows(), 300);
    EXPECT_LT(result.chosen_figures.trained.worst[0], 1.0);
    EXPECT_NEAR(result.chosen_figures.held_out.worst[0], 1000.0, 1.0);
}

TEST(Train, a_run_beyond_the_others_is_reported) {
    training_data data = made_of(
        400, 4, [](const Eigen::RowVectorXd &x) { return x[0] + x[1]; }, 0.02);
    data.x.bottomRows(100).col(0).array() += 10.0;
    const train_result result = train(data, small_options());
    EXPECT_NE(report_of(result).find("note: run 4: a reaches "), std::string::npos)
        << report_of(result);
}

}  // namespace
}  // namespace compbox::training
