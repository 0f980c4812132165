// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

extern "C" {
#include "models/bspline.h"
}

#include "tests/support/cases.h"
#include "tests/support/not_finite.h"

namespace {

using compbox_test::infinity;
using compbox_test::not_a_number;

struct spline {
    int degree;
    std::vector<float> knots, points;

    cb_bspline c() const {
        return {knots.data(), points.data(), static_cast<uint16_t>(points.size()),
                static_cast<uint8_t>(degree)};
    }
    cb_bspline_fault check(uint16_t *at) const {
        const cb_bspline view = c();
        return cb_bspline_check(&view, at);
    }
};

struct converted {
    std::vector<float> breaks, coefficients;
    cb_ppoly curve{};

    explicit converted(const spline &source) {
        const cb_bspline view = source.c();
        const uint16_t spans = cb_bspline_spans(&view);
        breaks.resize(spans + 1u);
        coefficients.resize(static_cast<size_t>(spans * (source.degree + 1)));
        cb_bspline_to_ppoly(&view, breaks.data(), coefficients.data(), &curve);
        EXPECT_EQ(curve.spans, spans);
    }
    converted(const converted &) = delete;
    cb_curve_value at(float x) const { return cb_ppoly_evaluate(&curve, x); }
};

// Cox-de Boor basis with 0/0 = 0 in long double (64 bits of mantissa: exact next to float32).
long double basis(const std::vector<float> &t, size_t j, int p, size_t span, long double x) {
    if (p == 0) return j == span ? 1.0L : 0.0L;
    const size_t order = static_cast<size_t>(p);
    const long double a = t[j + order] - static_cast<long double>(t[j]);
    const long double b = t[j + order + 1] - static_cast<long double>(t[j + 1]);
    const long double left = a > 0 ? (x - t[j]) / a * basis(t, j, p - 1, span, x) : 0;
    const long double right =
        b > 0 ? (t[j + order + 1] - x) / b * basis(t, j + 1, p - 1, span, x) : 0;
    return left + right;
}

long double basis_slope(const std::vector<float> &t, size_t j, int p, size_t span, long double x) {
    const size_t order = static_cast<size_t>(p);
    const long double a = t[j + order] - static_cast<long double>(t[j]);
    const long double b = t[j + order + 1] - static_cast<long double>(t[j + 1]);
    return (a > 0 ? p / a * basis(t, j, p - 1, span, x) : 0) -
           (b > 0 ? p / b * basis(t, j + 1, p - 1, span, x) : 0);
}

struct reference {
    long double value = 0, slope = 0, value_bound, slope_bound;

    // The definition, and the bounds of bspline.c, in the span [t_span, t_span+1).
    reference(const spline &s, size_t span, float x) {
        const size_t p = static_cast<size_t>(s.degree);
        float low = s.points[span], high = low;
        for (size_t j = span - p; j <= span; ++j) {
            value += s.points[j] * basis(s.knots, j, s.degree, span, x);
            slope += s.points[j] * basis_slope(s.knots, j, s.degree, span, x);
            low = std::min(low, s.points[j]);
            high = std::max(high, s.points[j]);
        }
        const int d = s.degree;
        const double power3 = std::pow(3.0, d), power2 = std::pow(2.0, d);
        const double k = power3 / 3 * (25 * d - 27) + 11 * power2 - d - 1;
        const double l = 2 * d * power3 / 9 * (25 * d - 31) + 11 * d * power2;
        const long double largest = std::max(std::fabs(low), std::fabs(high));
        const long double half_range = (static_cast<long double>(high) - low) / 2;
        const long double h = static_cast<long double>(s.knots[span + 1]) - s.knots[span];
        value_bound = 1.001L * 0x1p-24L * (d * largest + k * half_range);
        slope_bound = 1.001L * 0x1p-24L * l * half_range / h;
    }
};

bool valid(const spline &s) {
    uint16_t at;
    return s.check(&at) == CB_BSPLINE_OK;
}

// The non-empty spans of the domain.
std::vector<size_t> spans_of(const spline &s) {
    std::vector<size_t> spans;
    for (size_t m = static_cast<size_t>(s.degree); m < s.points.size(); ++m) {
        if (s.knots[m] < s.knots[m + 1]) spans.push_back(m);
    }
    return spans;
}

// Knots of every kind; control points random or alternating, which is where cancellation is worst.
spline random_spline(std::mt19937 &random) {
    const int p = 1 + static_cast<int>(random() % 5);
    const size_t order = static_cast<size_t>(p) + 1, count = order + random() % 7;
    spline s{p, std::vector<float>(count + order), std::vector<float>(count)};
    std::uniform_real_distribution<float> place(-700, 14300), part(-1, 1);
    const unsigned kind = random() % 4;
    float at = place(random);
    for (float &knot : s.knots) {
        if (kind == 0) knot = static_cast<float>(random() % 9);
        if (kind == 1) knot = at += std::ldexp(1.3f, -static_cast<int>(random() % 24) + 8);
        if (kind >= 2) knot = place(random);
    }
    std::sort(s.knots.begin(), s.knots.end());
    if (kind == 3) {
        std::fill_n(s.knots.begin(), order, s.knots.front());
        std::fill_n(s.knots.rbegin(), order, s.knots.back());
    }
    const bool alternate = random() % 2 == 0;
    for (size_t i = 0; i < count; ++i) {
        s.points[i] = 200.0f * part(random);
        if (alternate) s.points[i] = (i % 2 == 0 ? 200.0f : -200.0f) * (1 - part(random) / 1e3f);
    }
    return s;
}

TEST(Bspline, ErrorStaysInsideTheStatedBound) {
    std::mt19937 random(1);
    long double worst_value = 0, worst_slope = 0;
    int tried = 0;
    for (int trial = 0; trial < compbox_test::cases(12000); ++trial) {
        const spline s = random_spline(random);
        if (!valid(s)) continue;
        const converted ours(s);
        for (const size_t m : spans_of(s)) {
            std::uniform_real_distribution<float> inside(s.knots[m], s.knots[m + 1]);
            const float last = std::nextafterf(s.knots[m + 1], -infinity);
            for (const float x : {s.knots[m], std::min(inside(random), last), last}) {
                const reference exact(s, m, x);
                const cb_curve_value got = ours.at(x);
                const long double value_error = std::fabs(got.value - exact.value);
                const long double slope_error = std::fabs(got.slope - exact.slope);
                ASSERT_LE(value_error, exact.value_bound) << "degree " << s.degree << " x " << x;
                ASSERT_LE(slope_error, exact.slope_bound) << "degree " << s.degree << " x " << x;
                if (exact.value_bound > 0) {
                    worst_value = std::max(worst_value, value_error / exact.value_bound);
                }
                if (exact.slope_bound > 0) {
                    worst_slope = std::max(worst_slope, slope_error / exact.slope_bound);
                }
                ++tried;
            }
        }
    }
    EXPECT_GT(tried, compbox_test::cases(50000));
    EXPECT_GT(worst_value, 0.2L) << "the bound is too loose to mean anything";
    EXPECT_GT(worst_slope, 0.05L) << "the bound is too loose to mean anything";
}

TEST(Bspline, TheGantryCurveIsGoodToANanometre) {
    // What the bound means in practice: 200 µm over 14.3 m, neighbours a few ten µm apart.
    spline s{3, {}, {}};
    for (int i = 0; i < 20; ++i)
        s.points.push_back(200.0f * std::sin(0.5f * static_cast<float>(i)));
    s.knots.assign(4, 0.0f);
    for (int i = 1; i < 17; ++i) s.knots.push_back(14300.0f * static_cast<float>(i) / 17.0f);
    s.knots.insert(s.knots.end(), 4, 14300.0f);
    const converted ours(s);
    EXPECT_EQ(ours.breaks.size() + ours.coefficients.size(), 86u);
    EXPECT_GT(ours.curve.spans_per_unit, 0.0f);
    for (const size_t m : spans_of(s)) {
        for (int i = 0; i < 100; ++i) {
            const float x = s.knots[m] + 8.41f * static_cast<float>(i);
            if (x >= s.knots[m + 1]) break;
            EXPECT_NEAR(ours.at(x).value, static_cast<double>(reference(s, m, x).value), 1e-4);
        }
    }
}

TEST(Bspline, EqualControlPointsGiveExactlyThatValue) {
    std::mt19937 random(2);
    for (int trial = 0; trial < 2000; ++trial) {
        spline s = random_spline(random);
        std::fill(s.points.begin(), s.points.end(), 123.456f);
        if (!valid(s)) continue;
        const converted ours(s);
        for (const float x : ours.breaks) {
            EXPECT_EQ(ours.at(x).value, 123.456f);
            EXPECT_EQ(ours.at(x).slope, 0.0f);
        }
    }
}

TEST(Bspline, GrevillePointsGiveTheStraightLine) {
    for (int p = 1; p <= CB_BSPLINE_MAX_DEGREE; ++p) {
        spline s{p, {}, {}};
        for (int i = 0; i < 2 * p + 6; ++i) s.knots.push_back(static_cast<float>(i * i));
        for (size_t i = 0; i < static_cast<size_t>(p) + 5; ++i) {
            float sum = 0;
            for (size_t k = 1; k <= static_cast<size_t>(p); ++k) sum += s.knots[i + k];
            s.points.push_back(sum / static_cast<float>(p));
        }
        const converted ours(s);
        for (float x = ours.breaks.front(); x <= ours.breaks.back(); x += 0.37f) {
            EXPECT_NEAR(ours.at(x).value, x, 1e-4f) << "degree " << p;
            EXPECT_NEAR(ours.at(x).slope, 1.0f, 1e-4f) << "degree " << p;
        }
    }
}

TEST(Bspline, ClampedCurveStartsAtItsFirstAndEndsAtItsLastPoint) {
    for (int p = 1; p <= CB_BSPLINE_MAX_DEGREE; ++p) {
        spline s{p, std::vector<float>(static_cast<size_t>(p) + 1, -3.0f), {}};
        s.knots.insert(s.knots.end(), {1.0f, 1.5f});
        s.knots.insert(s.knots.end(), static_cast<size_t>(p) + 1, 9.0f);
        for (int i = 0; i < p + 3; ++i) s.points.push_back(static_cast<float>(7 * i * i - 20));
        const converted ours(s);
        EXPECT_EQ(ours.at(-3.0f).value, s.points.front());
        EXPECT_NEAR(ours.at(9.0f).value, s.points.back(), 1e-3f);
        EXPECT_EQ(ours.at(-4.0f).value, s.points.front());
        EXPECT_TRUE(ours.at(-4.0f).outside);
        EXPECT_EQ(ours.at(10.0f).value, ours.at(9.0f).value);
    }
}

TEST(Bspline, OneSpanIsABezierCurve) {
    const spline s{3, {2, 2, 2, 2, 4, 4, 4, 4}, {1, -2, 5, 8}};
    const converted ours(s);
    ASSERT_EQ(ours.curve.spans, 1);
    const cb_curve_value middle = ours.at(3.0f);
    EXPECT_NEAR(middle.value, (1 - 3 * 2 + 3 * 5 + 8) / 8.0, 1e-6);
    EXPECT_NEAR(middle.slope, 3 * ((-2 - 1) + 2 * (5 + 2) + (8 - 5)) / 4.0 / 2.0, 1e-5);
    EXPECT_EQ(ours.at(2.0f).slope, 3 * (-2 - 1) / 2.0f);
}

TEST(Bspline, SimpleKnotsJoinWithoutAStepOrAKink) {
    std::mt19937 random(3);
    for (int trial = 0; trial < 3000; ++trial) {
        const spline s = random_spline(random);
        if (!valid(s) || s.degree < 2) continue;
        const converted ours(s);
        const std::vector<size_t> spans = spans_of(s);
        for (size_t i = 1; i < spans.size(); ++i) {
            if (spans[i] != spans[i - 1] + 1) continue;  // a repeated knot may have both
            const float knot = s.knots[spans[i]];
            const float width = knot - s.knots[spans[i] - 1];
            const float *a = ours.coefficients.data() + (i - 1) * (ours.curve.degree + 1u);
            float value = a[s.degree], slope = 0;
            for (int k = s.degree - 1; k >= 0; --k) {
                slope = slope * width + value;
                value = value * width + a[k];
            }
            const reference left(s, spans[i - 1], knot), right(s, spans[i], knot);
            EXPECT_NEAR(value, ours.at(knot).value,
                        static_cast<double>(left.value_bound + right.value_bound));
            EXPECT_NEAR(slope, ours.at(knot).slope,
                        static_cast<double>(left.slope_bound + right.slope_bound));
        }
    }
}

TEST(Bspline, ValuesStayInTheHullOfTheActivePoints) {
    std::mt19937 random(4);
    for (int trial = 0; trial < 3000; ++trial) {
        const spline s = random_spline(random);
        if (!valid(s)) continue;
        const converted ours(s);
        for (const size_t m : spans_of(s)) {
            const auto first = s.points.begin() + static_cast<long>(m) - s.degree;
            const auto ends = std::minmax_element(first, first + s.degree + 1);
            const float x = s.knots[m] + 0.5f * (s.knots[m + 1] - s.knots[m]);
            if (x >= s.knots[m + 1]) continue;
            const float slack = static_cast<float>(reference(s, m, x).value_bound);
            EXPECT_GE(ours.at(x).value, *ends.first - slack);
            EXPECT_LE(ours.at(x).value, *ends.second + slack);
        }
    }
}

TEST(Bspline, FullMultiplicityMakesAStepThatBelongsToTheRight) {
    const spline s{1, {0, 0, 5, 5, 9, 9}, {1, 2, 30, 40}};
    ASSERT_TRUE(valid(s));
    const converted ours(s);
    EXPECT_EQ(ours.curve.spans, 2);
    EXPECT_EQ(ours.at(5.0f).value, 30.0f);
    EXPECT_NEAR(ours.at(std::nextafterf(5.0f, 0.0f)).value, 2.0f, 1e-5f);
}

TEST(Bspline, CheckNamesTheKnotThatIsWrong) {
    const spline good{2, {0, 0, 0, 1, 2, 2, 2}, {1, 2, 3, 4}};
    uint16_t at = 99;
    EXPECT_EQ(good.check(&at), CB_BSPLINE_OK);
    EXPECT_EQ(at, 0);
    const auto faulty = [&](size_t index, float knot) {
        spline s = good;
        s.knots[index] = knot;
        return s.check(&at);
    };
    EXPECT_EQ(faulty(3, 3.0f), CB_BSPLINE_ORDER);
    EXPECT_EQ(at, 4);
    EXPECT_EQ(faulty(0, 1.0f), CB_BSPLINE_ORDER);
    EXPECT_EQ(at, 1);
    EXPECT_EQ(faulty(3, 0.0f), CB_BSPLINE_MULTIPLICITY);
    EXPECT_EQ(at, 3);
    EXPECT_EQ(faulty(3, 2.0f), CB_BSPLINE_MULTIPLICITY);
    EXPECT_EQ(at, 6);
    EXPECT_EQ(faulty(6, not_a_number), CB_BSPLINE_KNOT);
    EXPECT_EQ(at, 6);
    EXPECT_EQ(faulty(0, -infinity), CB_BSPLINE_KNOT);
    EXPECT_EQ(at, 0);
    EXPECT_EQ(faulty(6, 3e38f), CB_BSPLINE_WIDE);
    EXPECT_EQ(at, 6);
    EXPECT_EQ(faulty(0, -3e38f), CB_BSPLINE_WIDE);
    EXPECT_EQ(at, 1);
}

TEST(Bspline, CheckNamesTheOtherFaults) {
    uint16_t at = 99;
    EXPECT_EQ((spline{0, {0, 1}, {1}}.check(&at)), CB_BSPLINE_DEGREE);
    EXPECT_EQ((spline{6, std::vector<float>(14), std::vector<float>(7)}.check(&at)),
              CB_BSPLINE_DEGREE);
    EXPECT_EQ((spline{3, {0, 0, 0, 0, 1, 1, 1}, {1, 2, 3}}.check(&at)), CB_BSPLINE_COUNT);
    EXPECT_EQ((spline{1, {0, 1, 1, 2}, {1, 2}}.check(&at)), CB_BSPLINE_EMPTY);
    EXPECT_EQ(at, 2);
    EXPECT_EQ((spline{1, {0, 0, 0, 0}, {1, 2}}.check(&at)), CB_BSPLINE_EMPTY);
    EXPECT_EQ((spline{1, {0, 0, 1, 1}, {1, not_a_number}}.check(&at)), CB_BSPLINE_VALUE);
    EXPECT_EQ(at, 1);
    EXPECT_EQ((spline{1, {0, 0, 1, 1}, {infinity, 1}}.check(&at)), CB_BSPLINE_VALUE);
    EXPECT_EQ(at, 0);
}

TEST(Bspline, KnotsTooCloseForTheirPointsAreFoundAfterConversion) {
    const float next = std::nextafterf(1.0f, 2.0f);
    spline s{5, {1, 1, 1, 1, 1, 1, next, next, next, next, next, next}, {1, -1, 1, -1, 1, -1}};
    const converted small(s);
    EXPECT_TRUE(cb_ppoly_is_finite(&small.curve));
    for (float &point : s.points) point *= 1e4f;
    const converted large(s);
    EXPECT_FALSE(cb_ppoly_is_finite(&large.curve));
}

}  // namespace
