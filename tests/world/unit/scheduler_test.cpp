// SPDX-License-Identifier: MIT
#include "tests/world/scheduler.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace compbox::world {
namespace {

TEST(scheduler, threads_and_events_come_in_the_order_of_their_times) {
    scheduler time;
    std::string order;
    time.start("a", [&] {
        order += "a1 ";
        time.pass(10);
        order += "a2 ";
    });
    time.start("b", [&] {
        order += "b1 ";
        time.pass(7);
        order += "b2 ";
    });
    time.at(8, [&] { order += "event "; });
    time.run();
    EXPECT_EQ(order, "a1 b1 b2 event a2 ");
    EXPECT_EQ(time.now(), 10);
}

TEST(scheduler, a_wait_ends_by_wake_or_by_time) {
    scheduler time;
    std::vector<bool> woken;
    thread &sleeper = time.start("sleeper", [&] {
        woken.push_back(time.wait(100));
        woken.push_back(time.wait(200));
    });
    time.at(50, [&] { time.wake(sleeper); });
    time.run();
    EXPECT_EQ(woken, (std::vector<bool>{true, false}));
    EXPECT_EQ(time.now(), 200);
}

TEST(scheduler, the_end_of_all_unwinds_each_stack) {
    struct guard {
        int &count;
        ~guard() { ++count; }
    };
    scheduler time;
    int unwound = 0, dropped = 0;
    time.dropped = [&] { ++dropped; };
    time.start("waits", [&] {
        const guard here{unwound};
        time.wait(never);
    });
    time.start("ends", [&] {
        const guard here{unwound};
        time.pass(5);
        time.end_all_here();
    });
    time.run();
    EXPECT_EQ(unwound, 2);
    EXPECT_EQ(dropped, 1);
    EXPECT_TRUE(time.threads().empty());
}

}  // namespace
}  // namespace compbox::world
