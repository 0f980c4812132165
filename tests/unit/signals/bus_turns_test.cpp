// SPDX-License-Identifier: MIT
// Turns on the bus of Pt100 modules: which module gets a request and when, and the use of the
// answers.
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <memory>
#include <vector>

extern "C" {
#include "firmware/config/config.h"
#include "firmware/signals/bus_turns.h"
#include "firmware/wire/number.h"
}

namespace {

constexpr std::int64_t ms = 1000;

struct rig {
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    cb_bus_turns turns{};

    explicit rig(std::uint32_t every_ms) {
        config->buses_count = 1;
        config->buses[0].every_us = every_ms * 1000;
    }

    void add(std::uint8_t unit, std::uint16_t reg, std::uint8_t type = CB_NUMBER_INT16,
             std::uint8_t source = CB_SOURCE_BUS) {
        cb_signal_config &signal = config->signals[config->signals_count++];
        signal.source = source;
        signal.bus_unit = unit;
        signal.reg = reg;
        signal.type = type;
    }

    void start() { cb_bus_turns_start(&turns, config.get(), 0, 0); }

    // unit, start, count; all 0: nobody is due
    std::vector<int> next(std::int64_t now_us) {
        std::uint8_t unit = 0;
        cb_modbus_request request{};
        if (!cb_bus_turns_next(&turns, now_us, &unit, &request)) return {0, 0, 0};
        EXPECT_EQ(request.function, CB_MODBUS_READ);
        return {unit, request.read_start, request.read_count};
    }

    // The same, and the module answers.
    std::vector<int> next_answered(std::int64_t now_us) {
        const auto request = next(now_us);
        cb_bus_turns_refused(&turns);
        return request;
    }

    std::vector<cb_sample> take(const std::vector<std::uint16_t> &registers, std::size_t max = 64) {
        std::vector<cb_sample> samples(max);
        samples.resize(
            cb_bus_turns_take(&turns, config.get(), registers.data(), samples.data(), max));
        return samples;
    }
};

TEST(bus_turns, registers_side_by_side_are_one_request_and_gaps_are_not_read) {
    rig r(500);
    r.add(2, 11);
    r.add(1, 5, CB_NUMBER_FLOAT32);
    r.add(2, 10);
    r.add(2, 10);  // used twice
    r.add(2, 13);  // 12 is nobody's
    r.add(1, 7);
    r.add(1, 8, CB_NUMBER_INT16, CB_SOURCE_PLC);  // not on the bus
    r.start();
    EXPECT_EQ(r.next_answered(0), (std::vector<int>{1, 5, 3}));
    EXPECT_EQ(r.next_answered(0), (std::vector<int>{2, 10, 2}));
    EXPECT_EQ(r.next_answered(0), (std::vector<int>{2, 13, 1}));
    EXPECT_EQ(r.next(0), (std::vector<int>{0, 0, 0}));
}

// A module may have a status in the first half of a number: both signals name the same register.
TEST(bus_turns, signals_of_one_and_two_registers_begin_at_the_same_one) {
    for (const bool wide_first : {false, true}) {
        rig r(500);
        r.add(1, 4, wide_first ? CB_NUMBER_INT32 : CB_NUMBER_INT16);
        r.add(1, 4, wide_first ? CB_NUMBER_INT16 : CB_NUMBER_INT32);
        r.start();
        EXPECT_EQ(r.next(0), (std::vector<int>{1, 4, 2})) << wide_first;
        const auto samples = r.take({1, 2});
        ASSERT_EQ(samples.size(), 2u) << wide_first;
        EXPECT_EQ(samples[wide_first ? 1 : 0].raw, 1.0f);
        EXPECT_EQ(samples[wide_first ? 0 : 1].raw, 65538.0f);
        EXPECT_EQ(r.next(0), (std::vector<int>{0, 0, 0})) << wide_first;
    }
}

TEST(bus_turns, a_request_has_at_most_125_registers) {
    rig r(500);
    for (std::uint16_t i = 0; i < 64; ++i)
        r.add(1, static_cast<std::uint16_t>(2 * i), CB_NUMBER_INT32);
    r.start();
    EXPECT_EQ(r.next_answered(0), (std::vector<int>{1, 0, 124}));
    EXPECT_EQ(r.next(0), (std::vector<int>{1, 124, 4}));
}

TEST(bus_turns, the_last_register_of_all_is_read) {
    rig r(500);
    r.add(1, 65535);
    r.add(1, 65534);
    r.start();
    EXPECT_EQ(r.next(0), (std::vector<int>{1, 65534, 2}));
}

TEST(bus_turns, answers_become_samples_at_the_time_of_asking) {
    rig r(500);
    r.add(1, 4);
    r.add(1, 2, CB_NUMBER_INT32);
    r.start();
    EXPECT_EQ(r.next(7 * ms), (std::vector<int>{1, 2, 3}));
    const auto samples = r.take({0xFFFF, 0xFFFE, 215});
    ASSERT_EQ(samples.size(), 2u);
    EXPECT_EQ(samples[0].signal, 0);
    EXPECT_EQ(samples[0].raw, 215.0f);
    EXPECT_EQ(samples[1].signal, 1);
    EXPECT_EQ(samples[1].raw, -2.0f);
    for (const cb_sample &sample : samples) EXPECT_EQ(sample.time_us, 7 * ms);
    EXPECT_EQ(r.take({0, 0, 0}, 1).size(), 1u);
}

TEST(bus_turns, an_answer_is_for_the_signals_of_its_request_alone) {
    rig r(500);
    r.config->buses_count = 2;
    r.add(1, 10);
    r.add(1, 20);
    r.add(2, 10);
    r.add(1, 10);
    r.config->signals[3].bus = 1;
    r.start();
    for (const auto &[request, signal] :
         {std::pair(std::vector<int>{1, 10, 1}, 0), {{1, 20, 1}, 1}, {{2, 10, 1}, 2}}) {
        EXPECT_EQ(r.next(0), request);
        const auto samples = r.take({7});
        ASSERT_EQ(samples.size(), 1u) << signal;
        EXPECT_EQ(samples[0].signal, signal);
    }
}

TEST(bus_turns, modules_come_in_turn_each_in_its_time) {
    rig r(300);
    for (std::uint8_t unit = 1; unit <= 3; ++unit) r.add(unit, 0);
    r.start();
    std::vector<int> order;
    for (std::int64_t now = 0; now < 900 * ms; now += 20 * ms) {
        const auto one = r.next(now);
        if (one[0] == 0) continue;
        order.push_back(one[0]);
        r.take({1});
    }
    EXPECT_EQ(order, (std::vector<int>{1, 2, 3, 1, 2, 3, 1, 2, 3}));
}

// Two hours with a module that is dead in the midst of them: the others keep their pace, it is
// polled every 32 turns, and at once at the full pace when it is back.
TEST(bus_turns, a_silent_module_costs_the_others_little) {
    rig r(500);
    for (std::uint8_t unit = 1; unit <= 3; ++unit) r.add(unit, 0);
    r.start();
    std::map<int, int> before, during, after;
    for (std::int64_t now = 0; now < 7200000 * ms; now += 50 * ms) {
        const auto one = r.next(now);
        if (one[0] == 0) continue;
        const bool dead = now >= 2400000 * ms && now < 4800000 * ms;
        ++(now < 2400000 * ms ? before : dead ? during : after)[one[0]];
        if (one[0] == 2 && dead) continue;
        one[0] == 3 ? cb_bus_turns_refused(&r.turns) : (void)r.take({1});
    }
    for (int unit : {1, 3}) {
        EXPECT_NEAR(before[unit], 4800, 2);
        EXPECT_NEAR(during[unit], 4800, 2);
        EXPECT_NEAR(after[unit], 4800, 2);
    }
    EXPECT_NEAR(before[2], 4800, 2);
    EXPECT_NEAR(during[2], 4800 / 32, 10);
    EXPECT_GE(after[2], 4800 - 33);
}

// Its reply may still come, and nothing in it tells which registers it is of.
TEST(bus_turns, behind_a_request_without_a_reply_its_module_is_left_alone) {
    rig r(500);
    for (const int reg : {0, 3, 6}) r.add(1, static_cast<std::uint16_t>(reg));
    r.add(2, 0);
    r.start();
    EXPECT_EQ(r.next(0), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(r.next_answered(70 * ms), (std::vector<int>{2, 0, 1}));
    EXPECT_EQ(r.next(569 * ms), (std::vector<int>{0, 0, 0}));
    EXPECT_EQ(r.next_answered(570 * ms), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(r.next_answered(571 * ms), (std::vector<int>{1, 3, 1}));
    EXPECT_EQ(r.next(572 * ms), (std::vector<int>{1, 6, 1}));
    r.take({1});
    EXPECT_EQ(r.next_answered(573 * ms), (std::vector<int>{2, 0, 1}));
    EXPECT_EQ(r.next(1070 * ms), (std::vector<int>{1, 0, 1})) << "no reply is missing";
}

TEST(bus_turns, a_line_that_is_back_has_every_module_due) {
    rig r(60000);
    for (const int reg : {0, 3}) r.add(1, static_cast<std::uint16_t>(reg));
    r.add(2, 0);
    r.start();
    EXPECT_EQ(r.next_answered(0), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(r.next(0), (std::vector<int>{1, 3, 1}));
    cb_bus_turns_line_is_back(&r.turns, 5 * ms);
    EXPECT_EQ(r.next_answered(5 * ms), (std::vector<int>{2, 0, 1}));
    EXPECT_EQ(r.next_answered(5 * ms), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(r.next_answered(5 * ms), (std::vector<int>{1, 3, 1}));
    EXPECT_EQ(r.next(5 * ms), (std::vector<int>{0, 0, 0}));
}

TEST(bus_turns, a_line_that_is_gone_says_nothing_of_a_module) {
    rig r(500);
    r.add(1, 0);
    r.start();
    EXPECT_EQ(r.next(0), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(r.turns.turns[0].silent, 1);
    cb_bus_turns_unasked(&r.turns);
    EXPECT_EQ(r.turns.turns[0].silent, 0);
    EXPECT_FALSE(r.turns.awaits);
    cb_bus_turns_unasked(&r.turns);
    EXPECT_EQ(r.turns.turns[0].silent, 0);
}

TEST(bus_turns, a_bus_without_signals_is_never_due) {
    rig r(500);
    r.start();
    EXPECT_EQ(r.next(1000 * ms), (std::vector<int>{0, 0, 0}));
}

}  // namespace
