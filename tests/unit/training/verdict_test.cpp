// SPDX-License-Identifier: MIT
// Does `train` write the network only where it is better in truth? Many made data sets, judged.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host-tools/regression/gain.h"
#include "host-tools/training/train.h"
#include "tests/support/cases.h"

namespace compbox::training {
namespace {

// Warm-ups of two temperatures. The error: what `bend` makes of their rises, with what no
// thermometer sees: a wandering residual (correlation 0.95 from row to row) and white noise.
struct warm_ups {
    int runs, rows;
    double white_um = 0.3, step_um = 0.3;
};

template <typename Function>
training_data made_of(const warm_ups &made, unsigned seed, const Function &error_um) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    training_data data;
    data.file = "made.csv", data.inputs = {"T1", "T2"}, data.outputs = {"e_um"};
    data.x.resize(made.runs * made.rows, 2), data.y.resize(made.runs * made.rows, 1);
    for (int run = 0; run < made.runs; ++run) {
        const double high1 = 5.0 + 10.0 * uniform(engine), high2 = 2.0 + 4.0 * uniform(engine);
        double wander_um = 0.0;
        data.run_names.push_back("r" + std::to_string(run));
        data.run_starts.push_back(data.run.size());
        for (int i = 0; i < made.rows; ++i) {
            const double time = static_cast<double>(i) / made.rows;
            const double rise1 = high1 * (1.0 - std::exp(-4.0 * time)) + 0.05 * normal(engine);
            const double rise2 = high2 * time + 0.05 * normal(engine);
            wander_um = i == 0 ? 0.0 : 0.95 * wander_um + made.step_um * normal(engine);
            const auto row = static_cast<Eigen::Index>(data.run.size());
            data.x.row(row) << 20.0 + rise1, 20.0 + rise2;
            data.y(row, 0) = error_um(rise1, rise2) + wander_um + made.white_um * normal(engine);
            data.run.push_back(static_cast<std::size_t>(run));
        }
    }
    return data;
}

train_options quick_options() {
    train_options options;
    options.starts = 2;
    options.threads = 1;
    options.margin = 1.0;
    return options;
}

constexpr int fresh_runs = 10;

// Twenty in the long tests, the first half of them otherwise.
int data_sets() {
    return compbox_test::long_tests() ? 20 : 10;
}

// Of data_sets(): where the network was written, and was worse on ten fresh runs.
struct verdicts {
    int network = 0, wrong = 0;
};

template <typename Function>
verdicts judge(warm_ups made, const Function &error_um) {
    verdicts found;
    train_options options = quick_options();
    options.accept_worse = true;  // of noise nothing is predicted
    for (int r = 0; r < fresh_runs; ++r) {
        options.hold_out.push_back("r" + std::to_string(made.runs + r));
    }
    made.runs += fresh_runs;
    for (int seed = 0; seed < data_sets(); ++seed) {
        const train_result result =
            train(made_of(made, static_cast<unsigned>(seed), error_um), options);
        if (!result.any_network()) continue;
        ++found.network;
        if (result.network.held_out.rms[0] > result.linear.held_out.rms[0]) ++found.wrong;
    }
    return found;
}

double straight(double rise1, double rise2) {
    return 3.0 * rise1 - 2.0 * rise2;
}

TEST(Verdict, a_straight_machine_is_not_taken_for_a_bent_one) {
    for (const warm_ups &made : {warm_ups{3, 60}, warm_ups{5, 100}}) {
        const verdicts found = judge(made, straight);
        RecordProperty(std::to_string(made.runs) + "_runs_network", found.network);
        RecordProperty(std::to_string(made.runs) + "_runs_wrong", found.wrong);
        EXPECT_LE(found.wrong, data_sets() / 10) << made.runs << " runs, network " << found.network;
        EXPECT_LE(found.network, data_sets() / 10) << made.runs << " runs";
    }
}

TEST(Verdict, noise_alone_gets_no_network) {
    const verdicts found = judge({5, 60}, [](double, double) { return 0.0; });
    EXPECT_LE(found.network, data_sets() / 10);
}

// A product of the temperatures, and a rise that saturates: bends of several times the noise.
TEST(Verdict, a_bent_machine_still_gets_the_network) {
    const warm_ups made{6, 60};
    const auto product = [](double a, double b) { return straight(a, b) + 0.5 * a * b; };
    const auto saturating = [](double a, double b) {
        return straight(a, b) + 12.0 * std::tanh(0.5 * (a - 5.0));
    };
    for (const verdicts &found : {judge(made, product), judge(made, saturating)}) {
        EXPECT_GE(found.network, data_sets() * 3 / 4);
        EXPECT_LE(found.wrong, 1);
    }
}

TEST(Gain, quantiles_are_those_of_the_tables) {
    const double table[][2] = {{4, 2.776}, {5, 2.571}, {9, 2.262}, {30, 2.042}};
    for (const auto &row : table) {
        EXPECT_NEAR(regression::student_quantile(static_cast<Eigen::Index>(row[0])), row[1],
                    0.004 * row[1]);
    }
}

TEST(Gain, of_five_runs_needs_more_than_its_spread) {
    const Eigen::ArrayXd linear = Eigen::ArrayXd::Constant(5, 1.0);
    Eigen::ArrayXd network(5);
    network << 0.9, 0.8, 0.9, 0.85, 0.95;
    EXPECT_TRUE(regression::is_clear_gain(linear, network));
    network << 0.2, 1.1, 0.9, 1.05, 0.95;  // one run only
    EXPECT_FALSE(regression::is_clear_gain(linear, network));
    EXPECT_FALSE(regression::is_clear_gain(linear, linear));
    EXPECT_FALSE(regression::is_clear_gain(Eigen::ArrayXd::Zero(5), Eigen::ArrayXd::Zero(5)));
}

TEST(Gain, of_three_runs_needs_a_fifth_less_of_every_run) {
    const Eigen::ArrayXd linear = Eigen::ArrayXd::Constant(3, 1.0);
    Eigen::ArrayXd network = Eigen::ArrayXd::Constant(3, 0.79 * 0.79);
    EXPECT_TRUE(regression::is_clear_gain(linear, network));
    network[1] = 0.81 * 0.81;
    EXPECT_FALSE(regression::is_clear_gain(linear, network));
}

}  // namespace
}  // namespace compbox::training
