// SPDX-License-Identifier: MIT
#include "host-tools/uplink/outbox.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace compbox::uplink {
namespace {

message numbered(int number) {
    return {"t", std::to_string(number)};
}

TEST(outbox, sends_in_order_and_forgets_what_is_confirmed) {
    outbox box(10000);
    EXPECT_EQ(box.next(), nullptr);
    for (int i = 0; i < 3; ++i) box.add(numbered(i));
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(box.next()->payload, std::to_string(i));
        box.sent(10 + i);
    }
    EXPECT_EQ(box.next(), nullptr);
    box.confirmed(11);  // in another order
    EXPECT_EQ(box.waiting(), 3u);
    box.confirmed(99);  // of the state
    box.confirmed(10);
    EXPECT_EQ(box.waiting(), 1u);
    box.confirmed(12);
    EXPECT_EQ(box.waiting(), 0u);
    EXPECT_EQ(box.bytes(), 0u);
    EXPECT_EQ(box.lost(), 0u);
}

TEST(outbox, has_a_window_of_messages_on_their_way) {
    outbox box(1u << 20);
    for (int i = 0; i < 50; ++i) box.add(numbered(i));
    int sent = 0;
    for (; box.next() != nullptr; ++sent) box.sent(sent + 1);
    EXPECT_EQ(sent, static_cast<int>(outbox::window));
    box.confirmed(1);
    ASSERT_NE(box.next(), nullptr);
    EXPECT_EQ(box.next()->payload, "20");
}

TEST(outbox, drops_the_oldest_that_is_not_on_its_way_when_it_is_full) {
    outbox box(1000);
    for (int i = 0; i < 5; ++i) box.add(numbered(i));
    box.sent(1);  // number 0
    for (int i = 5; i < 100; ++i) box.add(numbered(i));
    EXPECT_LE(box.bytes(), 1000u);
    EXPECT_EQ(box.lost() + box.waiting(), 100u);
    box.confirmed(1);
    EXPECT_EQ(box.next()->payload, std::to_string(100 - box.waiting()));
    box.add({"t", std::string(2000, 'x')});  // larger than all
    EXPECT_LE(box.bytes(), 1000u);
}

// Any order of adding, sending and confirming: nothing is lost but what is counted, nothing comes
// out of order, and the size is within its bound.
TEST(outbox, keeps_its_promises_in_any_order_of_calls) {
    std::mt19937 dice(4);
    for (int round = 0; round < 200; ++round) {
        outbox box(3000);
        std::set<int> on_their_way;
        int added = 0, last = -1;
        std::uint64_t confirmed = 0;
        for (int step = 0; step < 500; ++step) {
            const auto choice = dice() % 3;
            if (choice == 0) box.add(numbered(added++));
            if (choice == 1 && box.next() != nullptr) {
                const int number = std::stoi(box.next()->payload);
                EXPECT_GT(number, last);
                last = number;
                box.sent(number + 1);
                on_their_way.insert(number + 1);
            }
            if (choice == 2 && !on_their_way.empty()) {
                auto one = on_their_way.begin();
                std::advance(one, dice() % on_their_way.size());
                box.confirmed(*one);
                on_their_way.erase(one);
                ++confirmed;
            }
            ASSERT_LE(box.bytes(), 3000u);
            ASSERT_LE(on_their_way.size(), outbox::window);
        }
        while (!on_their_way.empty()) {
            box.confirmed(*on_their_way.begin());
            on_their_way.erase(on_their_way.begin());
            ++confirmed;
        }
        EXPECT_EQ(confirmed + box.lost() + box.waiting(), static_cast<std::uint64_t>(added));
    }
}

}  // namespace
}  // namespace compbox::uplink
