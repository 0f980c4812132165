// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <thread>

extern "C" {
#include "hal/linux/clock.h"
#include "hal/linux/tick.h"
}

namespace {
int64_t oversleep_ns = 0;  // by which the next sleep is too long
}

// In place of the C library's: a machine that stands still while the loop sleeps.
extern "C" int clock_nanosleep(clockid_t clock, int flags, const timespec *until, timespec *rest) {
    const int64_t until_ns = int64_t{until->tv_sec} * 1000000000 + until->tv_nsec + oversleep_ns;
    oversleep_ns = 0;
    const timespec later = cb_timespec(until_ns);
    return syscall(SYS_clock_nanosleep, clock, flags, &later, rest) == 0 ? 0 : errno;
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
        ASSERT_GE(tick.worst_ns, tick.late_ns);
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
    EXPECT_GE(tick.worst_ns, 24000000) << "34 ms after a tick, its next one is 24 ms ago";
    EXPECT_LT(before, 1000u);
    // … and the next one comes at its own time, not at once to make up for the lost.
    const int64_t woke = tick.woke_ns - tick.late_ns;
    const uint32_t more = cb_tick_wait(&tick);
    EXPECT_EQ(tick.woke_ns - tick.late_ns, woke + (1 + more) * tick.period_ns);
}

// A cycle starts no later than a period after its tick; that the wake-up was later is not hidden.
TEST(tick, keeps_a_wake_up_that_is_periods_late) {
    cb_tick tick;
    cb_tick_start(&tick, CLOCK_MONOTONIC, 10000);
    cb_tick_wait(&tick);
    oversleep_ns = 35000000;
    const uint32_t skipped = cb_tick_wait(&tick);
    EXPECT_GE(skipped, 4u);
    EXPECT_GE(tick.worst_ns, 35000000);
    EXPECT_LT(tick.late_ns, tick.period_ns);
    const int64_t late_ns = tick.worst_ns;
    cb_tick_wait(&tick);
    EXPECT_NE(tick.worst_ns, late_ns) << "of each wait by itself";
}

// A body that is a little late does not hide a wake-up that is periods late, nor the reverse.
TEST(tick, keeps_the_larger_lateness_of_body_and_wake_up) {
    cb_tick tick;
    cb_tick_start(&tick, CLOCK_MONOTONIC, 10000);
    cb_tick_wait(&tick);
    work_for_us(10500);
    oversleep_ns = 35000000;
    EXPECT_GE(cb_tick_wait(&tick), 4u);
    EXPECT_GE(tick.worst_ns, 35000000);
    std::this_thread::sleep_for(std::chrono::milliseconds(44));
    oversleep_ns = 15000000;
    EXPECT_GE(cb_tick_wait(&tick), 4u);
    EXPECT_GE(tick.worst_ns, 34000000 - tick.period_ns);
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
