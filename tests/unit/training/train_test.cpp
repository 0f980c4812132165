// SPDX-License-Identifier: MIT
// compbox train: lags, and what is chosen when.
#include "host-tools/training/train.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "host-tools/formats/json.h"
#include "tests/support/random_matrix.h"
#include "tests/support/training_fixture.h"

extern "C" {
#include "models/lag.h"
#include "tests/support/lag_step.h"
}

namespace compbox::training {
namespace {

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
    data.y.col(1) = data.x.col(0) - 4.0 * data.x.col(1) + compbox_test::random_matrix(600, 1, 12);
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
