// SPDX-License-Identifier: MIT
// The twin's geometry against the formulas of the papers, written out here: lever arms of every
// chain, S2's carriage, S4's stages with two drives; and the part that nobody can learn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host-tools/twin/machine.h"
#include "host-tools/twin/motion.h"

namespace compbox::twin {
namespace {

twin_config plain() {
    twin_config config;
    for (auto &axis : config.axes) {
        axis.present = true;
        axis.max_mm = 1000.0;
        axis.cutoff_mm = 200.0;
        axis.max_velocity_mm_per_s = 100.0;
        axis.acceleration_mm_per_s2 = 500.0;
    }
    config.chain.tool_mm = {10.0, -20.0, -150.0};
    config.chain.reference_mm = {xyz{0, 100, 200}, xyz{-300, 0, 50}, xyz{7, 8, 9}};
    return config;
}

// A curve that has the same value everywhere.
twin_error constant(double value) {
    twin_error error;
    error.points = {{0.0, value}, {1000.0, value}};
    return error;
}

xyz cross(const xyz &a, const xyz &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// From the reference of an axis' carriage to the tip of the tool (docs/DESIGN.md, volumetric).
xyz lever(const twin_chain &chain, std::size_t axis, const xyz &position) {
    const auto place = [&](std::size_t a) { return chain.order.find(axis_letters[a]); };
    const auto foundation = chain.order.find('f');
    xyz arm = chain.tool_mm;
    for (std::size_t i = 0; i < 3; ++i) arm[i] -= chain.reference_mm[axis][i];
    for (std::size_t a = 0; a < 3; ++a) {
        const bool tool_side = place(axis) > foundation;
        const bool moves =
            tool_side ? place(a) > place(axis) : place(a) >= place(axis) || a == axis;
        if (moves) arm[a] += position[a];
    }
    return arm;
}

TEST(Geometry, RotationsActByTheirLeverArmsInEveryChain) {
    const xyz position = {700.0, 300.0, 450.0};
    for (const char *order : {"fXYZ", "fZYX", "YfXZ", "XYfZ", "ZYXf"}) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t turn = 0; turn < 3; ++turn) {
                twin_config config = plain();
                config.chain.order = order;
                const std::string name = std::string("E") + "ABC"[turn] + axis_letters[axis];
                config.errors[name] = constant(10.0);
                xyz angle = {};
                angle[turn] = 10.0e-3;  // µm/mm
                const xyz expected = cross(angle, lever(config.chain, axis, position));
                const xyz found = twin_machine(config).true_error_um(position);
                for (std::size_t i = 0; i < 3; ++i) {
                    EXPECT_NEAR(found[i], expected[i], 2e-4) << order << " " << name;
                }
            }
        }
    }
}

TEST(Geometry, SquarenessTiltsTheTravel) {
    twin_config config = plain();
    config.chain.c0y_urad = 20.0;
    config.chain.b0z_urad = -10.0;
    config.chain.a0z_urad = 5.0;
    const xyz found = twin_machine(config).true_error_um({700.0, 300.0, 450.0});
    EXPECT_NEAR(found[0], -20.0e-3 * 300.0 - 10.0e-3 * 450.0, 1e-3);  // C0Y > 0 opens X to Y
    EXPECT_NEAR(found[1], -5.0e-3 * 450.0, 1e-3);
    EXPECT_NEAR(found[2], 0.0, 1e-3);
}

TEST(Geometry, ACarriageMovesAsS2Says) {
    twin_config config = plain();
    const double e[6] = {3.0, -5.0, 7.0, 12.0, -9.0, 4.0};
    for (std::size_t k = 0; k < 6; ++k) {
        config.errors[std::string("E") + "XYZABC"[k] + "Y"] = constant(e[k]);
    }
    const double X = 120.0, Y = -80.0, Z = 300.0;
    const xyz found = twin_machine(config).geometry().carriage_point_um(1, {X, Y, Z}, 400.0);
    EXPECT_NEAR(found[0], e[0] + 1e-3 * (Z * e[4] - Y * e[5]), 1e-4);
    EXPECT_NEAR(found[1], e[1] + 1e-3 * (X * e[5] - Z * e[3]), 1e-4);
    EXPECT_NEAR(found[2], e[2] + 1e-3 * (Y * e[3] - X * e[4]), 1e-4);
}

// ---- curves

TEST(GivenCurve, PassesItsPointsAndGoesOnStraight) {
    const given_curve curve({{0.0, 1.0}, {10.0, 3.0}, {30.0, -2.0}, {40.0, 0.0}});
    EXPECT_DOUBLE_EQ(curve(0.0), 1.0);
    EXPECT_NEAR(curve(10.0), 3.0, 1e-12);
    EXPECT_NEAR(curve(30.0), -2.0, 1e-12);
    EXPECT_NEAR(curve(40.0), 0.0, 1e-12);
    const double h = 1e-4;
    for (const double x : {10.0, 30.0}) {  // smooth: first and second derivative go on
        EXPECT_NEAR((curve(x + h) - curve(x)) / h, (curve(x) - curve(x - h)) / h, 1e-3);
        const auto bend = [&](double at) {
            return (curve(at + 0.1) - 2.0 * curve(at) + curve(at - 0.1)) / 0.01;
        };
        EXPECT_NEAR(bend(x - 0.1), bend(x + 0.1), 0.02);
    }
    EXPECT_NEAR(curve(50.0) - curve(45.0), curve(45.0) - curve(40.0), 1e-9);
    EXPECT_NEAR(curve(-10.0) - curve(-5.0), curve(-5.0) - curve(0.0), 1e-9);
    const given_curve line({{0.0, 1.0}, {10.0, 3.0}});
    EXPECT_DOUBLE_EQ(line(5.0), 2.0);
}

TEST(ErrorCurve, StandsOnItsLine) {
    twin_config config = plain();
    twin_error error;
    error.amplitude = 8.0;
    config.errors["EXX"] = error;
    const twin_machine bare(config);
    config.errors["EXX"].slope_per_mm = -0.5;
    config.errors["EXX"].offset = 3.0;
    const twin_machine sloped(config);
    EXPECT_DOUBLE_EQ(sloped.curve_um("EXX", 200.0), bare.curve_um("EXX", 200.0) - 97.0);
}

// ---- two drives

twin_config table() {
    twin_config config = plain();
    config.chain = {};
    config.axes[2] = {};
    config.chain.order = "fXY";
    twin_stage x;
    x.drives = {"X1", "X2"};
    x.span_mm = 200.0;
    x.errors = {constant(10.0), constant(4.0)};
    config.stages[0] = x;
    return config;
}

TEST(DualDrive, TheMiddleMovesByTheMeanAndTheDifferenceYaws) {
    const twin_machine twin(table());
    const xyz centre = twin.true_error_um({500.0, 0.0, 0.0});
    EXPECT_NEAR(centre[0], 7.0, 1e-5);
    const xyz aside = twin.true_error_um({500.0, 50.0, 0.0});  // 6 µm over 200 mm: 30 µrad
    EXPECT_NEAR(aside[0], 7.0 - 1.5, 1e-3);
}

TEST(DualDrive, CorrectedSideBySideItDoesNotYaw) {
    const twin_machine twin(table());
    twin_state state = state_at({500.0, 50.0, 0.0});
    state.drive_um[0] = {-10.0, -4.0};
    EXPECT_NEAR(twin.true_error_um(state)[0], 0.0, 1e-6);
    state.drive_um[0] = {-7.0, -7.0};  // by the mean alone the yaw stays
    EXPECT_NEAR(twin.true_error_um(state)[0], -1.5, 1e-3);
}

TEST(DualDrive, EachDriveTakesCompensationOverAtItsOwnPace) {
    twin_config config = table();
    nc_motion nc(config);
    const double step_um = nc.max_step_um(0);
    nc.set_compensation_um({0.0, 0.0, 0.0});
    nc.set_drive_difference_um({4.0 * step_um, 0.0, 0.0});
    nc.step();
    EXPECT_DOUBLE_EQ(nc.state().drive_um[0][0], -step_um);
    EXPECT_DOUBLE_EQ(nc.state().drive_um[0][1], step_um);
    nc.step();
    EXPECT_DOUBLE_EQ(nc.state().drive_um[0][1], 2.0 * step_um);
    EXPECT_DOUBLE_EQ(nc.displacement_um()[0], 0.0);
}

// ---- the unexplained part

TEST(Unexplained, HasItsShareOfTheRangeAndIsAnotherTomorrow) {
    twin_config config = plain();
    config.errors["EXX"].amplitude = 100.0;
    config.errors["EYX"].amplitude = 40.0;
    config.unexplained_percent = 1.5;
    const twin_machine twin(config);
    random_stream place(9, "test");
    double low[3] = {}, high[3] = {}, today_tomorrow = 0.0, today_today = 0.0;
    for (int i = 0; i < 3000; ++i) {
        twin_state state = state_at({1000.0 * place.uniform(), 1000.0 * place.uniform(), 1.0});
        state.time_s = 3600.0 * place.uniform();
        const auto part = [&] {
            const xyz all = twin.true_error_um(state), known = twin.explained_error_um(state);
            return xyz{all[0] - known[0], all[1] - known[1], all[2] - known[2]};
        };
        const xyz today = part();
        state.time_s += 86400.0;
        today_tomorrow += today[0] * part()[0];
        today_today += today[0] * today[0];
        for (std::size_t d = 0; d < 3; ++d) {
            low[d] = std::min(low[d], today[d]);
            high[d] = std::max(high[d], today[d]);
        }
    }
    EXPECT_NEAR(high[0] - low[0], 1.5, 0.4);
    EXPECT_NEAR(high[1] - low[1], 0.6, 0.2);
    EXPECT_NEAR(high[2] - low[2], 0.0, 1e-6);
    EXPECT_LT(std::fabs(today_tomorrow), 0.6 * today_today);
}

TEST(Unexplained, NoneIsNone) {
    twin_config config = plain();
    config.errors["EXX"].amplitude = 100.0;
    const twin_machine twin(config);
    const twin_state state = state_at({300.0, 0.0, 0.0});
    EXPECT_EQ(twin.true_error_um(state), twin.explained_error_um(state));
}

}  // namespace
}  // namespace compbox::twin
