// SPDX-License-Identifier: MIT
// Powers of a signal, and the range of each.
#include <gtest/gtest.h>

extern "C" {
#include "models/power.h"
}

namespace {

TEST(power, is_a_product) {
    EXPECT_EQ(cb_power(-3, 1), -3);
    EXPECT_EQ(cb_power(-3, 2), 9);
    EXPECT_EQ(cb_power(-3, 3), -27);
    EXPECT_EQ(cb_power(2, 4), 16);
}

TEST(power, range_of_even_and_odd_powers) {
    const auto range = [](float min, float max, unsigned power) {
        const cb_interval interval = cb_power_range(min, max, power);
        return std::pair(interval.min, interval.max);
    };
    EXPECT_EQ(range(-3, 2, 1), std::pair(-3.0f, 2.0f));
    EXPECT_EQ(range(-3, 2, 3), std::pair(-27.0f, 8.0f));
    EXPECT_EQ(range(-3, 2, 2), std::pair(0.0f, 9.0f)) << "through zero";
    EXPECT_EQ(range(-2, 3, 4), std::pair(0.0f, 81.0f));
    EXPECT_EQ(range(-3, -2, 2), std::pair(4.0f, 9.0f)) << "below zero";
    EXPECT_EQ(range(-3, 0, 2), std::pair(0.0f, 9.0f));
    EXPECT_EQ(range(2, 3, 2), std::pair(4.0f, 9.0f));
}

}  // namespace
