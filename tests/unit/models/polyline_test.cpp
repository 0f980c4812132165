// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

extern "C" {
#include "models/polyline.h"
}

namespace {

struct polyline {
    std::vector<float> breaks, coefficients;
    cb_ppoly curve{};

    polyline(const std::vector<float> &x, const std::vector<float> &y)
        : breaks(x.size()), coefficients(2 * (x.size() - 1)) {
        cb_polyline_to_ppoly(x.data(), y.data(), static_cast<uint16_t>(x.size()), breaks.data(),
                             coefficients.data(), &curve);
    }
    polyline(const polyline &) = delete;
    cb_curve_value at(float x) const { return cb_ppoly_evaluate(&curve, x); }
};

TEST(Polyline, PassesThroughItsPoints) {
    const std::vector<float> x{-3.5f, 0.1f, 7.0f, 1000.25f}, y{1.1f, -2.2f, 3.3f, 0.7f};
    const polyline line(x, y);
    for (size_t i = 0; i + 1 < x.size(); ++i) EXPECT_EQ(line.at(x[i]).value, y[i]);
    EXPECT_NEAR(line.at(1000.25f).value, 0.7f, 1e-6f);
    EXPECT_NEAR(line.at(3.55f).value, 0.55f, 1e-6f);
    EXPECT_NEAR(line.at(3.55f).slope, 5.5f / 6.9f, 1e-6f);
}

TEST(Polyline, HoldsItsEndsOutside) {
    const polyline line({2.0f, 4.0f}, {10.0f, 20.0f});
    EXPECT_EQ(line.at(1.0f).value, 10.0f);
    EXPECT_EQ(line.at(5.0f).value, 20.0f);
    EXPECT_EQ(line.at(5.0f).slope, 0.0f);
    EXPECT_TRUE(line.at(5.0f).outside);
    EXPECT_FALSE(line.at(4.0f).outside);
    EXPECT_EQ(line.at(4.0f).slope, 5.0f);
    EXPECT_EQ(line.at(std::numeric_limits<float>::quiet_NaN()).value, 10.0f);
}

TEST(Polyline, ErrorStaysInsideTheStatedBound) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(-700, 14300), size(-200, 200);
    double worst = 0;
    for (int trial = 0; trial < 5000; ++trial) {
        std::vector<float> x(2 + random() % 20), y(x.size());
        for (float &v : x) v = place(random);
        for (float &v : y) v = size(random);
        std::sort(x.begin(), x.end());
        if (std::adjacent_find(x.begin(), x.end()) != x.end()) continue;
        const polyline line(x, y);
        for (size_t i = 0; i + 1 < x.size(); ++i) {
            const float last = std::nextafterf(x[i + 1], x[i]);
            for (const float at : {last, std::min(last, x[i] + 0.7f * (x[i + 1] - x[i]))}) {
                const double rise = static_cast<double>(y[i + 1]) - y[i];
                const double slope = rise / (static_cast<double>(x[i + 1]) - x[i]);
                const double exact = y[i] + slope * (static_cast<double>(at) - x[i]);
                const double m = std::max(std::fabs(y[i]), std::fabs(y[i + 1]));
                const double bound = 1.001 * 0x1p-24 * (m + 5 * std::fabs(rise));
                ASSERT_NEAR(line.at(at).value, exact, bound);
                ASSERT_NEAR(line.at(at).slope, slope, 3.001 * 0x1p-24 * std::fabs(slope));
                worst = std::max(worst, std::fabs(line.at(at).value - exact) / bound);
            }
        }
    }
    EXPECT_GT(worst, 0.4) << "the bound is too loose to mean anything";
}

TEST(Polyline, RisesWhereverItsPointsRise) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> place(0, 100);
    for (int trial = 0; trial < 300; ++trial) {
        const float rise = place(random);
        const polyline line({0.0f, 100.0f}, {-5.0f, -5.0f + rise});
        for (int i = 0; i < 100; ++i) {
            const float a = place(random), b = place(random);
            EXPECT_LE(line.at(std::min(a, b)).value, line.at(std::max(a, b)).value);
        }
    }
}

}  // namespace
