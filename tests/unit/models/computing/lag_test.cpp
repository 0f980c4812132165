// SPDX-License-Identifier: MIT
// Lags of minutes to hours at 1 ms and 30 ms against the exact solution of the differential
// equation, over whole runs. The exact solution is written from the equation (long double, closed
// form per straight piece), not from the recursion under test.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

extern "C" {
#include "models/lag.h"
#include "tests/support/lag_step.h"
}

namespace {

// The differential equation solved over one straight piece of its input.
struct exact_lag {
    long double tau, y, u;

    void straight_to(long double next, long double dt) {
        const long double slope = (next - u) / dt;
        const long double steady = u - slope * tau;  // of the ramp, at its beginning
        y = steady + slope * dt + (y - steady) * expl(-dt / tau);
        u = next;
    }
};

struct course {
    float tau, dt;
};

void PrintTo(const course &c, std::ostream *out) {
    *out << "tau " << c.tau << " dt " << c.dt;
}

class lag_courses : public testing::TestWithParam<course> {};

// A step of 60 °C in the first interval, then constant: every tau on the way and at the end.
TEST_P(lag_courses, follows_a_step_and_settles_exactly) {
    const auto [tau, dt] = GetParam();
    const cb_lag_gains gains = cb_lag_gains_for(dt, tau);
    const auto steps_per_tau = std::max<std::int64_t>(1, std::int64_t(tau / dt));
    cb_lag lag;
    cb_lag_start(&lag, 20.3f);
    exact_lag exact{tau, 20.3f, 20.3f};
    lag_step(&lag, gains, 80.7f);
    exact.straight_to(80.7f, dt);
    for (int k = 1; k <= 20; ++k) {
        for (std::int64_t i = 0; i < steps_per_tau; ++i) lag_step(&lag, gains, 80.7f);
        exact.straight_to(80.7f, (long double)dt * steps_per_tau);
        ASSERT_NEAR(lag.hi, (double)exact.y, 3e-7 * 80.7) << "after " << k << " tau";
    }
    EXPECT_EQ(lag.hi, 80.7f);
}

// Up, down and a slow day: straight pieces as long as tau / 2, sampled every dt.
TEST_P(lag_courses, follows_a_day_of_ramps) {
    const auto [tau, dt] = GetParam();
    const cb_lag_gains gains = cb_lag_gains_for(dt, tau);
    const int per_piece = std::max(1, int(tau / dt / 2));
    const float pieces[] = {35, 35, 12, 60, 59, 20, 20.5f, 20};
    cb_lag lag;
    cb_lag_start(&lag, 22);
    exact_lag exact{tau, 22, 22};
    float from = 22;
    for (float to : pieces) {
        float u = from;
        for (int i = 1; i <= per_piece; ++i) {
            const float next = from + (to - from) * (float(i) / float(per_piece));
            lag_step(&lag, gains, next);
            u = next;
        }
        exact.straight_to(to, (long double)dt * per_piece);
        ASSERT_EQ(u, to);
        ASSERT_NEAR(lag.hi, (double)exact.y, 3e-7 * 60);
        from = to;
    }
}

INSTANTIATE_TEST_SUITE_P(machines, lag_courses,
                         testing::Values(course{600, 0.03f}, course{1800, 0.03f},
                                         course{7200, 0.03f}, course{600, 0.001f},
                                         course{7200, 0.001f}, course{600, 1}, course{600, 60},
                                         course{7200, 1e4f}));

// The compensated pair is what makes it work: one float stalls (shown, so that the reason stays).
TEST(lag, one_float_would_stall) {
    const cb_lag_gains gains = cb_lag_gains_for(0.03f, 7200);
    float plain = 20;
    for (int i = 0; i < 4800000; ++i) plain += gains.gain * (80 - plain);
    EXPECT_GT(80 - plain, 0.1f);
}

// Real cycles: jitter, missed ticks, pauses of minutes; the input is any walk.
TEST(lag, any_step_lengths_any_input) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> jitter(0.02f, 0.04f), change(-0.5f, 0.5f);
    for (float tau : {5.0f, 600.0f, 3600.0f}) {
        cb_lag lag;
        cb_lag_start(&lag, 20);
        exact_lag exact{tau, 20, 20};
        float u = 20;
        for (int i = 0; i < 300000; ++i) {
            float dt = jitter(random);
            if (i % 997 == 0) dt = 3 * dt;
            if (i % 50021 == 0) dt = 400;
            if (i % 3 == 0) u = std::min(90.0f, std::max(-10.0f, u + change(random)));
            lag_step(&lag, cb_lag_gains_for(dt, tau), u);
            exact.straight_to(u, dt);
            ASSERT_NEAR(lag.hi, (double)exact.y, 3e-7 * 90) << i;
        }
    }
}

// The square of a spindle speed, in (1/min)^2: sizes of 1e9 keep their relative accuracy.
TEST(lag, of_a_square_and_in_a_chain) {
    const cb_lag_gains fast = cb_lag_gains_for(0.03f, 600), slow = cb_lag_gains_for(0.03f, 3600);
    cb_lag first, second;
    cb_lag_start(&first, 0);
    cb_lag_start(&second, 0);
    const float square = 24000.0f * 24000.0f;
    const int steps = 400000;
    for (int i = 0; i < steps; ++i) lag_step(&second, slow, lag_step(&first, fast, square));
    // two lags in series, step response; the step itself is a ramp over the first 30 ms
    const double t = steps * 0.03 - 0.015, a = 600, b = 3600;
    const double y = square * (1 - (a * std::exp(-t / a) - b * std::exp(-t / b)) / (a - b));
    EXPECT_NEAR(second.hi / y, 1, 3e-7);
}

TEST(lag, gains_keep_their_relative_accuracy) {
    for (double h = 1e-9; h < 200; h *= 1.0007) {
        const float dt = float(h * 512), tau = 512;
        const long double exact_h = (long double)dt / tau;
        const cb_lag_gains gains = cb_lag_gains_for(dt, tau);
        const long double gain = -expm1l(-exact_h);
        // 1 - gain/h by its series, where the subtraction would lose digits
        long double ramp = 1 - gain / exact_h;
        if (exact_h < 0.1L) {
            long double term = exact_h / 2;
            ramp = 0;
            for (int k = 3; k < 20; ++k) {
                ramp += term;
                term *= -exact_h / k;
            }
        }
        ASSERT_NEAR(gains.gain / (double)gain, 1, 2 * 0x1p-23) << h;
        ASSERT_NEAR(gains.ramp / (double)ramp, 1, 4 * 0x1p-23) << h;
    }
}

TEST(lag, time_that_stands_still_or_never_ends) {
    for (float dt : {0.0f, -1.0f, -INFINITY, NAN}) {
        const cb_lag_gains gains = cb_lag_gains_for(dt, 600);
        EXPECT_EQ(gains.gain, 0.0f) << dt;
        EXPECT_EQ(gains.ramp, 0.0f) << dt;
    }
    const cb_lag_gains gains = cb_lag_gains_for(INFINITY, 600);
    EXPECT_EQ(gains.gain, 1.0f);
    EXPECT_EQ(gains.ramp, 1.0f);
    cb_lag lag;
    cb_lag_start(&lag, 20);
    EXPECT_EQ(lag_step(&lag, gains, 35.5f), 35.5f);
}

TEST(lag, nothing_that_is_not_finite_enters) {
    const cb_lag_gains gains = cb_lag_gains_for(10, 600);
    cb_lag lag, same;
    cb_lag_start(&lag, 20);
    lag_step(&lag, gains, 40);
    same = lag;
    for (float u : {NAN, INFINITY, -INFINITY}) {
        EXPECT_EQ(lag_step(&lag, gains, u), lag_step(&same, gains, 40));
        EXPECT_EQ(lag.input, 40.0f);
    }
}

// Settles on the very input, from both sides, 0 and the smallest temperatures included.
TEST(lag, arrives_everywhere) {
    const cb_lag_gains gains = cb_lag_gains_for(0.03f, 60);
    for (float u : {0.0f, 1e-3f, -1e-3f, 20.0f, -273.15f, 5.76e8f}) {
        for (float start : {-40.0f, 0.0f, 95.0f}) {
            cb_lag lag;
            cb_lag_start(&lag, start);
            for (int i = 0; i < 2000 * 120; ++i) lag_step(&lag, gains, u);
            EXPECT_EQ(lag.hi, u);
            EXPECT_EQ(lag.lo, 0.0f);
        }
    }
}

// Between two steps the output stays between the old and the new input: no overshoot, ever.
TEST(lag, never_overshoots) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> value(-50, 150), exponent(-6, 3);
    for (int i = 0; i < 200000; ++i) {
        cb_lag lag;
        const float start = value(random), u = value(random);
        cb_lag_start(&lag, start);
        const cb_lag_gains gains = cb_lag_gains_for(std::pow(10.0f, exponent(random)), 1);
        for (int k = 0; k < 3; ++k) {
            const float y = lag_step(&lag, gains, u);
            ASSERT_GE(y, std::min(start, u));
            ASSERT_LE(y, std::max(start, u));
        }
    }
}

}  // namespace
