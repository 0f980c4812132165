// SPDX-License-Identifier: MIT
// The play operator: path only, no time, no steps; and the blend of two branches with its slope.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

extern "C" {
#include "models/direction.h"
}

namespace {

constexpr float width = 0.5f;

struct mover {
    cb_direction direction;
    float x;

    explicit mover(float start) : x(start) { cb_direction_start(&direction, start, width); }
    float to(float target) { return cb_direction_step(&direction, x = target, width); }
};

TEST(direction, by_hand) {
    mover m(10);
    EXPECT_EQ(m.direction.blend, 0.0f);
    EXPECT_EQ(m.to(10), 0.0f);
    EXPECT_EQ(m.to(10.125f), 0.5f);  // half the way to the forward branch
    EXPECT_EQ(m.to(10.25f), 1.0f);
    EXPECT_EQ(m.to(500), 1.0f);
    EXPECT_EQ(m.to(499.875f), 0.5f);
    EXPECT_EQ(m.to(500), 1.0f);  // back inside the play: the same way
    EXPECT_EQ(m.to(499.75f), 0.0f);
    EXPECT_EQ(m.to(499.5f), -1.0f);
    EXPECT_EQ(m.to(3), -1.0f);
    EXPECT_EQ(m.to(3.125f), -0.5f);
    EXPECT_EQ(m.to(2.875f), -1.0f);
    EXPECT_EQ(m.to(3.5f), 1.0f);
}

// The other way from an unknown direction.
TEST(direction, starts_in_the_middle) {
    mover m(-3);
    EXPECT_EQ(m.to(-3.125f), -0.5f);
    EXPECT_EQ(m.to(-3.25f), -1.0f);
}

// Against the textbook operator: a centre that x drags along, in double.
TEST(direction, equals_a_play_operator) {
    std::mt19937 random(1);
    std::normal_distribution<float> small(0, 0.1f), large(0, 5);
    mover m(7150);
    double centre = 7150, half = width / 2;
    for (int i = 0; i < 200000; ++i) {
        const float x = m.x + (i % 100 == 0 ? large(random) : small(random));
        const float b = m.to(x);
        centre = std::min(std::max(centre, x - half), x + half);
        ASSERT_NEAR(b, (x - centre) / half, 1e-5) << i;
        ASSERT_TRUE(b >= -1 && b <= 1);
    }
}

TEST(direction, never_steps) {
    std::mt19937 random(2);
    std::normal_distribution<float> step(0, 0.03f);
    mover m(100);
    float before = 0;
    for (int i = 0; i < 200000; ++i) {
        const float x = m.x + step(random), moved = std::fabs(x - m.x), b = m.to(x);
        ASSERT_LE(std::fabs(b - before), 2 * moved / width + 1e-5f);
        before = b;
    }
}

// Trembling by encoder counts for days changes nothing in the end; neither does standing.
TEST(direction, nothing_accumulates) {
    mover m(1234.5f);
    m.to(1300);
    const float there = m.to(1299.8f);
    std::mt19937 random(3);
    for (int i = 0; i < 1000000; ++i) m.to(1299.8f + 1e-3f * float(int(random() % 5) - 2));
    EXPECT_EQ(m.to(1299.8f), there);
}

TEST(direction, a_nan_changes_nothing) {
    mover m(0);
    m.to(10);
    const float b = m.to(9.9f);
    EXPECT_EQ(cb_direction_step(&m.direction, NAN, width), b);
    EXPECT_EQ(m.to(9.9f), b);
}

// Branches of a lead screw with 12 µm of lost motion, each with a slope of its own.
cb_curve_value forward(float x) {
    return {6 + 0.02f * x, 0.02f, false};
}
cb_curve_value backward(float x) {
    return {-6 + 0.03f * x, 0.03f, false};
}

TEST(direction, a_branch_is_exact_at_its_end) {
    mover m(50);
    m.to(60);
    cb_curve_value v = cb_direction_blend(&m.direction, width, forward(60), backward(60));
    EXPECT_EQ(v.value, forward(60).value);
    EXPECT_EQ(v.slope, forward(60).slope);
    m.to(10);
    v = cb_direction_blend(&m.direction, width, forward(10), backward(10));
    EXPECT_EQ(v.value, backward(10).value);
    EXPECT_EQ(v.slope, backward(10).slope);
    cb_curve_value outside = forward(10);
    outside.outside = true;
    EXPECT_TRUE(cb_direction_blend(&m.direction, width, outside, backward(10)).outside);
    EXPECT_TRUE(cb_direction_blend(&m.direction, width, backward(10), outside).outside);
}

// The slope during a reversal is that of the value along the path.
TEST(direction, slope_by_differences) {
    mover m(0);
    m.to(100);
    const float h = 1.0f / 64;
    for (float x = 100 - 2 * h; x > 99.5f + 2 * h; x -= h) {
        mover up = m, here = m, down = m;
        up.to(x + h), here.to(x), down.to(x - h);
        const auto value = [](const mover &v) {
            return cb_direction_blend(&v.direction, width, forward(v.x), backward(v.x)).value;
        };
        const float by_difference = (value(up) - value(down)) / (2 * h);
        const cb_curve_value v =
            cb_direction_blend(&here.direction, width, forward(x), backward(x));
        ASSERT_NEAR(v.slope, by_difference, 2e-3) << x;
    }
}

}  // namespace
