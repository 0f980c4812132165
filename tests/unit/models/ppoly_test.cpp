// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

extern "C" {
#include "tests/support/ppoly_search.h"
}

#include "tests/support/cases.h"
#include "tests/support/not_finite.h"

namespace {

using compbox_test::infinity;
using compbox_test::not_a_number;

uint32_t bits(float x) {
    uint32_t result;
    std::memcpy(&result, &x, sizeof result);
    return result;
}

// A piecewise polynomial that owns its memory.
struct curve {
    std::vector<float> breaks, coefficients;
    cb_ppoly ppoly{};

    curve(std::vector<float> b, std::vector<float> a, int degree)
        : breaks(std::move(b)), coefficients(std::move(a)) {
        ppoly.breaks = breaks.data();
        ppoly.coefficients = coefficients.data();
        ppoly.spans = static_cast<uint16_t>(breaks.size() - 1);
        ppoly.degree = static_cast<uint8_t>(degree);
        cb_ppoly_index(&ppoly);
    }
    curve(const curve &) = delete;
};

// Steps: span i has the value i.
std::vector<float> numbers(size_t count) {
    std::vector<float> result(count);
    for (size_t i = 0; i < count; ++i) result[i] = static_cast<float>(i);
    return result;
}

// The span by its definition.
uint16_t span_of(const std::vector<float> &breaks, float x) {
    uint16_t span = 0;
    while (span + 2u < breaks.size() && x >= breaks[span + 1u]) ++span;
    return span;
}

// Both look-ups against the definition: the breaks, their neighbours and random points.
void expect_right_spans(const std::vector<float> &breaks, std::mt19937 &random) {
    curve step(breaks, numbers(breaks.size() - 1), 0);
    cb_ppoly searched = step.ppoly;
    searched.spans_per_unit = 0.0f;
    std::vector<float> xs;
    for (const float b : breaks) {
        float below = b, above = b;
        xs.push_back(b);
        for (int i = 0; i < 3; ++i) {
            xs.push_back(below = std::nextafterf(below, -infinity));
            xs.push_back(above = std::nextafterf(above, infinity));
        }
    }
    std::uniform_real_distribution<float> anywhere(breaks.front(), breaks.back());
    for (int i = 0; i < 50; ++i) xs.push_back(anywhere(random));
    for (const float x : xs) {
        if (x < breaks.front() || x > breaks.back()) continue;
        ASSERT_EQ(searched_span(&step.ppoly, x), span_of(breaks, x)) << x;
        ASSERT_EQ(searched_span(&searched, x), span_of(breaks, x)) << x;
    }
}

TEST(Ppoly, ComputedSpanIsRightForEveryFloatOfARange) {
    // All 2^23 + 1 floats of [1, 2], outside the long tests each eighth; breaks as far from uniform
    // as the index allows.
    const curve step({1.0f, 1.0001f, 1.37f, 1.375f, 1.50001f, 1.87f, 2.0f}, numbers(6), 0);
    ASSERT_GT(step.ppoly.spans_per_unit, 0.0f);
    uint16_t expected = 0;
    const uint32_t step_of_bits = compbox_test::long_tests() ? 1 : 8;
    for (uint32_t i = bits(1.0f); i <= bits(2.0f); i += step_of_bits) {
        float x;
        std::memcpy(&x, &i, sizeof x);
        while (expected < 5 && x >= step.breaks[expected + 1u]) ++expected;
        ASSERT_EQ(searched_span(&step.ppoly, x), expected) << x;
    }
}

TEST(Ppoly, SpansAreRightNearEveryBreakOfRandomBreaks) {
    std::mt19937 random(1);
    int computed = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const int spans = 1 + static_cast<int>(random() % 40);
        const float start = std::ldexp(std::uniform_real_distribution<float>(-1, 1)(random),
                                       static_cast<int>(random() % 20));
        const float step = std::ldexp(1.1f, static_cast<int>(random() % 16) - 4);
        const float jitter = 0.25f * static_cast<float>(random() % 8);
        std::vector<float> breaks{start};
        std::uniform_real_distribution<float> uneven(-jitter, jitter);
        for (int i = 1; i <= spans; ++i) {
            const float next = start + step * (static_cast<float>(i) + uneven(random));
            if (next > breaks.back()) breaks.push_back(next);
        }
        if (breaks.size() < 2) continue;
        const curve probe(breaks, numbers(breaks.size() - 1), 0);
        computed += probe.ppoly.spans_per_unit > 0.0f ? 1 : 0;
        expect_right_spans(breaks, random);
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(computed, 500);  // both ways were really tried
    EXPECT_LT(computed, 2900);
}

TEST(Ppoly, UniformBreaksGetAnIndexAndGapsDoNot) {
    std::vector<float> uniform;
    for (int i = 0; i <= 17; ++i) uniform.push_back(14300.0f * static_cast<float>(i) / 17.0f);
    EXPECT_GT(curve(uniform, numbers(17), 0).ppoly.spans_per_unit, 0.0f);
    EXPECT_EQ(curve({0, 1, 2, 3, 4, 100}, numbers(5), 0).ppoly.spans_per_unit, 0.0f);
    EXPECT_EQ(curve({0, 1, 2, 12, 13, 14}, numbers(5), 0).ppoly.spans_per_unit, 0.0f);
}

TEST(Ppoly, BreaksOfOneUlpAndOfTheWholeRangeWork) {
    std::mt19937 random(2);
    const float one = 1000.0f, two = std::nextafterf(one, infinity);
    expect_right_spans({one, two, std::nextafterf(two, infinity)}, random);
    expect_right_spans({-3e38f, -1.0f, 0.0f, 1e-45f, 1.0f}, random);
    const float huge = std::numeric_limits<float>::max();  // last - first overflows
    const curve all({-huge, 0.0f, huge}, {1.0f, 2.0f}, 0);
    EXPECT_EQ(searched_value(&all.ppoly, -1.0f), 1.0f);
    EXPECT_EQ(searched_value(&all.ppoly, 0.0f), 2.0f);
    EXPECT_EQ(searched_value(&all.ppoly, infinity), 2.0f);
}

TEST(Ppoly, ValueAndSlopeOfKnownPieces) {
    // 1 + 2u + 3u^2 on [0, 2], 17 - u on [2, 5]
    const curve two({0.0f, 2.0f, 5.0f}, {1, 2, 3, 17, -1, 0}, 2);
    const cb_curve_value first = cb_ppoly_evaluate(&two.ppoly, 1.5f);
    EXPECT_EQ(first.value, 1.0f + 3.0f + 6.75f);
    EXPECT_EQ(first.slope, 2.0f + 9.0f);
    EXPECT_FALSE(first.outside);
    const cb_curve_value joint = cb_ppoly_evaluate(&two.ppoly, 2.0f);
    EXPECT_EQ(joint.value, 17.0f);
    EXPECT_EQ(joint.slope, -1.0f);  // a break belongs to the span on its right
    const cb_curve_value end = cb_ppoly_evaluate(&two.ppoly, 5.0f);
    EXPECT_EQ(end.value, 14.0f);
    EXPECT_EQ(end.slope, -1.0f);  // the last one to the last span
    EXPECT_FALSE(end.outside);
}

TEST(Ppoly, OutsideHoldsTheEndValueWithSlopeZero) {
    const curve line({-1.0f, 3.0f}, {5.0f, 2.0f}, 1);
    for (const float x : {-infinity, -1e30f, std::nextafterf(-1.0f, -2.0f), not_a_number}) {
        const cb_curve_value got = cb_ppoly_evaluate(&line.ppoly, x);
        EXPECT_EQ(got.value, 5.0f) << x;
        EXPECT_EQ(bits(got.slope), bits(0.0f)) << x;
        EXPECT_TRUE(got.outside) << x;
    }
    for (const float x : {infinity, 1e30f, std::nextafterf(3.0f, 4.0f)}) {
        const cb_curve_value got = cb_ppoly_evaluate(&line.ppoly, x);
        EXPECT_EQ(got.value, 13.0f) << x;
        EXPECT_EQ(bits(got.slope), bits(0.0f)) << x;
        EXPECT_TRUE(got.outside) << x;
    }
}

TEST(Ppoly, ValueAloneHasTheSameBits) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> size(-200, 200);
    for (int degree = 0; degree <= CB_PPOLY_MAX_DEGREE; ++degree) {
        std::vector<float> a(static_cast<size_t>(3 * (degree + 1)));
        for (float &v : a) v = size(random);
        const curve three({-1.0f, 0.5f, 0.75f, 4.0f}, a, degree);
        for (int i = 0; i < 1000; ++i) {
            const float x = size(random) / 40.0f;
            EXPECT_EQ(bits(searched_value(&three.ppoly, x)),
                      bits(cb_ppoly_evaluate(&three.ppoly, x).value));
        }
    }
}

TEST(Ppoly, FiniteIsAPromiseForEveryX) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> sign(-1, 1);
    int promised = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        const float width = std::ldexp(1.5f, static_cast<int>(random() % 40) - 20);
        std::vector<float> a(6);
        for (float &v : a) v = std::ldexp(sign(random), static_cast<int>(random() % 130));
        const curve one({0.0f, width}, a, 5);
        if (!cb_ppoly_is_finite(&one.ppoly)) continue;
        ++promised;
        for (const float part : {0.0f, 0.3f, 0.9f, 1.0f}) {
            const cb_curve_value got = cb_ppoly_evaluate(&one.ppoly, part * width);
            ASSERT_TRUE(std::isfinite(got.value) && std::isfinite(got.slope));
        }
    }
    EXPECT_GT(promised, 200);
    EXPECT_LT(promised, 3800);
}

TEST(Ppoly, FiniteRefusesOverflowAndBadCoefficients) {
    const auto finite = [](std::vector<float> breaks, std::vector<float> a) {
        const curve lines(std::move(breaks), std::move(a), 1);
        return cb_ppoly_is_finite(&lines.ppoly);
    };
    EXPECT_TRUE(finite({0, 1}, {1, 2}));
    EXPECT_FALSE(finite({0, 1}, {1, infinity}));
    EXPECT_FALSE(finite({0, 1}, {not_a_number, 2}));
    EXPECT_FALSE(finite({0, 1, 21}, {1, 1, 1, 2e37f}));
    EXPECT_FALSE(finite({0, 1}, {3e38f, -3e38f}));
}

// From whatever span it is asked, a curve that is followed says what one that is searched says.
TEST(Ppoly, FollowsFromEverySpan) {
    for (const std::vector<float> &breaks :
         {std::vector<float>{0, 1, 2, 3, 4}, {0, 1, 9, 10, 50}}) {
        const curve lines(breaks, {1, 2, 3, 5, 8, -1, 2, 4}, 1);
        const float last = breaks.back();
        for (const float x :
             {-1.0f, 0.0f, 0.5f, 1.0f, 1.5f, 2.5f, 9.5f, last, last + 1, not_a_number}) {
            for (const uint16_t from : std::vector<uint16_t>{0, 1, 2, 3, 4, 5, 65535}) {
                uint16_t followed = from, near = from;
                const bool inside = x > 0.0f && x < last;
                EXPECT_EQ(cb_ppoly_follow(&lines.ppoly, x, &followed), inside);
                EXPECT_EQ(followed, inside ? searched_span(&lines.ppoly, x) : from);
                const cb_curve_value value = cb_ppoly_near(&lines.ppoly, x, &near);
                EXPECT_EQ(bits(value.value), bits(searched_value(&lines.ppoly, x)));
                EXPECT_EQ(value.outside, !(x >= 0.0f && x <= last));
            }
        }
    }
}

}  // namespace
