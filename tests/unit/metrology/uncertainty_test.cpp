// SPDX-License-Identifier: MIT
// The uncertainty budget by values worked out by hand.
#include "host-tools/metrology/uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace compbox::metrology;

// An axis of 1.75 m with a material of 25 °C.
budget_inputs shop_floor() {
    budget_inputs inputs;
    inputs.device_um_per_m = 0.8;
    inputs.misalignment_mm = 1.0;
    inputs.temperature_K = 1.0;
    inputs.expansion_range = 2.0;
    inputs.eve_um = 1.7;
    inputs.expansion_um_per_m_K = 12.0;
    inputs.material_degC = 25.0;
    return inputs;
}

// Two targets, readings that alternate by 1 µm, and a reversal.
axis_readings axis_of(std::size_t up, std::size_t down, double reversal) {
    axis_readings axis;
    axis.target_mm = {0, 1000};
    for (const double at : {0.0, 5.0}) {
        axis.forward.emplace_back();
        axis.backward.emplace_back();
        for (std::size_t i = 0; i < up; ++i)
            axis.forward.back().push_back(i % 2 == 0 ? at : at + 1.0);
        for (std::size_t i = 0; i < down; ++i) {
            axis.backward.back().push_back((i % 2 == 0 ? at : at + 1.0) - reversal);
        }
    }
    return axis;
}

double uncertainty_of(const budget &known, const axis_readings &axis, char letter, approach which) {
    return figure_uncertainty(known, axis, evaluate_positioning(axis), letter, which);
}

TEST(uncertainty, contributions_worked_out_by_hand) {
    const budget known = positioning_budget(shop_floor(), 1750.0);
    EXPECT_NEAR(*known.device, 1.4, 1e-12);                      // 0.8 x 1.75
    EXPECT_NEAR(*known.misalignment, 0.3 / 1750 * 1e3, 1e-12);   // 0.17 um
    EXPECT_NEAR(*known.temperature, 0.6 * 12 * 1.75, 1e-12);     // 12.6 um
    EXPECT_NEAR(*known.expansion, 0.6 * 5 * 1.75 * 2.0, 1e-12);  // 10.5 um
    EXPECT_NEAR(*known.environment, 1.02, 1e-12);
    EXPECT_NEAR(known.systematic(), std::sqrt(1.96 + 0.0293878 + 158.76 + 110.25), 1e-6);
}

TEST(uncertainty, a_millimetre_over_half_a_metre_costs_0_6_um) {
    budget_inputs inputs;
    inputs.misalignment_mm = 1.0;
    EXPECT_NEAR(*positioning_budget(inputs, 500.0).misalignment, 0.6, 1e-12);
}

TEST(uncertainty, both_parts_of_the_instrument_add_by_their_squares) {
    budget_inputs inputs;
    inputs.device_um = 0.3;
    inputs.device_um_per_m = 0.4;
    EXPECT_NEAR(*positioning_budget(inputs, 1000.0).device, 0.5, 1e-12);
}

TEST(uncertainty, what_is_not_stated_is_not_in_the_budget) {
    const budget known = positioning_budget({}, 1000.0);
    EXPECT_FALSE(known.device || known.misalignment || known.temperature || known.expansion ||
                 known.environment);
    EXPECT_DOUBLE_EQ(uncertainty_of(known, axis_of(5, 5, 0.0), 'A', approach::both), 0.0);
    budget_inputs inputs = shop_floor();
    inputs.material_degC.reset();
    EXPECT_THROW(positioning_budget(inputs, 1000.0), std::logic_error);
}

TEST(uncertainty, straightness_and_angles_have_no_length) {
    const budget known = transverse_budget(shop_floor(), 1750.0);
    EXPECT_FALSE(known.misalignment || known.temperature || known.expansion);
    EXPECT_TRUE(known.device && known.environment);
}

// Five runs: annex A of ISO 230-2 has 2 U_EVE for the repeatability in one direction.
TEST(uncertainty, the_environment_enters_each_figure_by_its_runs) {
    budget known;
    known.device = 3.0;
    known.environment = 1.0;
    const auto U = [&](char letter, approach which = approach::both) {
        return uncertainty_of(known, axis_of(5, 5, 0.0), letter, which);
    };
    EXPECT_DOUBLE_EQ(U('R', approach::forward), 2.0);
    EXPECT_DOUBLE_EQ(U('R'), 2.0);  // without a reversal it is that of one direction
    EXPECT_DOUBLE_EQ(uncertainty_of(known, axis_of(5, 5, 3.0), 'R', approach::both),
                     std::sqrt(2.4));
    EXPECT_DOUBLE_EQ(U('B'), std::sqrt(0.4));
    EXPECT_DOUBLE_EQ(U('E'), std::sqrt(9.0 + 0.4));
    EXPECT_DOUBLE_EQ(U('M'), std::sqrt(9.0 + 0.2));
    EXPECT_DOUBLE_EQ(U('A', approach::backward), std::sqrt(9.0 + 2.4));
    const axis_readings uneven = axis_of(2, 5, 0.0);
    EXPECT_DOUBLE_EQ(uncertainty_of(known, uneven, 'E', approach::forward), std::sqrt(10.0));
    EXPECT_DOUBLE_EQ(uncertainty_of(known, uneven, 'E', approach::backward), std::sqrt(9.4));
    EXPECT_THROW(U('Q'), std::logic_error);
}

// Three targets, one reading each: about the end points the middle one counts once, each end half.
TEST(uncertainty, straightness_weighs_each_mean_by_its_effect) {
    budget known;
    known.device = 0.0;
    known.environment = 1.0;
    const std::vector<double> x{0, 100, 200}, y{0, 3, 0};
    const double U = std::sqrt(1.0 + 0.25 + 0.25);
    EXPECT_NEAR(straightness_uncertainty(known, reference::end_point, x, y, {1, 1, 1}), U, 1e-12);
    EXPECT_NEAR(straightness_uncertainty(known, reference::minimum_zone, x, y, {4, 4, 4}), U / 2,
                1e-12);
    known.device = 2.0;
    EXPECT_NEAR(straightness_uncertainty(known, reference::end_point, x, y, {1, 1, 1}),
                std::sqrt(4.0 + U * U), 1e-12);
}

}  // namespace
