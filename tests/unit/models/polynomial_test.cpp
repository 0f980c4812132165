// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

extern "C" {
#include "models/polynomial.h"
}

#include "tests/support/not_finite.h"

namespace {

using compbox_test::infinity;
using compbox_test::not_a_number;

TEST(Polynomial, ValueAndSlopeOfAKnownOne) {
    const float a[] = {1, -2, 3};  // 1 - 2u + 3u^2, u = (x - 10) / 4
    const cb_polynomial p{a, 10.0f, 0.25f, 6.0f, 14.0f, 2};
    const cb_curve_value got = cb_polynomial_evaluate(&p, 12.0f);
    EXPECT_EQ(got.value, 1 - 1 + 0.75f);
    EXPECT_EQ(got.slope, (-2 + 3) * 0.25f);
    EXPECT_FALSE(got.outside);
    EXPECT_EQ(cb_polynomial_evaluate(&p, 6.0f).value, 6.0f);
    EXPECT_EQ(cb_polynomial_evaluate(&p, 14.0f).value, 2.0f);
    EXPECT_FALSE(cb_polynomial_evaluate(&p, 14.0f).outside);
}

TEST(Polynomial, OutsideHoldsTheEndValueWithSlopeZero) {
    const float a[] = {0, 1};
    const cb_polynomial p{a, 0.0f, 1.0f, -2.0f, 3.0f, 1};
    for (const float x : {-infinity, -1e38f, std::nextafterf(-2.0f, -3.0f), not_a_number}) {
        const cb_curve_value got = cb_polynomial_evaluate(&p, x);
        EXPECT_EQ(got.value, -2.0f) << x;
        EXPECT_EQ(got.slope, 0.0f) << x;
        EXPECT_TRUE(got.outside) << x;
    }
    EXPECT_EQ(cb_polynomial_evaluate(&p, infinity).value, 3.0f);
    EXPECT_TRUE(cb_polynomial_evaluate(&p, infinity).outside);
}

TEST(Polynomial, ConstantHasNoSlope) {
    const float a[] = {-7.5f};
    const cb_polynomial p{a, 3.0f, 2.0f, 0.0f, 1.0f, 0};
    EXPECT_EQ(cb_polynomial_evaluate(&p, 0.5f).value, -7.5f);
    EXPECT_EQ(cb_polynomial_evaluate(&p, 0.5f).slope, 0.0f);
}

TEST(Polynomial, ErrorStaysInsideTheStatedBound) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> size(-200, 200), place(0, 14300);
    long double worst = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        std::vector<float> a(1 + random() % (CB_POLYNOMIAL_MAX_DEGREE + 1));
        for (float &v : a) v = size(random);
        const float inverse = 1.0f / 7150.0f;
        const cb_polynomial p{a.data(), 7150.0f,  inverse,
                              0.0f,     14300.0f, static_cast<uint8_t>(a.size() - 1)};
        const float x = trial % 3 == 0 ? 14300.0f : place(random);
        const long double u = (static_cast<long double>(x) - 7150.0L) * inverse;
        long double value = 0, slope = 0, value_sum = 0, slope_sum = 0, power = 1;
        for (size_t k = 0; k < a.size(); ++k, power *= u) {
            const long double n = static_cast<long double>(k);
            value += a[k] * power;
            value_sum += (4 * n + 1) * std::fabs(a[k] * power);
            if (k + 1 >= a.size()) continue;
            slope += (n + 1) * a[k + 1] * power * inverse;
            slope_sum += (n + 1) * (4 * n + 5) * std::fabs(a[k + 1] * power) * inverse;
        }
        const cb_curve_value got = cb_polynomial_evaluate(&p, x);
        const long double error = std::fabs(got.value - value);
        ASSERT_LE(error, 1.001L * 0x1p-24L * value_sum);
        ASSERT_LE(std::fabs(got.slope - slope), 1.001L * 0x1p-24L * slope_sum);
        worst = std::max(worst, error / (0x1p-24L * value_sum));
    }
    EXPECT_GT(worst, 0.3L) << "the bound is too loose to mean anything";
}

TEST(Polynomial, FiniteRefusesWhatOverflowsWithinTheRange) {
    const auto finite = [](std::vector<float> a, float center, float inverse, float to) {
        const cb_polynomial p{a.data(), center, inverse,
                              0.0f,     to,     static_cast<uint8_t>(a.size() - 1)};
        return cb_polynomial_is_finite(&p);
    };
    EXPECT_TRUE(finite({1, 1, 1, 1}, 0, 1, 2500));
    EXPECT_TRUE(finite(std::vector<float>(16, 1e30f), 1000, 1e-3f, 2000));
    EXPECT_FALSE(finite(std::vector<float>(16, 1.0f), 0, 1, 2500));  // 2500^15
    EXPECT_FALSE(finite({1, infinity}, 0, 1, 1));
    EXPECT_FALSE(finite({not_a_number, 1}, 0, 1, 1));
    EXPECT_FALSE(finite({1}, 0, 1e38f, 1e38f));        // u itself
    EXPECT_FALSE(finite({0, 1e38f}, 0, 10, 0.1f));     // the slope only
    EXPECT_FALSE(finite({0, 0, 1e37f}, 100, 1, 101));  // far below the centre only
}

TEST(Polynomial, FiniteIsAPromiseForEveryX) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> part(-1, 1);
    int promised = 0;
    for (int trial = 0; trial < 5000; ++trial) {
        std::vector<float> a(1 + random() % 8);
        for (float &v : a) v = std::ldexp(part(random), static_cast<int>(random() % 127));
        const float reach = std::ldexp(1.0f, static_cast<int>(random() % 12));
        const cb_polynomial p{a.data(), 0.0f,  1.0f,
                              -reach,   reach, static_cast<uint8_t>(a.size() - 1)};
        if (!cb_polynomial_is_finite(&p)) continue;
        ++promised;
        for (const float at : {-1.0f, part(random), 0.0f, 1.0f}) {
            const cb_curve_value got = cb_polynomial_evaluate(&p, at * reach);
            ASSERT_TRUE(std::isfinite(got.value) && std::isfinite(got.slope));
        }
    }
    EXPECT_GT(promised, 500);
    EXPECT_LT(promised, 4500);
}

}  // namespace
