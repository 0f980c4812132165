// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

extern "C" {
#include "hal/linux/mailbox.h"
}

namespace {

TEST(ring, is_empty_then_full_then_empty_again) {
    cb_ring ring;
    cb_ring_start(&ring, 4);
    EXPECT_EQ(cb_ring_slot_to_read(&ring), -1);
    for (int i = 0; i < 4; i++) {
        EXPECT_EQ(cb_ring_slot_to_write(&ring), i);
        cb_ring_publish(&ring);
    }
    EXPECT_EQ(cb_ring_slot_to_write(&ring), -1);
    EXPECT_EQ(cb_ring_slot_to_write(&ring), -1);
    EXPECT_EQ(cb_ring_lost(&ring), 2u);
    for (int i = 0; i < 4; i++) {
        EXPECT_EQ(cb_ring_slot_to_read(&ring), i);
        cb_ring_release(&ring);
    }
    EXPECT_EQ(cb_ring_slot_to_read(&ring), -1);
    EXPECT_EQ(cb_ring_slot_to_write(&ring), 0);
}

TEST(ring, goes_on_when_its_counts_wrap) {
    cb_ring ring;
    cb_ring_start(&ring, 8);
    ring.written = ring.taken = 0xFFFFFFFCu;
    for (int i = 0; i < 8; i++) {
        ASSERT_GE(cb_ring_slot_to_write(&ring), 0);
        cb_ring_publish(&ring);
    }
    EXPECT_EQ(cb_ring_slot_to_write(&ring), -1);
    for (int i = 0; i < 8; i++) {
        ASSERT_EQ(cb_ring_slot_to_read(&ring), (4 + i) % 8);
        cb_ring_release(&ring);
    }
    EXPECT_EQ(cb_ring_slot_to_read(&ring), -1);
}

// Two threads: every item arrives whole and in order, or is counted as lost.
TEST(ring, hands_over_whole_items_in_order_and_counts_the_lost) {
    struct item {
        uint64_t number;
        std::array<uint64_t, 15> copies;
    };
    static std::array<item, 16> slots;
    cb_ring ring;
    cb_ring_start(&ring, 16);
    bool done = false;
    constexpr uint64_t least = 400000;
    // On a busy machine the reader may not run for long: the writer goes on until it has.
    std::atomic<uint64_t> items = 0, seen = 0;
    std::thread writer([&] {
        for (uint64_t n = 1; n <= least || seen < 1000; n++) {
            items = n;
            const int32_t slot = cb_ring_slot_to_write(&ring);
            if (slot < 0) continue;
            slots[static_cast<size_t>(slot)].number = n;
            slots[static_cast<size_t>(slot)].copies.fill(n);
            cb_ring_publish(&ring);
        }
        cb_flag_raise(&done);
    });
    uint64_t last = 0, received = 0, torn = 0, disordered = 0;
    for (;;) {
        const bool finished = cb_flag_is_raised(&done);
        const int32_t slot = cb_ring_slot_to_read(&ring);
        if (slot < 0) {
            if (finished) break;
            continue;
        }
        const item copy = slots[static_cast<size_t>(slot)];
        cb_ring_release(&ring);
        for (uint64_t c : copy.copies) torn += c != copy.number;
        disordered += copy.number <= last;
        last = copy.number;
        seen = ++received;
    }
    writer.join();
    EXPECT_EQ(torn, 0u);
    EXPECT_EQ(disordered, 0u);
    EXPECT_EQ(received + cb_ring_lost(&ring), items);
    EXPECT_GE(received, 1000u);
}

}  // namespace
