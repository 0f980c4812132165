// SPDX-License-Identifier: MIT
#include "host-tools/view/guess_limit.h"

#include <gtest/gtest.h>

using namespace compbox::view;

namespace {

// out: how many wrong ones were looked at
int guess(guess_limit &limit, const std::string &address, int times, double steady_s) {
    int looked_at = 0;
    for (int i = 0; i < times; ++i) {
        if (!limit.may_try(address, steady_s)) continue;
        limit.was_wrong(address, steady_s);
        ++looked_at;
    }
    return looked_at;
}

}  // namespace

TEST(view_guess_limit, a_few_at_once_then_one_in_ten_seconds) {
    guess_limit limit;
    EXPECT_EQ(guess(limit, "a", 1000, 5.0), 10);
    EXPECT_FALSE(limit.may_try("a", 14.9));
    int a_day = 0;
    for (int s = 0; s < 86400; ++s) a_day += guess(limit, "a", 3, 15.0 + s);
    EXPECT_NEAR(a_day, 8640, 1);
}

TEST(view_guess_limit, another_address_has_its_own) {
    guess_limit limit;
    guess(limit, "a", 100, 0.0);
    EXPECT_FALSE(limit.may_try("a", 1.0));
    EXPECT_TRUE(limit.may_try("b", 1.0));
    EXPECT_EQ(guess(limit, "b", 100, 1.0), 10);
}

TEST(view_guess_limit, who_guesses_no_more_is_forgotten) {
    guess_limit limit;
    guess(limit, "a", 3, 0.0);
    EXPECT_EQ(limit.addresses(), 1u);
    EXPECT_TRUE(limit.may_try("b", 30.0));
    EXPECT_EQ(limit.addresses(), 0u);
    EXPECT_EQ(guess(limit, "a", 100, 30.0), 10);
}

TEST(view_guess_limit, many_addresses_together_have_the_allowance_of_one) {
    guess_limit limit;
    for (int i = 0; i < 256; ++i) guess(limit, std::to_string(i), 1, 0.0);
    int others = 0;
    for (int i = 256; i < 100000; ++i) others += guess(limit, std::to_string(i), 1, 0.0);
    EXPECT_EQ(others, 10);
    EXPECT_EQ(limit.addresses(), 257u);
    EXPECT_TRUE(limit.may_try("7", 0.0)) << "who was there before keeps its own";
}

TEST(view_guess_limit, a_clock_that_goes_back_gives_nothing) {
    guess_limit limit;
    guess(limit, "a", 10, 100.0);
    EXPECT_FALSE(limit.may_try("a", 50.0));
    EXPECT_FALSE(limit.may_try("a", 105.0));
    EXPECT_TRUE(limit.may_try("a", 110.0));
}
