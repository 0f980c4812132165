// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#define _Noreturn __attribute__((noreturn))
extern "C" {
#include "hal/stm32f405/app/last_cycles.h"
}
#undef _Noreturn

namespace {

// Cycles first … first + count - 1 of a run.
void note(std::uint32_t first, std::uint32_t count) {
    const auto box = std::make_unique<cb_box>();
    for (std::uint32_t i = 0; i < count; ++i) {
        box->counters.cycles = first + i;
        cb_last_cycles_note(box.get());
    }
}

// The numbers of the kept cycles, the last one first.
std::vector<std::uint32_t> kept() {
    std::vector<std::uint32_t> cycles;
    const cb_recorder *recorder = cb_last_cycles_kept();
    for (std::uint32_t ago = 0; cb_recorder_at(recorder, ago) != nullptr; ++ago)
        cycles.push_back(cb_recorder_at(recorder, ago)->cycle);
    return cycles;
}

using numbers = std::vector<std::uint32_t>;

TEST(last_cycles, keep_the_run_before_an_unwanted_restart) {
    cb_last_cycles_open(CB_START_POWER);
    EXPECT_EQ(kept(), numbers());
    note(1, 3);
    EXPECT_EQ(kept(), numbers());
    cb_last_cycles_open(CB_START_ASSERTION);
    EXPECT_EQ(kept(), (numbers{3, 2, 1}));
    note(1, 100);  // the next run does not touch them
    EXPECT_EQ(kept(), (numbers{3, 2, 1}));
    cb_last_cycles_open(CB_START_WATCHDOG);
    ASSERT_EQ(kept().size(), static_cast<std::size_t>(CB_LAST_CYCLES));
    EXPECT_EQ(kept().front(), 100u);
    EXPECT_EQ(kept().back(), 61u);
}

TEST(last_cycles, survive_wanted_restarts_and_runs_without_a_cycle) {
    cb_last_cycles_open(CB_START_POWER);
    note(1, 5);
    cb_last_cycles_open(CB_START_FAULT);
    for (const auto cause : {CB_START_REQUESTED, CB_START_PIN, CB_START_SOFTWARE}) {
        note(7, 2);
        cb_last_cycles_open(cause);
        EXPECT_EQ(kept(), (numbers{5, 4, 3, 2, 1}));
    }
    cb_last_cycles_open(CB_START_FAULT);  // before its first cycle
    EXPECT_EQ(kept(), (numbers{5, 4, 3, 2, 1}));
}

TEST(last_cycles, are_gone_with_the_power) {
    for (const auto cause : {CB_START_POWER, CB_START_BROWN_OUT}) {
        cb_last_cycles_open(CB_START_POWER);
        note(1, 5);
        cb_last_cycles_open(CB_START_FAULT);
        cb_last_cycles_open(cause);
        EXPECT_EQ(kept(), numbers());
    }
}

// By a fault, or of another image: no recorder over these records.
TEST(last_cycles, are_gone_if_a_recorder_changed) {
    void (*const changes[])(cb_recorder &) = {
        [](cb_recorder &of) { ++of.records; }, [](cb_recorder &of) { ++of.capacity; },
        [](cb_recorder &of) { of.count = CB_LAST_CYCLES + 1; },
        [](cb_recorder &of) { of.next = CB_LAST_CYCLES; }};
    for (const auto change : changes) {
        for (int faults = 1; faults <= 2; ++faults) {  // the kept recorder is either one
            cb_last_cycles_open(CB_START_POWER);
            for (int i = 0; i < faults; ++i) {
                note(1, 5);
                cb_last_cycles_open(CB_START_FAULT);
            }
            ASSERT_EQ(kept().size(), 5u);
            change(const_cast<cb_recorder &>(*cb_last_cycles_kept()));
            cb_last_cycles_open(CB_START_REQUESTED);
            EXPECT_EQ(kept(), numbers());
            note(8, 2);
            cb_last_cycles_open(CB_START_FAULT);
            EXPECT_EQ(kept(), (numbers{9, 8})) << "the next run is kept again";
        }
    }
}

}  // namespace
