// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

extern "C" {
#include "hal/linux/clock.h"
#include "hal/linux/tick.h"
}

namespace {

void work_for_us(int64_t us) {
    const int64_t end = cb_clock_ns(CLOCK_MONOTONIC) + us * 1000;
    while (cb_clock_ns(CLOCK_MONOTONIC) < end) continue;
}

// Every tick is start + n * period whatever the body does: relative sleeps would add up its time.
TEST(tick, stays_on_the_grid_while_the_body_works) {
    cb_tick tick;
    cb_tick_start(&tick, CLOCK_MONOTONIC, 2000);
    int64_t skipped = 0;
    for (int i = 0; i < 200; i++) {
        skipped += cb_tick_wait(&tick);
        ASSERT_GE(tick.late_ns, 0);
        ASSERT_LT(tick.late_ns, tick.period_ns);
        ASSERT_EQ(tick.woke_ns - tick.late_ns, tick.start_ns + tick.index * tick.period_ns);
        work_for_us(700);
    }
    EXPECT_EQ(tick.index, 200 + skipped);
    const int64_t elapsed_ns = cb_clock_ns(CLOCK_MONOTONIC) - tick.start_ns;
    EXPECT_GE(elapsed_ns, 200 * tick.period_ns);
}

TEST(tick, skips_and_counts_what_the_body_slept_through) {
    cb_tick tick;
    cb_tick_start(&tick, CLOCK_MONOTONIC, 10000);
    const uint32_t before = cb_tick_wait(&tick);
    const int64_t index = tick.index;
    std::this_thread::sleep_for(std::chrono::milliseconds(34));
    const uint32_t skipped = cb_tick_wait(&tick);
    EXPECT_GE(skipped, 3u);  // more only when the machine itself overslept
    EXPECT_EQ(tick.index, index + 1 + skipped);
    EXPECT_LT(before, 1000u);
    // … and the next one comes at its own time, not at once to make up for the lost.
    const int64_t woke = tick.woke_ns - tick.late_ns;
    const uint32_t more = cb_tick_wait(&tick);
    EXPECT_EQ(tick.woke_ns - tick.late_ns, woke + (1 + more) * tick.period_ns);
}

TEST(tick, a_body_that_ends_just_behind_the_tick_waits_for_the_next_one) {
    cb_tick tick;
    cb_tick_start(&tick, CLOCK_MONOTONIC, 20000);
    cb_tick_wait(&tick);
    work_for_us(20500);
    const uint32_t skipped = cb_tick_wait(&tick);
    EXPECT_GE(skipped, 1u);
    EXPECT_LT(tick.late_ns, tick.period_ns);
}

}  // namespace
