// SPDX-License-Identifier: MIT
// Monte Carlo: the stated uncertainty covers the difference between the figures of a simulated
// measurement and those of the same runs without an error of the measurement.
#include "host-tools/metrology/uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "host-tools/metrology/straightness.h"
#include "tests/support/cases.h"

namespace {

using namespace compbox::metrology;

constexpr double length_mm = 1000.0;
constexpr std::size_t targets = 11, runs = 5;

// Contributions of about 1 µm each.
budget_inputs balanced() {
    budget_inputs inputs;
    inputs.device_um_per_m = 1.0;
    inputs.misalignment_mm = 1.5;
    inputs.temperature_K = 0.15;
    inputs.expansion_range = 0.5;
    inputs.eve_um = 1.6;
    inputs.expansion_um_per_m_K = 11.5;
    inputs.material_degC = 23.0;
    return inputs;
}

struct dice {
    std::mt19937_64 random{20};
    double normal(double sigma) { return std::normal_distribution<double>(0.0, sigma)(random); }
    double within(double range) {
        return std::uniform_real_distribution<double>(-0.5 * range, 0.5 * range)(random);
    }
};

// A screw with a wrong pitch and a wave, scatter of 1.2 µm and a lost motion that varies.
axis_readings machine(dice &chance) {
    axis_readings axis;
    const double phase = chance.within(6.3), waves = 6.0 + chance.within(4.0);
    for (std::size_t i = 0; i < targets; ++i) {
        const double x = length_mm * static_cast<double>(i) / (targets - 1);
        axis.target_mm.push_back(x);
        const double error = 14.0 * x / length_mm + 1.5 * std::sin(phase + waves * x / length_mm);
        std::vector<double> forward, backward;
        for (std::size_t run = 0; run < runs; ++run) {
            forward.push_back(error + chance.normal(1.2));
            backward.push_back(error - 2.0 - 0.5 * std::sin(x / 97.0) + chance.normal(1.2));
        }
        axis.forward.push_back(forward);
        axis.backward.push_back(backward);
    }
    return axis;
}

// The same readings with one draw of each contribution: a scale for all, the environment for each.
axis_readings measured(const axis_readings &truth, const budget_inputs &inputs, dice &chance) {
    const double offset = chance.within(2.0 * *inputs.misalignment_mm);
    const double um_per_m = chance.normal(0.5 * *inputs.device_um_per_m) -
                            offset * offset / (2.0 * length_mm) * 1e3 +
                            *inputs.expansion_um_per_m_K * chance.within(*inputs.temperature_K) +
                            (*inputs.material_degC - 20.0) * chance.within(*inputs.expansion_range);
    axis_readings read = truth;
    for (auto *side : {&read.forward, &read.backward}) {
        for (std::size_t i = 0; i < targets; ++i) {
            for (double &value : (*side)[i]) {
                value += um_per_m * read.target_mm[i] / 1e3 + chance.within(*inputs.eve_um);
            }
        }
    }
    return read;
}

std::map<std::string, double> values_of(const iso230_2_figures &all) {
    return {{"A", *all.A},
            {"R", *all.R},
            {"E", *all.E},
            {"M", *all.M},
            {"B", *all.B},
            {"A+", *all.forward->A},
            {"R+", *all.forward->R},
            {"E+", all.forward->E},
            {"A-", *all.backward->A},
            {"R-", *all.backward->R},
            {"E-", all.backward->E}};
}

approach approach_of(const std::string &key) {
    return key.size() < 2 ? approach::both : key[1] == '+' ? approach::forward : approach::backward;
}

TEST(uncertainty_coverage, of_the_figures_of_positioning) {
    dice chance;
    const budget_inputs inputs = balanced();
    const budget known = positioning_budget(inputs, length_mm);
    const int trials = compbox_test::cases(20000);
    std::map<std::string, int> covered;
    for (int trial = 0; trial < trials; ++trial) {
        const axis_readings truth = machine(chance);
        const axis_readings read = measured(truth, inputs, chance);
        const auto figures = evaluate_positioning(read);
        const auto want = values_of(evaluate_positioning(truth));
        for (const auto &[key, value] : values_of(figures)) {
            const double U = figure_uncertainty(known, read, figures, key[0], approach_of(key));
            covered[key] += std::fabs(value - want.at(key)) <= U;
        }
    }
    for (const auto &[key, count] : covered) {
        const double percent = 100.0 * count / trials;
        EXPECT_GE(percent, 90.0) << key;
        EXPECT_LE(percent, 98.0) << key;
    }
}

// A reference of straightness whose bow is known within U, and the environment.
TEST(uncertainty_coverage, of_straightness) {
    dice chance;
    budget_inputs inputs;
    inputs.device_um = 0.8;
    inputs.eve_um = 2.0;
    const budget known = transverse_budget(inputs, length_mm);
    const int trials = compbox_test::cases(20000);
    std::map<reference, int> covered;
    std::vector<double> x, truth(targets), y(targets);
    for (std::size_t i = 0; i < targets; ++i) {
        x.push_back(length_mm * static_cast<double>(i) / (targets - 1));
    }
    const auto deviation = [&](reference line, const std::vector<double> &of) {
        return deviation_about(line == reference::end_point       ? end_point_line(x, of)
                               : line == reference::least_squares ? least_squares_line(x, of)
                                                                  : minimum_zone_line(x, of),
                               x, of);
    };
    for (int trial = 0; trial < trials; ++trial) {
        const double bow = chance.normal(0.5 * *inputs.device_um);
        for (std::size_t i = 0; i < targets; ++i) {
            const double u = x[i] / length_mm;
            truth[i] = 24.0 * u * (1.0 - u) + 0.3 * std::sin(9.0 * u);
            y[i] = truth[i] + 4.0 * bow * u * (1.0 - u);
            for (std::size_t run = 0; run < 2 * runs; ++run) {
                y[i] += chance.within(*inputs.eve_um) / (2.0 * runs);
            }
        }
        for (const auto line :
             {reference::end_point, reference::least_squares, reference::minimum_zone}) {
            const double U =
                straightness_uncertainty(known, line, x, y, std::vector<int>(targets, 2 * runs));
            covered[line] += std::fabs(deviation(line, y) - deviation(line, truth)) <= U;
        }
    }
    for (const auto &one : covered) {
        EXPECT_GE(100.0 * one.second / trials, 90.0) << static_cast<int>(one.first);
        EXPECT_LE(100.0 * one.second / trials, 98.0) << static_cast<int>(one.first);
    }
}

}  // namespace
