// SPDX-License-Identifier: MIT
// The volumetric model by hand: levers of known chains, signs, names, S1's superposition to the
// bit. All chains against full homogeneous matrices: tests/oracle/volumetric.py (conformance).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>

extern "C" {
#include "models/num.h"
#include "models/volumetric.h"
}

namespace {

[[maybe_unused]] constexpr int EXX = 0, EYX = 1, EZX = 2, EAX = 3, EBX = 4, ECX = 5;
[[maybe_unused]] constexpr int EXY = 6, EYY = 7, EZY = 8, EAY = 9, EBY = 10, ECY = 11;
[[maybe_unused]] constexpr int EXZ = 12, EYZ = 13, EZZ = 14, EAZ = 15, EBZ = 16, ECZ = 17;

cb_volumetric chain(const char *text) {
    cb_volumetric model{};
    EXPECT_TRUE(cb_volumetric_chain(text, model.moves)) << text;
    model.tool[2] = -1;
    return model;
}

// The positions that add to the lever of an axis, as text.
std::string levers(const char *text, int axis) {
    const cb_volumetric model = chain(text);
    std::string names;
    for (int c = 0; c < 3; ++c) {
        if (model.moves[axis] >> c & 1) names += "XYZ"[c];
    }
    return names;
}

// Read off the rule in DESIGN §6, chain by chain.
TEST(volumetric_chain, levers_by_hand) {
    const struct {
        const char *chain, *x, *y, *z;
    } rows[] = {
        {"fXYZ", "YZ", "Z", ""},     // gantry: everything carries the tool
        {"YfXZ", "Z", "XYZ", ""},    // moving table in Y: its own travel, and the tool side's
        {"XYfZ", "XYZ", "YZ", ""},   // cross table: X rides on Y
        {"YXfZ", "XZ", "XYZ", ""},   // Y rides on X
        {"ZYXf", "X", "XY", "XYZ"},  // everything carries the workpiece
        {"XfYZ", "XYZ", "Z", ""},   {"fZYX", "", "X", "XY"},
        {"ZfXY", "Y", "", "XYZ"},   {"XZfY", "XYZ", "", "YZ"},
    };
    for (const auto &row : rows) {
        EXPECT_EQ(levers(row.chain, 0), row.x) << row.chain;
        EXPECT_EQ(levers(row.chain, 1), row.y) << row.chain;
        EXPECT_EQ(levers(row.chain, 2), row.z) << row.chain;
    }
}

// Exactly the 24 arrangements of f, X, Y, Z, among all texts of up to five such letters.
TEST(volumetric_chain, accepts_the_24_and_nothing_else) {
    std::set<std::string> accepted;
    const std::string letters = "fXYZxFTW ";
    std::string text;
    const auto grow = [&](const auto &self) -> void {
        cb_volumetric model{};
        if (cb_volumetric_chain(text.c_str(), model.moves)) accepted.insert(text);
        if (text.size() == 5) return;
        for (char c : letters) {
            text.push_back(c);
            self(self);
            text.pop_back();
        }
    };
    grow(grow);
    std::set<std::string> expected;
    std::string s = "XYZf";
    do expected.insert(s);
    while (std::next_permutation(s.begin(), s.end()));
    EXPECT_EQ(accepted, expected);
    std::uint8_t moves[3];
    EXPECT_FALSE(cb_volumetric_chain("fXYZfXYZfXYZfXYZfXYZfXYZfXYZfXYZfXYZfXYZ", moves));
}

TEST(volumetric_error, names) {
    EXPECT_EQ(cb_volumetric_error("EXX"), EXX);
    EXPECT_EQ(cb_volumetric_error("ECX"), ECX);
    EXPECT_EQ(cb_volumetric_error("EXY"), EXY);
    EXPECT_EQ(cb_volumetric_error("EYZ"), EYZ);
    EXPECT_EQ(cb_volumetric_error("EBZ"), EBZ);
    EXPECT_EQ(cb_volumetric_error("C0Y"), CB_ERROR_C0Y);
    EXPECT_EQ(cb_volumetric_error("B0Z"), CB_ERROR_B0Z);
    EXPECT_EQ(cb_volumetric_error("A0Z"), CB_ERROR_A0Z);
    for (const char *name :
         {"", "E", "EX", "EXXX", "EXA", "EDX", "exx", "C0X", "C0Z", "CXY", "A0Y", "XXX"})
        EXPECT_EQ(cb_volumetric_error(name), -1) << name;
    std::set<int> all;
    for (char kind : std::string("XYZABC"))
        for (char axis : std::string("XYZ"))
            all.insert(cb_volumetric_error(std::string{'E', kind, axis}.c_str()));
    EXPECT_EQ(all.size(), 18u);
    EXPECT_EQ(*all.begin(), 0);
    EXPECT_EQ(*all.rbegin(), 17);
}

struct vec3 {
    float x, y, z;
};

vec3 evaluate(const cb_volumetric &model, const cb_volumetric_state &state) {
    float e[3];
    cb_volumetric_evaluate(&model, &state, e);
    return {e[0], e[1], e[2]};
}

// 100 µrad on a lever of 1000 mm is 100 µm; the direction by the right-hand rule.
TEST(volumetric, rotations_by_hand) {
    cb_volumetric model = chain("fXYZ");
    cb_volumetric_state state{};
    state.position_mm[CB_AXIS_Z] = 1000;
    state.error[EBX] = 100;  // pitch of X about +Y: a tip above the carriage goes to +X
    EXPECT_FLOAT_EQ(evaluate(model, state).x, 100);
    EXPECT_FLOAT_EQ(evaluate(model, state).z, 0);
    state.error[EBX] = 0;
    state.error[EAY] = 100;  // about +X: it goes to -Y
    EXPECT_FLOAT_EQ(evaluate(model, state).y, -100);
    state.error[EAY] = 0;
    state.error[EBZ] = 100;  // of Z itself: its own travel is no lever
    EXPECT_FLOAT_EQ(evaluate(model, state).x, 0);
    state.tool_mm = 200;  // but the tool is: 200 mm down
    EXPECT_FLOAT_EQ(evaluate(model, state).x, -20);
    model.lever_mm[CB_AXIS_Z][2] = -300;
    EXPECT_FLOAT_EQ(evaluate(model, state).x, -50);
}

// A table that carries the workpiece. The laser between tool and table shows +10 µrad about +Z:
// the tool turns by +10 against the table. At 500 mm from its reference point that is 5 µm.
TEST(volumetric, workpiece_side_by_hand) {
    cb_volumetric model = chain("XfYZ");
    cb_volumetric_state state{};
    state.position_mm[CB_AXIS_X] = 500;
    state.error[ECX] = 10;
    EXPECT_FLOAT_EQ(evaluate(model, state).y, 5);
    state.error[EYX] = 3;
    EXPECT_FLOAT_EQ(evaluate(model, state).y, 8);
    state.position_mm[CB_AXIS_Y] = 100;
    EXPECT_FLOAT_EQ(evaluate(model, state).x, -1);
}

TEST(volumetric, squareness_by_hand) {
    for (const char *text : {"fXYZ", "YfXZ", "XYfZ", "ZYXf"}) {
        cb_volumetric model = chain(text);
        model.lever_mm[0][2] = 777;  // levers and tool have no part in it
        cb_volumetric_state state{};
        state.tool_mm = 250;
        state.position_mm[CB_AXIS_X] = 900;
        state.position_mm[CB_AXIS_Y] = 2000;
        state.position_mm[CB_AXIS_Z] = 500;
        model.squareness_urad[0] = 10;  // C0Y: +Y leans to -X
        EXPECT_FLOAT_EQ(evaluate(model, state).x, -20);
        model.squareness_urad[0] = 0;
        model.squareness_urad[1] = 10;  // B0Z: +Z leans to +X
        EXPECT_FLOAT_EQ(evaluate(model, state).x, 5);
        model.squareness_urad[1] = 0;
        model.squareness_urad[2] = 10;  // A0Z: +Z leans to -Y
        EXPECT_FLOAT_EQ(evaluate(model, state).y, -5);
        EXPECT_FLOAT_EQ(evaluate(model, state).x, 0);
    }
}

TEST(volumetric, straightness_alone_is_S1_to_the_bit) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> um(-200, 200), mm(-3000, 14300);
    std::string text = "XYZf";
    do {
        cb_volumetric model = chain(text.c_str());
        for (int i = 0; i < 2000; ++i) {
            for (auto &row : model.lever_mm)
                for (float &x : row) x = mm(random);
            cb_volumetric_state state{};
            for (float &x : state.position_mm) x = mm(random);
            state.tool_mm = 200;
            for (int k : {EXY, EXZ, EYX, EYZ, EZX, EZY}) state.error[k] = um(random);
            const vec3 e = evaluate(model, state);
            const float *const d = state.error;
            ASSERT_EQ(cb_bits_of(e.x), cb_bits_of(d[EXY] + d[EXZ]));
            ASSERT_EQ(cb_bits_of(e.y), cb_bits_of(d[EYX] + d[EYZ]));
            ASSERT_EQ(cb_bits_of(e.z), cb_bits_of(d[EZX] + d[EZY]));
        }
    } while (std::next_permutation(text.begin(), text.end()));
}

// The slope for the tangent mode is that of the value when one axis moves and its curves with it.
TEST(volumetric, slope_by_differences) {
    std::mt19937 random(6);
    std::uniform_real_distribution<float> urad(-60, 60), mm(-500, 500), per_mm(-0.3f, 0.3f);
    std::string text = "XYZf";
    do {
        cb_volumetric model = chain(text.c_str());
        for (auto &row : model.lever_mm)
            for (float &x : row) x = mm(random);
        for (float &x : model.squareness_urad) x = urad(random);
        for (int axis = 0; axis < 3; ++axis) {
            cb_volumetric_state state{};
            for (float &x : state.position_mm) x = mm(random);
            for (float &x : state.error) x = urad(random);
            cb_volumetric_state rate{};
            float *const slope = rate.error + axis * 6, d[3];
            rate.position_mm[axis] = 1;
            for (int k = 0; k < 6; ++k) slope[k] = per_mm(random);
            cb_volumetric_derivative(&model, &state, &rate, d);
            cb_volumetric_state up = state, down = state;
            up.position_mm[axis] += 8;
            down.position_mm[axis] -= 8;
            for (int k = 0; k < 6; ++k) {
                up.error[axis * 6 + k] += 8 * slope[k];
                down.error[axis * 6 + k] -= 8 * slope[k];
            }
            const vec3 a = evaluate(model, up), b = evaluate(model, down);
            ASSERT_NEAR(d[0], (a.x - b.x) / 16, 2e-5) << text << axis;
            ASSERT_NEAR(d[1], (a.y - b.y) / 16, 2e-5) << text << axis;
            ASSERT_NEAR(d[2], (a.z - b.z) / 16, 2e-5) << text << axis;
        }
    } while (std::next_permutation(text.begin(), text.end()));
}

}  // namespace
