// SPDX-License-Identifier: MIT
#include "host-tools/simulation/figures.h"

#include <gtest/gtest.h>

#include <numeric>

using namespace compbox::simulation;

namespace {

std::vector<double> from_one_to(int count) {
    std::vector<double> values(static_cast<std::size_t>(count));
    std::iota(values.rbegin(), values.rend(), 1.0);  // not sorted
    return values;
}

}  // namespace

// The ranks are those of tables of the sign test (two-sided, 5 %).
TEST(figures, an_interval_of_the_median_has_the_ranks_of_the_sign_test) {
    EXPECT_FALSE(median_interval({}));
    EXPECT_FALSE(median_interval(from_one_to(5)));
    const int expected[][3] = {{6, 1, 6}, {9, 2, 8}, {20, 6, 15}, {80, 31, 50}};
    for (const auto &[count, low, high] : expected) {
        const auto found = median_interval(from_one_to(count));
        ASSERT_TRUE(found) << count;
        EXPECT_EQ(found->low, low) << count;
        EXPECT_EQ(found->high, high) << count;
    }
}
