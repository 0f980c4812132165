// SPDX-License-Identifier: MIT
// The rule of range and rate that the box, `compbox eval` and `compbox commission` share.
#include <gtest/gtest.h>

#include <limits>

extern "C" {
#include "firmware/signals/plausible.h"
}

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float no_number = std::numeric_limits<float>::quiet_NaN();

TEST(plausible, a_value_at_an_end_may_be_past_it_by_its_rounding) {
    cb_signal_config signal{};
    signal.min = -10.0f;
    signal.max = 500.0f;
    EXPECT_TRUE(cb_signal_in_range(&signal, 500.0001f));
    EXPECT_TRUE(cb_signal_in_range(&signal, -10.0001f));
    EXPECT_FALSE(cb_signal_in_range(&signal, 500.001f));
    EXPECT_FALSE(cb_signal_in_range(&signal, -10.001f));
    signal.zero = -5000.0f;  // a large zero rounds coarsely
    EXPECT_TRUE(cb_signal_in_range(&signal, 500.001f));
    for (const float value : {no_number, infinity, -infinity})
        EXPECT_FALSE(cb_signal_in_range(&signal, value)) << value;
}

TEST(plausible, a_change_may_exceed_its_rate_by_one_raw_unit) {
    cb_signal_config signal{};
    signal.rate_per_s = 2.0f;
    signal.change_unit = 0.5f;
    EXPECT_FALSE(cb_signal_too_fast(&signal, -1.5f, 0.5f));
    EXPECT_TRUE(cb_signal_too_fast(&signal, 1.51f, 0.5f));
    EXPECT_TRUE(cb_signal_too_fast(&signal, -0.51f, 0.0f));
}

TEST(plausible, without_a_limit_no_change_is_too_fast) {
    cb_signal_config signal{};
    signal.rate_per_s = infinity;
    for (const float elapsed_s : {0.0f, 0.03f, 1e9f})
        EXPECT_FALSE(cb_signal_too_fast(&signal, 1e9f, elapsed_s)) << elapsed_s;
}

}  // namespace
