// SPDX-License-Identifier: MIT
// Stated bounds, monotony, symmetry and ends of models/transcendental.h against double libm.
// Every 31st float around which the functions live, and all the seams; every float there is with
// COMPBOX_LONG_TESTS=1 (minutes; scripts/test --long).
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

extern "C" {
#include "models/transcendental.h"
}

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// All floats in ascending order as integers, -0 and +0 both 0.
std::int64_t order(float x) {
    const std::uint32_t bits = cb_bits_of(x);
    const std::int64_t size = bits & 0x7FFFFFFFu;
    return bits >> 31 ? -size : size;
}

float at(std::int64_t place) {
    return cb_float_of(place < 0 ? std::uint32_t(-place) | 0x80000000u : std::uint32_t(place));
}

// Error in units of the float spacing at the exact value; what overflows must be infinite.
double ulps(float got, double exact) {
    if (std::fabs(exact) >= FLT_MAX + 0x1p103) return std::isinf(got) ? 0.0 : HUGE_VAL;
    int exponent = -125;
    if (exact != 0) std::frexp(exact, &exponent);
    return std::fabs(got - exact) / std::ldexp(1.0, std::max(exponent, -125) - 24);
}

struct range {
    float from, to;
};

// Walks the floats of a range by `stride`: bound in ulp, and never falling.
void walk(float (*function)(float), double (*exact)(double), range r, double bound, int stride) {
    double worst = 0;
    float worst_at = 0, before = -infinity;
    for (std::int64_t i = order(r.from); i <= order(r.to); i += stride) {
        const float x = at(i), y = function(x);
        if (!(y >= before)) FAIL() << "falls at " << std::hexfloat << x;
        before = y;
        const double error = ulps(y, exact(x));
        if (error > worst) worst = error, worst_at = x;
    }
    EXPECT_LE(worst, bound) << "ulp, at " << std::hexfloat << worst_at;
}

// The 8 192 neighbours on each side, one by one: where two formulas meet.
void walk_seam(float (*function)(float), double (*exact)(double), float x, double bound) {
    walk(function, exact, {at(order(x) - 8192), at(order(x) + 8192)}, bound, 1);
}

double exact_tanh(double x) {
    return std::tanh(x);
}
double exact_rest(double x) {
    return x > 0 ? -std::expm1(-x) : 0;
}

constexpr double tanh_bound = 2.3, rest_bound = 1.1;

TEST(transcendental, tanh_within_its_bound_and_monotone) {
    walk(cb_tanh, exact_tanh, {-10, -0x1p-14f}, tanh_bound, 31);
    walk(cb_tanh, exact_tanh, {0x1p-14f, 10}, tanh_bound, 31);
    walk(cb_tanh, exact_tanh, {-FLT_MAX, FLT_MAX}, tanh_bound, 65521);
    for (float x : {0.0f, 0.549306154f, 9.01f, 9.25f}) {
        walk_seam(cb_tanh, exact_tanh, x, tanh_bound);
        walk_seam(cb_tanh, exact_tanh, -x, tanh_bound);
    }
    for (int n = 1; n <= 26; ++n)  // where the exponent of e^2x changes
        walk_seam(cb_tanh, exact_tanh, float((n - 0.5) * std::log(2.0) / 2), tanh_bound);
}

TEST(transcendental, one_minus_exp_within_its_bound_and_monotone) {
    walk(cb_one_minus_exp, exact_rest, {0, 20}, rest_bound, 1009);
    walk(cb_one_minus_exp, exact_rest, {0x1p-10f, 20}, rest_bound, 31);
    walk(cb_one_minus_exp, exact_rest, {-FLT_MAX, FLT_MAX}, rest_bound, 65521);
    for (int n = 0; n <= 26; ++n)
        walk_seam(cb_one_minus_exp, exact_rest, float((n + 0.5) * std::log(2.0)), rest_bound);
    walk_seam(cb_one_minus_exp, exact_rest, 18, rest_bound);
}

TEST(transcendental, every_float_there_is) {
    if (!std::getenv("COMPBOX_LONG_TESTS")) GTEST_SKIP() << "set COMPBOX_LONG_TESTS=1";
    const range all = {-infinity, infinity};
    walk(cb_tanh, exact_tanh, all, tanh_bound, 1);
    walk(cb_one_minus_exp, exact_rest, all, rest_bound, 1);
}

TEST(transcendental, tanh_is_odd_to_the_bit) {
    std::mt19937 random(1);
    for (int i = 0; i < 200000; ++i) {
        const std::uint32_t bits = random() & 0x7FFFFFFFu;
        const std::uint32_t plus = cb_bits_of(cb_tanh(cb_float_of(bits)));
        const std::uint32_t minus = cb_bits_of(cb_tanh(cb_float_of(bits | 0x80000000u)));
        if (bits > 0x7F800000u) continue;  // NaN
        ASSERT_EQ(plus ^ minus, 0x80000000u) << bits;
    }
    EXPECT_EQ(cb_bits_of(cb_tanh(-0.0f)), 0x80000000u);
    EXPECT_EQ(cb_bits_of(cb_tanh(0.0f)), 0u);
}

TEST(transcendental, ends) {
    EXPECT_EQ(cb_tanh(infinity), 1.0f);
    EXPECT_EQ(cb_tanh(-infinity), -1.0f);
    EXPECT_EQ(cb_tanh(FLT_MAX), 1.0f);
    EXPECT_EQ(cb_tanh(1e-45f), 1e-45f);
    EXPECT_EQ(cb_one_minus_exp(infinity), 1.0f);
    EXPECT_EQ(cb_one_minus_exp(0.0f), 0.0f);
    EXPECT_EQ(cb_one_minus_exp(-1.0f), 0.0f);
    EXPECT_EQ(cb_one_minus_exp(1e-45f), 1e-45f);
}

// Whatever its sign and payload, a NaN stays one (or moves no lag), and has one canonical form.
TEST(transcendental, nan) {
    for (std::uint32_t bits : {0x7FC00000u, 0xFFC00000u, 0x7F800001u, 0xFFFFFFFFu, 0x7FC001FFu}) {
        const float x = cb_float_of(bits);
        EXPECT_TRUE(std::isnan(cb_tanh(x))) << bits;
        EXPECT_EQ(cb_one_minus_exp(x), 0.0f) << bits;
        EXPECT_EQ(cb_bits_of(cb_canonical(x)), 0x7FC00000u);
    }
    EXPECT_EQ(cb_bits_of(cb_canonical(-0.0f)), 0x80000000u);
}

}  // namespace
