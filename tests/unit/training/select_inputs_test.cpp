// SPDX-License-Identifier: MIT
// compbox select-inputs: clusters, grades and the check on runs left out.
#include "host-tools/training/select_inputs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host-tools/regression/elimination.h"

namespace compbox::training {
namespace {

// Three groups of sensors (a sine each, of its own frequency), the second of each group noisier and
// the third turned over; the error follows the first group and a little the second.
training_data three_groups(int rows = 400) {
    std::mt19937 engine(11);
    std::normal_distribution<double> normal;
    training_data data;
    data.file = "groups.csv";
    data.inputs = {"a1", "b1", "c1", "a2", "b2", "c2", "a3", "b3", "c3"};
    data.outputs = {"z"};
    data.x.resize(rows, 9);
    data.y.resize(rows, 1);
    for (int r = 0; r < rows; ++r) {
        double group[3];
        for (int g = 0; g < 3; ++g) group[g] = std::sin((0.05 + 0.031 * g) * r + g);
        for (int g = 0; g < 3; ++g) {
            data.x(r, g) = 20.0 + 5.0 * group[g] + 0.02 * normal(engine);
            data.x(r, 3 + g) = 30.0 + 2.0 * group[g] + 0.2 * normal(engine);
            data.x(r, 6 + g) = 10.0 - 4.0 * group[g] + 0.3 * normal(engine);
        }
        data.y(r, 0) = 9.0 * group[0] + 2.0 * group[1] + 0.05 * normal(engine);
        data.run.push_back(static_cast<std::size_t>(r * 4 / rows));
        data.time_s.push_back(r);
    }
    data.run_names = {"1", "2", "3", "4"};
    for (int run = 0; run < 4; ++run) {
        data.run_starts.push_back(static_cast<std::size_t>(run * rows / 4));
    }
    return data;
}

TEST(SelectInputs, both_methods_find_the_groups_by_themselves) {
    for (const auto method : {cluster_method::c_means, cluster_method::closure}) {
        select_options options;
        options.method = method;
        const selection result = select_inputs(three_groups(), options);
        ASSERT_EQ(result.clusters.count, 3u) << report_of(result);
        EXPECT_EQ(result.clusters.cluster, (std::vector<std::size_t>{0, 1, 2, 0, 1, 2, 0, 1, 2}));
        ASSERT_EQ(result.chosen.size(), 3u);
        for (const std::size_t one : result.chosen) {  // of each group the highest grade
            for (std::size_t other = one % 3; other < 9; other += 3) {
                EXPECT_GE(result.grade[one], result.grade[other]);
            }
        }
    }
}

// A group of five sensors for each of three stories, measured with more or less noise.
TEST(SelectInputs, three_groups_of_five_are_three_clusters) {
    for (const double noise : {0.02, 0.1, 0.3}) {
        std::mt19937 engine(5);
        std::normal_distribution<double> normal;
        Eigen::MatrixXd sensors(400, 15);
        for (int r = 0; r < 400; ++r) {
            for (int s = 0; s < 15; ++s) {
                sensors(r, s) = std::sin((0.05 + 0.031 * (s / 5)) * r) + noise * normal(engine);
            }
        }
        const regression::clustering found =
            regression::fuzzy_c_means(regression::similarity_of(sensors), 0);
        ASSERT_EQ(found.count, 3u) << noise;
        for (std::size_t s = 0; s < 15; ++s) EXPECT_EQ(found.cluster[s], s / 5);
    }
}

// Sixteen sensors of one warm-up that differ a little: the index alone would take almost each for
// itself.
TEST(SelectInputs, never_more_clusters_than_the_root_of_the_sensors) {
    std::mt19937 engine(7);
    std::normal_distribution<double> normal;
    Eigen::MatrixXd sensors(300, 16);
    for (int r = 0; r < 300; ++r) {
        for (int s = 0; s < 16; ++s) {
            sensors(r, s) = 1.0 - std::exp(-r / (30.0 + 3.0 * s * s)) + 0.001 * normal(engine);
        }
    }
    const regression::clustering found =
        regression::fuzzy_c_means(regression::similarity_of(sensors), 0);
    EXPECT_GE(found.count, 2u);
    EXPECT_LE(found.count, 4u);
}

TEST(SelectInputs, takes_as_many_as_asked_for) {
    for (const auto method : {cluster_method::c_means, cluster_method::closure}) {
        for (std::size_t count = 2; count <= 9; ++count) {
            select_options options;
            options.method = method, options.count = count;
            const selection result = select_inputs(three_groups(), options);
            EXPECT_EQ(result.chosen.size(), count) << report_of(result);
        }
    }
}

TEST(SelectInputs, memberships_sum_to_one_and_belong) {
    const training_data data = three_groups();
    const regression::clustering found =
        regression::fuzzy_c_means(regression::similarity_of(data.x), 3);
    for (Eigen::Index s = 0; s < 9; ++s) {
        EXPECT_NEAR(found.membership.row(s).sum(), 1.0, 1e-12);
        EXPECT_GT(found.membership.row(s).maxCoeff(), 0.9);
    }
}

TEST(SelectInputs, closure_chains_and_cuts) {
    Eigen::MatrixXd r = Eigen::MatrixXd::Identity(4, 4);
    const auto near = [&](int a, int b, double value) { r(a, b) = r(b, a) = value; };
    near(0, 1, 0.9), near(1, 2, 0.8), near(0, 2, 0.1), near(2, 3, 0.3);  // 0-2 by way of 1
    EXPECT_EQ(regression::transitive_closure(r, 2).cluster, (std::vector<std::size_t>{0, 0, 0, 1}));
    EXPECT_EQ(regression::transitive_closure(r, 3).cluster, (std::vector<std::size_t>{0, 0, 1, 2}));
    EXPECT_NEAR(regression::transitive_closure(r, 2).validity, 0.8, 1e-12);
}

TEST(SelectInputs, grades_are_those_worked_out_by_hand) {
    Eigen::MatrixXd x(3, 2);
    x << 0, 4, 1, 2, 2, 0;  // the second falls: it is turned over
    const Eigen::Vector3d y(0, 3, 4);
    // y scaled: 0, 0.75, 1; both columns scaled: 0, 0.5, 1; differences 0, 0.25, 0
    const double middle = (0 + 0.5 * 0.25) / (0.25 + 0.5 * 0.25);
    const Eigen::VectorXd grades = grey_grades(x, y);
    EXPECT_NEAR(grades[0], (1 + middle + 1) / 3, 1e-12);
    EXPECT_NEAR(grades[1], grades[0], 1e-12);
    EXPECT_EQ(grey_grades(x.col(0), x.col(0))[0], 1.0);
}

TEST(SelectInputs, by_runs_drops_what_only_disturbs) {
    training_data data = three_groups();
    std::mt19937 engine(12);
    std::normal_distribution<double> normal;
    // A sensor that follows the error in each run but with another offset each time.
    for (Eigen::Index r = 0; r < data.x.rows(); ++r) {
        data.x(r, 2) =
            data.y(r, 0) + 30.0 * static_cast<double>(data.run[static_cast<std::size_t>(r)]);
    }
    select_options options;
    options.by_runs = true;
    options.count = 3;
    const selection result = select_inputs(data, options);
    ASSERT_EQ(result.chosen.size(), 3u);
    EXPECT_EQ(std::count(result.chosen.begin(), result.chosen.end(), 2u), 0) << report_of(result);
    EXPECT_LT(result.checks.back().merit, 0.02);
}

TEST(SelectInputs, the_check_tells_a_good_choice_from_a_bad_one) {
    select_options options;
    options.check = true;
    options.count = 3;
    const selection good = select_inputs(three_groups(), options);
    ASSERT_EQ(good.checks.size(), 2u);
    EXPECT_LT(good.checks[1].merit, 0.1);
    options.count = 1;  // one sensor cannot tell both groups' part of the error
    const selection poor = select_inputs(three_groups(), options);
    EXPECT_GT(poor.checks[1].merit, 2.0 * good.checks[1].merit);
}

// What is left without a group of inputs is what a map without them leaves; so it is after another
// group was removed.
TEST(Elimination, equals_maps_that_never_had_the_inputs) {
    const training_data data = three_groups(120);
    const Eigen::MatrixXd x = 0.2 * (data.x.array() - 20.0), t = 0.1 * data.y;
    const regression::row_folds folds = regression::folds_of(data.run);
    const double decay = 1e-3;
    regression::elimination map(x, t, folds, decay, 1);
    const auto directly = [&](const std::vector<Eigen::Index> &kept) {
        Eigen::MatrixXd left(t.rows(), t.cols());
        for (std::size_t f = 0; f < folds.count; ++f) {
            const auto in = regression::rows_inside(folds, f),
                       out = regression::rows_outside(folds, f);
            const Eigen::MatrixXd some = x(Eigen::all, kept);
            const regression::linear_map solved =
                regression::ridge_solver(some(out, Eigen::all), t(out, Eigen::all))
                    .solve(Eigen::VectorXd::Constant(1, decay));
            left(in, Eigen::all) = solved.predict(some(in, Eigen::all)) - t(in, Eigen::all);
        }
        return left;
    };
    const auto apart = [](const Eigen::MatrixXd &a, const Eigen::MatrixXd &b) {
        return (a - b).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(apart(map.residuals(), directly({0, 1, 2, 3, 4, 5, 6, 7, 8})), 1e-10);
    EXPECT_LT(apart(map.residuals_without({0, 4}), directly({1, 2, 3, 5, 6, 7, 8})), 1e-10);
    map.remove({0, 4});
    EXPECT_LT(apart(map.residuals(), directly({1, 2, 3, 5, 6, 7, 8})), 1e-10);
    EXPECT_LT(apart(map.residuals_without({1, 3, 8}), directly({2, 5, 6, 7})), 1e-10);
    EXPECT_GT(apart(map.residuals(), directly({2, 5, 6, 7})), 1e-3);
}

}  // namespace
}  // namespace compbox::training
