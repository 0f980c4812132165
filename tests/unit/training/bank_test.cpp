// SPDX-License-Identifier: MIT
// The bank of compbox train: its inputs, the mean of maps over parts of them, the parts of a table.
#include "host-tools/training/bank.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host-tools/regression/averaging.h"
#include "host-tools/training/parts.h"
#include "host-tools/training/train.h"

namespace compbox::training {
namespace {

// Two thermometers and a spindle: runs of 80 rows, a row a minute. The error follows two bodies
// that warm up behind the thermometers; each run begins at another temperature of the shop.
training_data machine(int runs, unsigned seed, double season = 3.0) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const double fast_s = 300.0 + 900.0 * uniform(engine),
                 slow_s = 2000.0 + 4000.0 * uniform(engine);
    const double gain = 4.0 + 4.0 * uniform(engine);
    training_data data;
    data.file = "machine.csv", data.inputs = {"t1_degC", "t2_degC", "rpm"}, data.outputs = {"z_um"};
    data.speeds = {"rpm"};
    const int rows = 80;
    data.x.resize(runs * rows, 3), data.y.resize(runs * rows, 1);
    for (int r = 0; r < runs * rows; ++r) {
        static double rpm, near, far, shop;
        if (r % rows == 0) {
            shop = season * normal(engine), near = far = 0.0;
            data.run_names.push_back(std::to_string(r / rows + 1));
            data.run_starts.push_back(static_cast<std::size_t>(r));
        }
        if (r % 20 == 0) rpm = 4000.0 * uniform(engine);
        near += (10.0 * std::pow(rpm / 4000.0, 2.0) - near) * 60.0 / fast_s;
        far += (near - far) * 60.0 / slow_s;
        data.x.row(r) << 20.0 + shop + near + 0.02 * normal(engine),
            20.0 + shop + 0.5 * near + 0.02 * normal(engine), rpm;
        data.y(r, 0) = gain * far - 2.0 * near + 0.1 * normal(engine);
        data.run.push_back(static_cast<std::size_t>(r / rows));
        data.time_s.push_back(1e5 * (r / rows) + 60.0 * (r % rows));
        data.file_row.push_back(static_cast<std::size_t>(r));
    }
    return data;
}

train_options bank_options() {
    train_options options;
    options.bank = true, options.hidden = 0, options.threads = 1, options.margin = 1.0;
    return options;
}

TEST(TrainedBank, inputs_are_in_the_order_of_the_coefficient_file) {
    const auto inputs = bank_inputs(machine(1, 1), {"rpm"}, {60.0, 600.0});
    ASSERT_EQ(inputs.size(), 15u);  // (2 + 3) times (1 + 2)
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        EXPECT_EQ(inputs[i].tau_s, (std::vector<double>{0.0, 60.0, 600.0})[i % 3]);
        EXPECT_EQ(inputs[i].column, std::min<std::size_t>(i / 3, 2));
        EXPECT_EQ(inputs[i].power, i < 9 ? 1 : static_cast<int>(i / 3) - 1);
    }
}

TEST(TrainedBank, lags_fit_the_box_and_the_record) {
    const training_data data = machine(3, 1);
    std::vector<std::string> names;
    for (int i = 0; i < 24; ++i) names.push_back("t" + std::to_string(i));
    EXPECT_EQ(room_for_lags(names, {}), 10u);
    names.push_back("rpm");
    EXPECT_EQ(room_for_lags(names, {"rpm"}), 9u);  // 27 columns
    const auto tau_s = time_constants(data, 10);
    ASSERT_EQ(tau_s.size(), 10u);
    EXPECT_EQ(tau_s.front(), 120.0);         // two rows
    EXPECT_LE(tau_s.back(), 4740.0 * 1.02);  // the longest run, with two digits
    EXPECT_TRUE(std::is_sorted(tau_s.begin(), tau_s.end()));
    EXPECT_TRUE(time_constants(data, 0).empty());
}

TEST(TrainedBank, members_are_parts_with_every_input_unlagged) {
    const auto inputs = bank_inputs(machine(1, 1), {"rpm"}, {60, 120, 240, 480, 960, 1920});
    const auto members = bank_members(inputs);
    EXPECT_EQ(members.size(), 12u);
    for (const auto &member : members) {
        EXPECT_TRUE(std::is_sorted(member.begin(), member.end()));
        for (const Eigen::Index unlagged : {0, 7, 14, 21}) {
            EXPECT_EQ(std::count(member.begin(), member.end(), unlagged), 1);
        }
    }
    EXPECT_EQ(std::count_if(members.begin(), members.end(),
                            [&](const auto &member) { return member.size() == inputs.size(); }),
              1);
}

// One member is the ridge map of its decay, and its left-out rows are predicted by the others' map.
TEST(Averaging, one_member_is_a_ridge_map) {
    const training_data data = machine(4, 2);
    const Eigen::MatrixXd x = 0.1 * (data.x.array() - 20.0), t = 0.2 * data.y;
    const regression::row_folds folds = regression::folds_of(data.run);
    const regression::averaged_map one = regression::average_maps(x, t, folds, {{0, 1, 2}}, {}, 1);
    const regression::linear_map ridge = regression::ridge_solver(x, t).solve(one.decay.row(0));
    EXPECT_LT((one.map.weights - ridge.weights).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((one.map.offset - ridge.offset).cwiseAbs().maxCoeff(), 1e-8);
    const auto in = regression::rows_inside(folds, 2), out = regression::rows_outside(folds, 2);
    const Eigen::MatrixXd by_others =
        regression::ridge_solver(x(out, Eigen::all), t(out, Eigen::all))
            .solve(one.decay.row(0))
            .predict(x(in, Eigen::all));
    EXPECT_LT((one.left_out(in, Eigen::all) - by_others).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(Averaging, the_mean_is_one_map_and_prefers_the_better_member) {
    const training_data data = machine(4, 3);
    const Eigen::MatrixXd x = 0.1 * (data.x.array() - 20.0), t = 0.2 * data.y;
    const regression::row_folds folds = regression::folds_of(data.run);
    const regression::averaged_map first = regression::average_maps(x, t, folds, {{0, 1}}, {}, 1);
    const regression::averaged_map second = regression::average_maps(x, t, folds, {{1, 2}}, {}, 1);
    const regression::averaged_map both =
        regression::average_maps(x, t, folds, {{0, 1}, {1, 2}}, {}, 2);
    EXPECT_NEAR(both.share.sum(), 1.0, 1e-12);
    const double a = both.share(0, 0), b = both.share(1, 0);
    EXPECT_LT((both.map.weights - a * first.map.weights - b * second.map.weights).norm(), 1e-12);
    EXPECT_LT((both.left_out - a * first.left_out - b * second.left_out).norm(), 1e-10);
    const auto left = [&](const regression::averaged_map &map) {
        double squares = 0.0;
        for (std::size_t f = 0; f < folds.count; ++f) {
            const auto in = regression::rows_inside(folds, f);
            const Eigen::MatrixXd off = map.left_out(in, Eigen::all) - t(in, Eigen::all);
            squares += off.cwiseAbs2().maxCoeff();
        }
        return squares;
    };
    EXPECT_NEAR(a / b, std::pow(left(second) / left(first), 2.0), 1e-9 * a / b);
}

// Each run's error has an offset of its own. With fixed offsets the shop's temperature takes the
// blame.
TEST(Averaging, offsets_of_runs_are_free) {
    std::mt19937 engine(4);
    std::normal_distribution<double> normal;
    Eigen::MatrixXd x(300, 2), t(300, 1);
    std::vector<std::size_t> run;
    std::vector<Eigen::Index> starts;
    double season = 0.0;
    for (Eigen::Index r = 0; r < 300; ++r) {
        if (r % 50 == 0) season = 3.0 * normal(engine), starts.push_back(r);
        x.row(r) << season + normal(engine), normal(engine);
        t(r, 0) = 2.0 * (x(r, 0) - season) - x(r, 1) + 0.01 * normal(engine);
        run.push_back(static_cast<std::size_t>(r / 50));
    }
    const Eigen::MatrixXd zeroed = regression::from_starts(t, starts);
    const regression::row_folds folds = regression::folds_of(run);
    const regression::averaged_map fixed =
        regression::average_maps(x, zeroed, folds, {{0, 1}}, {}, 1);
    const regression::averaged_map free =
        regression::average_maps(x, zeroed, folds, {{0, 1}}, starts, 1);
    EXPECT_NEAR(free.map.weights(0, 0), 2.0, 0.02);
    EXPECT_NEAR(free.map.weights(1, 0), -1.0, 0.02);
    EXPECT_LT(fixed.map.weights(0, 0), 1.5);
    EXPECT_LT((free.left_out - zeroed).cwiseAbs().maxCoeff(), 0.2);
}

// What the runs left out leave is what runs held out of everything leave, machine by machine.
TEST(TrainedBank, left_out_runs_forecast_held_out_ones) {
    double logs = 0.0;
    const int machines = 8;
    for (int seed = 1; seed <= machines; ++seed) {
        train_options options = bank_options();
        options.hold_out = {"7", "8", "9"};
        const train_result result = train(machine(9, static_cast<unsigned>(seed)), options);
        const double left = result.linear.left_out.rms[0], held = result.linear.held_out.rms[0];
        EXPECT_LT(held, 2.5 * left) << seed;
        EXPECT_LT(100.0 * result.linear.held_out.worst[0] / result.largest[0], 15.0) << seed;
        logs += std::log(held / left);
    }
    EXPECT_NEAR(std::exp(logs / machines), 1.0, 0.35);
}

TEST(TrainedBank, errors_that_begin_at_zero_need_free_offsets) {
    const training_data data = machine(9, 5, 8.0);
    train_options options = bank_options();
    options.hold_out = {"8", "9"}, options.zero_at_start = true;
    const train_result free = train(data, options);
    EXPECT_LT(free.linear.held_out.rms[0], 0.6);
    EXPECT_EQ(free.test.y(0, 0), 0.0);
}

TEST(TrainedBank, a_network_gets_its_place_only_where_the_machine_bends) {
    for (const bool bends : {false, true}) {
        training_data data = machine(8, 6);
        if (bends) {
            data.y += (12.0 * ((data.x.col(0).array() - 24.0) * 0.8).tanh()).matrix();
        }
        train_options options = bank_options();
        options.hidden = 4, options.starts = 2, options.max_iterations = 150;
        const train_result result = train(data, options);
        EXPECT_EQ(result.any_network(), bends) << result.verdict;
        EXPECT_EQ(result.options.bank, !bends);
        EXPECT_GT(result.network.left_out.rms[0], 0.0);
    }
}

TEST(Parts, pauses_days_and_sixths) {
    std::vector<double> time_s;
    for (int i = 0; i < 100; ++i) time_s.push_back(30.0 * i + 5000.0 * (i / 25));
    EXPECT_EQ(parts_of(time_s, 100).what, "its 3 pauses");
    EXPECT_EQ(parts_of(time_s, 100).number[75], 4.0);
    for (int i = 0; i < 100; ++i) time_s[static_cast<std::size_t>(i)] = 60.0 * (i % 25);
    EXPECT_EQ(parts_of(time_s, 100).number.back(), 4.0);  // the clock starts again
    for (int i = 0; i < 100; ++i) time_s[static_cast<std::size_t>(i)] = 3600.0 * i;
    const table_parts days = parts_of(time_s, 100);
    EXPECT_EQ(days.what, "days");
    EXPECT_EQ(days.number[24], 2.0);
    EXPECT_EQ(days.number.back(), 5.0);
    for (int i = 0; i < 100; ++i) time_s[static_cast<std::size_t>(i)] = 15.0 * i;
    EXPECT_EQ(parts_of(time_s, 100).what, "six equal parts");
    EXPECT_EQ(parts_of({}, 100).number.back(), 6.0);
}

TEST(Parts, a_speed_in_long_steps_makes_runs) {
    const auto steps = [](Eigen::Index length) {
        return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(400, [=](Eigen::Index row) {
            return row / length % 2 == 0 ? 0.0 : 100.0 * static_cast<double>(row / length);
        }));
    };
    EXPECT_TRUE(has_long_steps(steps(40)));
    EXPECT_FALSE(has_long_steps(steps(5)));
    EXPECT_FALSE(has_long_steps(steps(200)));
}

TEST(TrainedBank, a_sensor_that_hardly_moves_has_the_scale_of_its_unit) {
    training_data data = machine(2, 1);
    data.inputs.push_back("still_degC"), data.inputs.push_back("load");
    data.x.conservativeResize(Eigen::NoChange, 5);
    data.x.col(3) = 20.0 + 0.01 * (data.x.col(0).array() - 20.0);
    data.x.col(4) = 50.0 * data.x.col(0);
    const auto inputs = bank_inputs(data, {"rpm"}, {600.0});
    const model_rows rows = rows_of(data, inputs, lag_starts::each_run);
    const Eigen::VectorXd scales = bank_scales(rows.x, inputs, data.inputs);
    ASSERT_EQ(scales.size(), 14);
    for (const Eigen::Index lag : {1, 3, 5, 7, 9, 11, 13}) EXPECT_EQ(scales[lag], scales[lag - 1]);
    EXPECT_EQ(scales[10], scales[0]);  // still_degC
    EXPECT_EQ(scales[2], scales[0]);
    EXPECT_GT(scales[12], 20.0 * scales[0]);
    EXPECT_GT(scales[6], 1e3 * scales[4]);  // rpm and its square
}

}  // namespace
}  // namespace compbox::training
