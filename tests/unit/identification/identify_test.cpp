// SPDX-License-Identifier: MIT
// Points, plan and nine-line identification against the 9 x 6 system itself, brute force and noise.
#include "host-tools/identification/identify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/error.h"
#include "host-tools/identification/plan.h"

namespace {

using namespace compbox;
using namespace compbox::identification;

std::mt19937 generator(5);

double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
}

points_mm random_points(std::size_t count = 3) {
    points_mm points(count);
    for (auto &point : points) {
        for (auto &value : point) value = uniform(-500, 500);
    }
    return points;
}

line_sigma random_sigma(std::size_t points) {
    line_sigma sigma(3 * static_cast<Eigen::Index>(points));
    for (auto &one : sigma) one = std::exp(uniform(-2, 1));
    return sigma;
}

six sigma_of_matrix(const Eigen::MatrixXd &A) {
    const Eigen::MatrixXd covariance = algebra::factor_positive_definite(A.transpose() * A).inverse;
    six sigma;
    for (int k = 0; k < 6; ++k) sigma[static_cast<std::size_t>(k)] = std::sqrt(covariance(k, k));
    return sigma;
}

TEST(points, closed_form_is_the_covariance_of_least_squares) {
    for (std::size_t round = 0; round < 500; ++round) {
        const auto points = random_points(3 + round % 3);
        const line_sigma noise = random_sigma(points.size());
        const six expected =
            sigma_of_matrix(noise.cwiseInverse().asDiagonal() * observation_matrix(points));
        const six sigma = closed_form_sigma(points, noise);
        for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(sigma[k] / expected[k], 1.0, 1e-9);
    }
}

// The displacement of a point by the definition in the paper, written out.
TEST(points, observation_matrix_is_the_papers_formula) {
    const points_mm points{{10, 20, 30}, {-5, 0, 7}, {100, -40, 3}};
    Eigen::Matrix<double, 6, 1> e;
    e << 1, 2, 3, 40, 50, 60;  // µm, µrad
    const auto d = (observation_matrix(points) * e).eval();
    for (int i = 0; i < 3; ++i) {
        const auto &p = points[static_cast<std::size_t>(i)];
        EXPECT_DOUBLE_EQ(d(3 * i), 1 + (p[2] * 50 - p[1] * 60) / 1000);
        EXPECT_DOUBLE_EQ(d(3 * i + 1), 2 + (p[0] * 60 - p[2] * 40) / 1000);
        EXPECT_DOUBLE_EQ(d(3 * i + 2), 3 + (p[1] * 40 - p[0] * 50) / 1000);
    }
}

TEST(points, a_line_is_an_obstacle) {
    const line_model common{0, setups::common, 21}, separate{0, setups::separate, 21};
    EXPECT_NE(obstacle({{0, 0, 0}, {10, 20, 30}, {20, 40, 60}}, common), "");
    EXPECT_NE(obstacle({{5, 5, 5}, {5, 5, 5}, {20, 40, 60}}, common), "");
    EXPECT_NE(obstacle({{0, 0, 0}, {300, 0, 0}, {600, 0.9, 0}}, common), "");
    EXPECT_EQ(obstacle({{0, 0, 0}, {300, 0, 0}, {600, 2.1, 0}}, common), "");
    EXPECT_NE(obstacle({{0, 0, 0}, {300, 0, 0}, {600, 2.1, 0}}, separate), "");
    EXPECT_EQ(obstacle({{0, 0, 0}, {300, 0, 0}, {600, 0, 0}, {0, 50, 0}}, common), "");
}

// Two points that coincide as seen along the axis: common frames solve them, set-ups do not.
TEST(points, a_line_as_seen_along_the_axis_is_an_obstacle_of_set_ups) {
    const points_mm points{{-300, -100, 0}, {300, -100, 0}, {0, 100, 50}};
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(obstacle(points, {axis, setups::common, 21}), "");
        const std::string fault = obstacle(points, {axis, setups::separate, 21});
        EXPECT_EQ(fault.empty(), axis != 0) << fault;
    }
    EXPECT_NE(obstacle(points, {0, setups::separate, 21}).find("seen along X, the 3 points lie on"),
              std::string::npos);
    EXPECT_NEAR(height_seen_along_mm(points, 0), 0.0, 1e-12);
    EXPECT_NEAR(height_seen_along_mm(points, 1), 50.0, 1e-9);
}

// The merit by the sigma of identify's own model; `d` by determinants of both parts.
double merit_by_hand(const points_mm &points, const plan_options &options) {
    const bool separate = options.model.lines == setups::separate;
    const line_sigma noise =
        sigma_of_lines(options.along_um, options.across_um, options.model.axis, 3);
    if (options.rank_by == criterion::d) {
        const Eigen::MatrixXd A = noise.cwiseInverse().asDiagonal() * observation_matrix(points);
        double log = algebra::factor_positive_definite(A.transpose() * A).log_determinant;
        if (separate) {
            const Eigen::MatrixXd B = along_matrix(points, options.model.axis);
            log += algebra::factor_positive_definite(B.transpose() * B).log_determinant /
                   (options.model.positions - 2);
        }
        return -std::exp(log);
    }
    const six sigma =
        sigma_over_positions(points, noise, closed_form_sigma(points, noise), options.model);
    double sum = 0;
    for (std::size_t k = 0; k < 6; ++k) {
        const double ratio = sigma[k] / options.preset[k];
        sum += options.rank_by == criterion::a ? ratio * ratio : ratio;
    }
    return sum / 6.0;
}

// Every triple of a small grid rated by the plain formulas: same best one, same count of obstacles.
void expect_brute_force(const plan_options &options, const std::vector<point_mm> &nodes) {
    double best = INFINITY;
    std::uint64_t flat = 0, all = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        for (std::size_t j = i + 1; j < nodes.size(); ++j) {
            for (std::size_t k = j + 1; k < nodes.size(); ++k, ++all) {
                const points_mm points{nodes[i], nodes[j], nodes[k]};
                if (!obstacle(points, options.model).empty()) {
                    ++flat;
                    continue;
                }
                best = std::min(best, merit_by_hand(points, options));
            }
        }
    }
    const auto result = plan_points(nodes, options);
    EXPECT_EQ(result.triples, all);
    EXPECT_EQ(result.degenerate, flat);
    EXPECT_GT(flat, 0u);
    ASSERT_EQ(result.best.size(), options.best);
    EXPECT_NEAR(merit_by_hand(result.best[0].points, options) / best, 1.0, 1e-9);
    for (std::size_t k = 0; k < result.best.size(); ++k) {
        const auto &one = result.best[k];
        EXPECT_EQ(obstacle(one.points, options.model), "");
        if (options.rank_by != criterion::d) {
            EXPECT_NEAR(merit_by_hand(one.points, options) / one.merit, 1.0, 1e-9);
        }
        if (k > 0) {
            EXPECT_LE(result.best[k - 1].merit, one.merit);
        }
    }
}

TEST(plan, equals_brute_force) {
    const auto nodes = grid{{-300, -200, -50}, {300, 200, 400}, {4, 3, 3}}.nodes();
    ASSERT_EQ(nodes.size(), 36u);
    for (const auto lines : {setups::common, setups::separate}) {
        for (const auto rank_by : {criterion::mean_cv, criterion::a, criterion::d}) {
            for (int axis = 0; axis < 3; ++axis) {
                plan_options options;
                options.model = {axis, lines, axis == 0 ? 5 : 40};
                options.along_um = axis == 1 ? 1.0 : 0.2;
                options.across_um = axis == 1 ? 1.0 : 1.5;
                options.rank_by = rank_by;
                options.preset = {5, 2, 9, 30, 10, 4};
                expect_brute_force(options, nodes);
            }
        }
    }
}

// Boxes of any shape, long along the axis or flat across it: what is recommended shows pitch and
// yaw, by every criterion.
TEST(plan, never_recommends_points_that_hide_pitch_and_yaw) {
    for (int round = 0; round < 30; ++round) {
        grid box;
        for (std::size_t k = 0; k < 3; ++k) {
            box.low_mm[k] = uniform(-500, 100);
            box.high_mm[k] = box.low_mm[k] + std::exp(uniform(std::log(20), std::log(2000)));
            box.counts[k] = 4;
        }
        for (const auto rank_by : {criterion::mean_cv, criterion::a, criterion::d}) {
            plan_options options;
            options.model.axis = round % 3;
            options.model.positions = round % 2 == 0 ? 21 : 200;
            options.rank_by = rank_by;
            for (const auto &triple : plan_points(box.nodes(), options).best) {
                EXPECT_EQ(obstacle(triple.points, options.model), "");
            }
        }
    }
}

TEST(plan, does_not_depend_on_threads) {
    const auto nodes = grid{{0, 0, 0}, {600, 300, 200}, {7, 6, 5}}.nodes();
    for (const auto rank_by : {criterion::mean_cv, criterion::d}) {
        plan_options options;
        options.rank_by = rank_by;
        options.threads = 1;
        const auto one = plan_points(nodes, options);
        options.threads = 5;
        const auto five = plan_points(nodes, options);
        for (std::size_t k = 0; k < options.best; ++k) {
            EXPECT_EQ(one.best[k].node, five.best[k].node);
            EXPECT_EQ(one.best[k].merit, five.best[k].merit);
        }
    }
}

// S2's rule, for lines in one frame: two points at the ends of the longest edge, the third on the
// opposite edge.
TEST(plan, finds_the_papers_rule) {
    const grid box{{-300, -150, -100}, {300, 150, 100}, {5, 5, 5}};
    plan_options options;
    options.model.lines = setups::common;
    const auto result = plan_points(box.nodes(), options);
    EXPECT_EQ(describe(result.best[0].points, box),
              "two points at the ends of a longest edge (along X), the third in the middle of the "
              "opposite edge");
}

TEST(plan, other_triangles_are_reported_by_their_places) {
    const grid box{{-250, -300, 75}, {250, 300, 325}, {10, 10, 10}};
    const points_mm points{{125, 300, 75}, {250, -300, 325}, {-250, -300, 75}};
    EXPECT_EQ(describe(points, box),
              "a triangle with sides of 662, 559 and 708 mm: P1 X 75 %, Y high, Z low; P2 X high, "
              "Y low, Z high; P3 X low, Y low, Z low");
}

TEST(plan, orders_points_for_the_traditional_sequence) {
    int solvable = 0;
    for (int round = 0; round < 200; ++round) {
        auto points = random_points();
        if (round % 4 == 0) points[1][0] = points[0][0];  // singular in some orders
        const auto before = points;
        for (int axis = 0; axis < 3; ++axis) {
            points = before;
            plan_options options;
            options.model = {axis, setups::common, 21};
            six found, sigma;
            if (!order_for_traditional(points, options, found)) continue;
            ++solvable;
            ASSERT_TRUE(traditional_sigma(points, axis, line_sigma::Ones(9), sigma));
            EXPECT_EQ(found, sigma);
            EXPECT_TRUE(std::is_permutation(points.begin(), points.end(), before.begin()));
        }
    }
    EXPECT_GT(solvable, 400);
}

nine_lines table_of(const Eigen::MatrixXd &e, const std::vector<double> &x,
                    const points_mm &points) {
    nine_lines table;
    table.position_mm = x;
    table.reading_um = e * observation_matrix(points).transpose();
    return table;
}

std::vector<double> positions(int n) {
    std::vector<double> x;
    for (int i = 0; i < n; ++i) x.push_back(200.0 * i);
    return x;
}

Eigen::MatrixXd random_errors(int n) {
    Eigen::MatrixXd e(n, 6);
    for (auto &value : e.reshaped()) value = uniform(-20, 20);
    return e;
}

TEST(identify, common_frame_gives_the_errors_back) {
    const auto x = positions(15);
    for (int axis = 0; axis < 3; ++axis) {
        for (const auto how : {nine_line_method::improved, nine_line_method::traditional}) {
            auto points = random_points();
            plan_options order;
            order.model.axis = axis;
            six ordered;
            ASSERT_TRUE(order_for_traditional(points, order, ordered));
            const auto e = random_errors(15);
            identify_options options;
            options.axis = axis;
            options.how = how;
            options.lines = setups::common;
            const auto curves = identify(table_of(e, x, points), points, options, "t");
            EXPECT_LT((curves.value - e).cwiseAbs().maxCoeff(), 1e-7);
        }
    }
}

// Every line with its own offset, every straightness line with its own slope: what is identified
// does not change by them, and is the truth less its unidentifiable parts.
TEST(identify, separate_set_ups_do_not_matter) {
    const auto x = positions(21);
    const auto t =
        (Eigen::Map<const Eigen::VectorXd>(x.data(), 21).array() - 2000.0).matrix().eval();
    for (int round = 0; round < 9; ++round) {
        const int axis = round % 3;
        const auto points = random_points(3 + static_cast<std::size_t>(round / 3));
        Eigen::MatrixXd e = random_errors(21);
        auto table = table_of(e, x, points);
        if (round % 2 == 0) table.sigma_um = random_sigma(points.size());
        for (int line = 0; line < table.reading_um.cols(); ++line) {
            table.reading_um.col(line).array() += uniform(-50, 50);
            if (line % 3 != axis) table.reading_um.col(line) += t * uniform(-0.01, 0.01);
        }
        identify_options options;
        options.axis = axis;
        const auto curves = identify(table, points, options, "t");
        const int keeps_slope[3] = {axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3};
        for (int k = 0; k < 6; ++k) {
            Eigen::VectorXd expected = e.col(k).array() - e.col(k).mean();
            const bool keeps = std::find(keeps_slope, keeps_slope + 3, k) != keeps_slope + 3;
            if (!keeps) expected -= t * (t.dot(expected) / t.squaredNorm());
            EXPECT_LT((curves.value.col(k) - expected).cwiseAbs().maxCoeff(), 1e-7) << axis << k;
        }
        EXPECT_LT(curves.noise_um, 1e-9);
    }
}

// in : the noise of each line; stated by the table if `known`
// The sigma of each error at each position is what 4000 tables of noise show.
void expect_true_sigma(const points_mm &points, const identify_options &options,
                       const line_sigma &noise, bool known) {
    const auto x = positions(9);
    std::normal_distribution<double> normal;
    Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(9, 6), stated(9, 6);
    const int rounds = 4000;
    double contradiction = 0.0;
    for (int round = 0; round < rounds; ++round) {
        nine_lines table;
        table.position_mm = x;
        table.reading_um.resize(9, noise.size());
        for (auto &value : table.reading_um.reshaped()) value = normal(generator);
        table.reading_um *= noise.asDiagonal();
        if (known) table.sigma_um = noise;
        const auto curves = identify(table, points, options, "t");
        squares.array() += curves.value.array().square();
        const double unit = curves.noise_um > 0 ? curves.noise_um : 1.0;
        contradiction += std::pow(known ? curves.contradiction : unit, 2.0) / rounds;
        if (known && curves.line_sigma_um != noise) continue;  // enlarged, by chance
        stated = curves.sigma / (known ? 1.0 : unit);
    }
    if (options.how == nine_line_method::improved) {
        EXPECT_NEAR(contradiction, 1.0, 0.02);
    }
    const Eigen::ArrayXXd seen = (squares / rounds).array().sqrt();
    for (int row = 0; row < 9; ++row) {
        for (int k = 0; k < 6; ++k) {
            if (stated(row, k) > 1e-9) {
                EXPECT_NEAR(seen(row, k) / stated(row, k), 1.0, 0.05);
            } else {
                EXPECT_LT(seen(row, k), 1e-9);
            }
        }
    }
}

TEST(identify, sigma_is_true) {
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    for (const auto how : {nine_line_method::improved, nine_line_method::traditional}) {
        for (const auto lines : {setups::common, setups::separate}) {
            identify_options options;
            options.how = how;
            options.lines = lines;
            expect_true_sigma(points, options, line_sigma::Ones(9), false);
            expect_true_sigma(points, options, sigma_of_lines(0.2, 1.5, 0, 3), true);
        }
    }
}

TEST(identify, sigma_is_true_of_more_points_and_of_unequal_lines) {
    points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    expect_true_sigma(points, {}, random_sigma(3), true);
    points.push_back({-50, -170, 90});
    identify_options options;
    options.axis = 1;
    expect_true_sigma(points, options, random_sigma(4), true);
    options.lines = setups::common;
    expect_true_sigma(points, options, random_sigma(4), true);
}

// The root mean square over the positions is what plan promises.
TEST(identify, sigma_is_what_plan_promises) {
    for (std::size_t round = 0; round < 30; ++round) {
        const auto points = random_points(3 + round % 2);
        const line_model model{static_cast<int>(round % 3),
                               round % 2 ? setups::common : setups::separate, 13};
        nine_lines table = table_of(random_errors(13), positions(13), points);
        table.sigma_um = random_sigma(points.size());
        identify_options options;
        options.axis = model.axis;
        options.lines = model.lines;
        const auto curves = identify(table, points, options, "t");
        const six one = closed_form_sigma(points, table.sigma_um);
        const six promised = sigma_over_positions(points, table.sigma_um, one, model);
        for (int k = 0; k < 6; ++k) {
            const double rms = std::sqrt(curves.sigma.col(k).squaredNorm() / 13.0);
            EXPECT_NEAR(rms / promised[static_cast<std::size_t>(k)], 1.0, 1e-9);
        }
    }
}

// Contradictions far beyond the table's sigma enlarge it and are reported, smaller ones do not.
TEST(identify, contradictions_beyond_chance_enlarge_sigma) {
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    std::normal_distribution<double> normal;
    for (const double factor : {0.3, 1.0, 3.0}) {
        nine_lines table = table_of(random_errors(21), positions(21), points);
        const line_sigma noise = sigma_of_lines(0.2, 1.5, 0, 3);
        for (int line = 0; line < 9; ++line) {
            for (auto &value : table.reading_um.col(line)) value += normal(generator) * noise(line);
        }
        table.sigma_um = noise / factor;
        const auto curves = identify(table, points, {}, "t");
        EXPECT_NEAR(curves.contradiction, factor, 0.3 * factor);
        const double enlarged = curves.line_sigma_um(4) / table.sigma_um(4);
        EXPECT_NEAR(enlarged, factor > 2.0 ? curves.contradiction : 1.0, 1e-12);
        EXPECT_EQ(curves.remarks.size(), factor == 1.0 ? 1u : 2u);
    }
}

TEST(identify, finds_a_wild_reading) {
    const auto x = positions(21);
    const auto points = random_points();
    std::normal_distribution<double> normal;
    identify_options options;
    nine_lines table = table_of(random_errors(21), x, points);
    for (auto &value : table.reading_um.reshaped()) value += normal(generator);
    EXPECT_TRUE(identify(table, points, options, "t").outliers.empty());
    table.reading_um(13, 4) += 60;
    const auto curves = identify(table, points, options, "t");
    ASSERT_FALSE(curves.outliers.empty());
    EXPECT_EQ(curves.outliers[0].row, 13u);
}

// One bad reading is one, two are two: what leans on its neighbours is not reported as theirs.
TEST(identify, a_bad_reading_does_not_accuse_its_neighbours) {
    const auto x = positions(21);
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    std::normal_distribution<double> normal;
    for (const auto lines : {setups::common, setups::separate}) {
        identify_options options;
        options.lines = lines;
        int more = 0;
        for (int round = 0; round < 50; ++round) {
            nine_lines table = table_of(random_errors(21), x, points);
            for (auto &value : table.reading_um.reshaped()) value += normal(generator);
            const auto noise_um = identify(table, points, options, "t").noise_um;
            table.reading_um(13, 4) += 60;
            const auto one = identify(table, points, options, "t");
            ASSERT_FALSE(one.outliers.empty());
            EXPECT_EQ(one.outliers[0].row, 13u);
            EXPECT_EQ(one.outliers[0].line, 4);
            more += one.outliers.size() > 1;
            EXPECT_GT(one.noise_um, 1.5 * noise_um);  // it stays in the solution
            table.reading_um(5, 0) -= 40;
            std::set<std::pair<std::size_t, int>> places;
            const auto two = identify(table, points, options, "t");
            for (const auto &found : two.outliers) places.insert({found.row, found.line});
            EXPECT_TRUE(places.count({13u, 4}) && places.count({5u, 0}));
            more += places.size() > 2;
        }
        EXPECT_LE(more, 2);  // 1 in 1000 is called bad by chance
    }
}

// A bad reading of the finer instrument shows, though it is smaller than the noise of the other
// one.
TEST(identify, finds_a_bad_reading_of_the_finer_instrument) {
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}, {-90, -120, 120}};
    std::normal_distribution<double> normal;
    const line_sigma noise = sigma_of_lines(0.1, 1.5, 0, 4);
    int found = 0, alike = 0;
    for (int round = 0; round < 20; ++round) {
        nine_lines table = table_of(random_errors(21), positions(21), points);
        for (int line = 0; line < 12; ++line) {
            for (auto &value : table.reading_um.col(line)) value += normal(generator) * noise(line);
        }
        table.reading_um(13, 3) += 2.0;
        alike += !identify(table, points, {}, "t").outliers.empty();
        table.sigma_um = noise;
        const auto outliers = identify(table, points, {}, "t").outliers;
        // Four such lines give three errors, so a fault of one is nearly that of another.
        found += outliers.size() == 1 && outliers[0].row == 13 && outliers[0].line % 3 == 0;
    }
    EXPECT_GE(found, 18);
    EXPECT_LE(alike, 6);
}

// Points two and two of which share a coordinate: seen from here two lines are as one.
TEST(identify, a_bad_reading_that_may_be_another_lines_says_so) {
    const points_mm points{{125, 300, 75}, {250, -300, 325}, {-250, -300, 75}};
    std::normal_distribution<double> normal;
    nine_lines table = table_of(random_errors(21), positions(21), points);
    for (auto &value : table.reading_um.reshaped()) value += normal(generator);
    table.reading_um(13, 4) += 60;
    const auto found = identify(table, points, {}, "t").outliers;
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].row, 13u);
    ASSERT_EQ(found[0].or_lines.size(), 1u);
    EXPECT_EQ(found[0].line + found[0].or_lines[0], 4 + 2);  // d2y and d1z
}

// Without noise what is left is rounding, in which nothing stands out.
TEST(identify, a_bad_reading_among_exact_ones_is_one) {
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    nine_lines table = table_of(random_errors(21), positions(21), points);
    EXPECT_TRUE(identify(table, points, {}, "t").outliers.empty());
    table.reading_um(3, 8) += 5;
    const auto found = identify(table, points, {}, "t").outliers;
    ASSERT_EQ(found.size(), 1u);
    EXPECT_TRUE(found[0].row == 3 && found[0].line == 8);
}

// A table of zeros, or one that was computed, has no noise at all.
TEST(identify, readings_without_any_noise_are_finite) {
    const points_mm points{{-300, -100, -150}, {300, 140, -110}, {20, 130, 170}};
    const nine_lines table = table_of(Eigen::MatrixXd::Zero(5, 6), positions(5), points);
    for (const setups lines : {setups::separate, setups::common}) {
        identify_options options;
        options.lines = lines;
        const auto curves = identify(table, points, options, "t");
        EXPECT_TRUE((curves.value.array() == 0.0).all());
        EXPECT_LT(curves.sigma.cwiseAbs().maxCoeff(), 1e-9);
    }
}

TEST(identify, refuses_what_cannot_be_solved) {
    const auto x = positions(5);
    const points_mm line{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    const auto table = table_of(random_errors(5), x, random_points());
    EXPECT_THROW(identify(table, line, {}, "plan.json"), input_error);
    identify_options traditional;
    traditional.how = nine_line_method::traditional;
    const points_mm singular{
        {0, 0, 0}, {10, 0, 0}, {20, 50, 0}};  // all Z alike: eps y unseen by d1x…
    EXPECT_THROW(identify(table, singular, traditional, "plan.json"), input_error);
    EXPECT_THROW(identify(table_of(random_errors(2), positions(2), random_points()),
                          random_points(), {}, "plan.json"),
                 input_error);
}

}  // namespace
