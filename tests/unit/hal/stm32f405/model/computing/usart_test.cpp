// SPDX-License-Identifier: MIT
// Serial ports, time and the Modbus master of the STM32F405 on modelled registers, with an
// interrupt at every access to a register or to a word that an interrupt shares.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/stm32f405_model.h"

extern "C" {
#define _Noreturn __attribute__((noreturn))
#include "firmware/config/rtu_budget.h"
#include "hal/stm32f405/box_hal.h"
#undef _Noreturn
}

namespace {

using stm32f405::cycles_per_us;
using stm32f405::machine;

constexpr cb_clock fast = {CB_CLOCK_CRYSTAL, 168000000, 42000000, 42000000};
constexpr unsigned plc = CB_USART_PLC;

// A machine whose time runs and whose PLC port is open at 115 200 baud, 8E1.
struct rig {
    machine m;
    explicit rig(std::uint64_t from_cycle = 0) {
        m.cycles = from_cycle;
        stm32f405::the_machine = &m;
        cb_time_start(fast.core_hz);
        cb_usart_prepare(&fast);
        cb_usart_open(CB_USART_PLC, 115200, CB_USART_EVEN, 1);
    }
    ~rig() { stm32f405::the_machine = nullptr; }
    rig(const rig &) = delete;
    rig &operator=(const rig &) = delete;

    stm32f405::serial_port &port() { return m.ports[plc]; }

    // in : from which cycle on the bytes come. out: the cycle at which the last one has
    std::uint64_t receive(const std::vector<std::uint8_t> &bytes, std::uint64_t at) {
        for (const std::uint8_t byte : bytes)
            port().line.push_back({at += port().byte_cycles(), byte, 0});
        return at;
    }

    std::vector<std::uint8_t> take() {
        std::vector<std::uint8_t> taken;
        cb_usart_byte one;
        while (cb_usart_take(CB_USART_PLC, &one)) taken.push_back(one.byte);
        return taken;
    }
};

std::vector<std::uint8_t> counted(std::size_t count) {
    std::vector<std::uint8_t> bytes(count);
    std::iota(bytes.begin(), bytes.end(), std::uint8_t{1});
    return bytes;
}

std::vector<std::uint8_t> bytes_of(const std::vector<stm32f405::sent_byte> &sent) {
    std::vector<std::uint8_t> bytes;
    for (const auto &one : sent) bytes.push_back(one.byte);
    return bytes;
}

// ---- time ----

TEST(stm32f405_time, is_right_and_never_goes_back) {
    for (std::uint64_t from = 0; from < 200; ++from) {
        rig r(from);
        const double begin_us = r.m.us();
        std::int64_t last_us = cb_time_us();
        while (r.m.us() - begin_us < 2100) {
            const std::int64_t now_us = cb_time_us();
            ASSERT_GE(now_us, last_us);
            ASSERT_NEAR(static_cast<double>(now_us), r.m.us() - begin_us, 4);
            last_us = now_us;
            r.m.compute(997);  // meets the wrap of the counter at every place
        }
    }
}

// In an interrupt SysTick's waits: the counter may have begun anew and the milliseconds not yet.
TEST(stm32f405_time, is_right_in_an_interrupt) {
    for (std::uint64_t before = 0; before < 400; ++before) {
        rig r;
        r.m.run_to(168000 - 400 + before);
        r.m.handling = true;
        const double begin_us = r.m.us();
        const std::int64_t now_us = cb_time_us();
        const std::int64_t then_us = cb_time_us();
        r.m.handling = false;
        EXPECT_NEAR(static_cast<double>(now_us), begin_us, 3) << before;
        EXPECT_GE(then_us, now_us) << before;
    }
}

// ---- reception ----

TEST(stm32f405_usart, bytes_arrive_in_order_wherever_they_interrupt) {
    const auto bytes = counted(6);
    for (std::uint64_t phase = 0; phase < 120; ++phase) {
        rig r;
        const std::uint64_t last = r.receive(bytes, r.m.cycles + phase);
        std::vector<std::uint8_t> taken;
        while (r.m.cycles < last + 1000) {
            const auto some = r.take();
            taken.insert(taken.end(), some.begin(), some.end());
        }
        ASSERT_EQ(taken, bytes) << phase;
    }
}

TEST(stm32f405_usart, a_full_ring_loses_bytes_and_marks_the_next) {
    rig r;
    const auto before = cb_usart_counted(CB_USART_PLC);
    r.m.compute_to(r.receive(std::vector<std::uint8_t>(256, 7), r.m.cycles) + 1000);
    r.m.compute_to(r.receive({8, 9}, r.m.cycles) + 1000);
    EXPECT_EQ(r.take(), std::vector<std::uint8_t>(256, 7));
    EXPECT_EQ(cb_usart_counted(CB_USART_PLC).lost - before.lost, 2u);
    EXPECT_EQ(cb_usart_counted(CB_USART_PLC).received - before.received, 256u);
    r.m.compute_to(r.receive({10, 11}, r.m.cycles) + 1000);
    cb_usart_byte one{};
    ASSERT_TRUE(cb_usart_take(CB_USART_PLC, &one));
    EXPECT_TRUE(one.bad);
    ASSERT_TRUE(cb_usart_take(CB_USART_PLC, &one));
    EXPECT_FALSE(one.bad);
}

// Two bytes come at once before any access of the handler, and one is lost by an overrun: what was
// taken has no hole before the byte that is marked.
TEST(stm32f405_usart, an_overrun_is_marked_wherever_it_comes) {
    unsigned overruns = 0;
    for (std::uint64_t access = 1; access < 60; ++access) {
        rig r;
        const auto at_once = [&r](const std::vector<std::uint8_t> &bytes) {
            for (const std::uint8_t byte : bytes) r.port().line.push_back({r.m.cycles, byte, 0});
        };
        const std::uint64_t from = r.m.accesses;
        r.m.at_access.emplace(from + 3, [&] { at_once({1}); });
        r.m.at_access.emplace(from + 3 + access, [&] {
            at_once({2, 3});
            r.receive({4}, r.m.cycles);
        });
        std::vector<std::uint8_t> good;
        bool marked = false;
        const auto take = [&] {
            cb_usart_byte one{};
            while (cb_usart_take(CB_USART_PLC, &one)) {
                marked = marked || one.bad;
                if (!marked) good.push_back(one.byte);
            }
        };
        while (r.m.accesses < from + 100) take();
        r.m.compute(2 * r.port().byte_cycles());
        take();
        overruns += marked;
        ASSERT_EQ(good, counted(good.size())) << access;
        ASSERT_TRUE(marked || good.size() == 4) << access;
    }
    EXPECT_GT(overruns, 20u);
}

TEST(stm32f405_usart, parity_framing_and_noise_are_marked) {
    for (const std::uint32_t error : {CB_USART_SR_PE, CB_USART_SR_FE, CB_USART_SR_NE}) {
        rig r;
        r.port().line.push_back({r.m.cycles + 100, 0x55, error});
        r.port().line.push_back({r.m.cycles + 100000, 0x56, 0});
        r.m.compute(200);
        cb_usart_byte one{};
        ASSERT_TRUE(cb_usart_take(CB_USART_PLC, &one));
        EXPECT_TRUE(one.bad);
        r.m.compute(100000);
        ASSERT_TRUE(cb_usart_take(CB_USART_PLC, &one));
        EXPECT_FALSE(one.bad);
    }
}

// ---- sending ----

TEST(stm32f405_usart, a_frame_leaves_whole_and_the_driver_frees_the_line_behind_it) {
    for (std::uint64_t phase = 0; phase < 120; ++phase) {
        rig r(phase * 11);
        const auto bytes = counted(8);
        ASSERT_TRUE(cb_usart_send(CB_USART_PLC, bytes.data(), bytes.size()));
        while (cb_usart_busy(CB_USART_PLC)) r.m.compute(phase);
        ASSERT_EQ(bytes_of(r.port().sent), bytes) << phase;
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            ASSERT_TRUE(r.port().sent[i].driven) << phase;
            const std::uint64_t follows = i > 0 ? r.port().sent[i - 1].to : r.port().sent[0].from;
            ASSERT_EQ(r.port().sent[i].from, follows) << phase;
        }
        ASSERT_FALSE(r.m.driven(r.port())) << phase;
        ASSERT_LT(r.m.cycles, r.port().sent.back().to + 1000) << phase;
    }
}

// The pending bit takes some accesses until the interrupt comes: at each of those of the question.
TEST(stm32f405_usart, is_busy_until_the_last_stop_bit_wherever_the_interrupt_comes) {
    for (unsigned latency = 0; latency < 40; ++latency) {
        rig r;
        r.m.latency = latency;
        const std::uint8_t byte = 0x55;
        ASSERT_TRUE(cb_usart_send(CB_USART_PLC, &byte, 1));
        while (cb_usart_busy(CB_USART_PLC)) {
        }
        ASSERT_EQ(r.port().sent.size(), 1u) << latency;
        ASSERT_GE(r.m.cycles, r.port().sent[0].to) << latency;
    }
}

// SysTick comes while the port is opened anew and calls for the interrupt of a port that is busy.
TEST(stm32f405_usart, opening_leaves_nothing_of_before_wherever_systick_comes) {
    const auto bytes = counted(100);
    for (std::uint64_t access = 1; access < 60; ++access) {
        rig r;
        ASSERT_TRUE(cb_usart_send(CB_USART_PLC, bytes.data(), bytes.size()));
        r.m.compute(500 * cycles_per_us);
        r.m.step();
        r.m.at_access.emplace(r.m.accesses + access, [&r] { r.m.systick_pending = true; });
        cb_usart_open(CB_USART_PLC, 115200, CB_USART_EVEN, 1);
        const std::size_t sent = r.port().sent.size();
        r.m.compute(5000 * cycles_per_us);
        for (int i = 0; i < 200; ++i) r.m.step();
        ASSERT_FALSE(cb_usart_busy(CB_USART_PLC)) << access;
        ASSERT_EQ(cb_usart_room(CB_USART_PLC), 256u) << access;
        ASSERT_LE(r.port().sent.size(), sent + 1) << access;  // that was in the hardware
        ASSERT_FALSE(r.m.driven(r.port())) << access;
    }
}

TEST(stm32f405_usart, what_finds_no_room_is_not_sent_in_part) {
    rig r;
    const std::vector<std::uint8_t> bytes(257, 1);
    EXPECT_FALSE(cb_usart_send(CB_USART_PLC, bytes.data(), bytes.size()));
    EXPECT_FALSE(cb_usart_busy(CB_USART_PLC));
}

// ---- sleep ----

// An interrupt at every access around the test and the WFI: none is slept over.
TEST(stm32f405_time, no_interrupt_is_slept_over) {
    for (std::uint64_t access = 1; access < 30; ++access) {
        rig r;
        r.m.compute(100 * cycles_per_us);
        r.m.step();
        bool came = false;
        std::uint64_t came_at = 0;
        r.m.at_access.emplace(r.m.accesses + access, [&] {
            r.receive({1}, r.m.cycles - r.port().byte_cycles());
            came = true;
            came_at = r.m.cycles;
        });
        cb_usart_byte one{};
        for (;;) {
            const std::uint32_t seen = cb_time_interrupts();
            if (cb_usart_take(CB_USART_PLC, &one)) break;
            cb_time_sleep(seen);
        }
        ASSERT_TRUE(came) << access;
        EXPECT_LT(r.m.cycles - came_at, 10 * cycles_per_us) << access;
    }
}

// ---- the Modbus master and the board ----

std::vector<std::uint8_t> framed(std::vector<std::uint8_t> bytes) {
    const std::uint16_t crc = cb_rtu_crc(bytes.data(), bytes.size());
    bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
    return bytes;
}

// The board against a slave that answers each request after its silence and `delay` cycles more.
struct board_rig : rig {
    cb_board board{};
    cb_hal hal = cb_board_hal(&board);
    std::uint64_t delay = 0, replied_at = 0;
    std::size_t seen = 0;
    std::uint16_t registers[2] = {0, 0};

    explicit board_rig(std::uint64_t from_cycle = 0) : rig(from_cycle) {
        cb_plc_config config{};
        config.serial.line = {115200, CB_PARITY_EVEN, 1};
        config.serial.slave_delay_us = 2000;
        config.exchange = CB_EXCHANGE_FC3_FC16;
        config.read = {0, 2, false};
        config.write = {50, 4, false};
        const cb_rtu_manners manners = cb_rtu_manners_of(&config);
        cb_board_start_plc(&board, 5, &manners, 0);
        board.dialog.doubtful = false;
        board.period_us = 30000;
        board.idle = board.meanwhile = [] {};
        port().on_idle = [this] { answer(); };
    }

    void answer() {
        auto request = bytes_of(port().sent);
        request.erase(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(seen));
        seen = port().sent.size();
        ASSERT_GE(request.size(), 8u);
        const std::vector<std::uint8_t> reply =
            request[1] == CB_MODBUS_READ
                ? std::vector<std::uint8_t>{5, 3, 4, 0x12, 0x34, 0xAB, 0xCD}
                : std::vector<std::uint8_t>(request.begin(), request.begin() + 6);
        replied_at = receive(framed(reply), m.cycles + 2000 * cycles_per_us + delay);
    }

    cb_transfer read() { return hal.read(&board, 0, 2, registers, cb_time_us() + 20000); }
};

// A line without a fault: replies come at any time, and wake the program or find it awake.
TEST(stm32f405_wire, a_faultless_line_has_no_errors) {
    board_rig r;
    for (unsigned i = 0; i < 300; ++i) {
        r.delay = i * 97 % 20000;
        ASSERT_EQ(r.read(), CB_TRANSFER_OK) << i;
        ASSERT_EQ(r.registers[0], 0x1234);
        ASSERT_EQ(r.registers[1], 0xABCD);
    }
    EXPECT_EQ(r.board.plc.counters.replies, 300u);
}

// out: the delay of a reply whose last byte comes with SysTick, in a rig of its own
std::uint64_t delay_to_systick() {
    board_rig r;
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
    return 168000 - (r.replied_at - r.m.systick_from) % 168000;
}

// The last byte comes around SysTick, at each access of the turn for which that wakes the program:
// it is taken then, not a millisecond later.
TEST(stm32f405_wire, a_reply_wakes_the_board_wherever_it_comes) {
    const std::uint64_t to_systick = delay_to_systick();
    for (std::uint64_t delay = to_systick - 100; delay < to_systick + 800; delay += 4) {
        board_rig r;
        r.delay = delay;
        ASSERT_EQ(r.read(), CB_TRANSFER_OK);
        ASSERT_LT(r.m.cycles - r.replied_at, 20 * cycles_per_us) << delay;
    }
}

// A byte in the middle does so, on slower and faster programs: it may come between the look at the
// clock and the look into the ring.
TEST(stm32f405_wire, no_byte_is_dated_71_minutes_back_wherever_it_comes) {
    const std::uint64_t to_systick = delay_to_systick() + 5 * 11 * 1458;
    for (std::uint64_t access_cycles = 6; access_cycles < 24; access_cycles += 3) {
        for (std::uint64_t delay = to_systick; delay < to_systick + 60 * access_cycles;
             delay += 9) {
            board_rig r;
            r.m.access_cycles = access_cycles;
            r.delay = delay;
            ASSERT_EQ(r.read(), CB_TRANSFER_OK);
            ASSERT_EQ(r.board.plc.counters.replies, 1u) << delay;
            ASSERT_EQ(r.board.plc.counters.crc_errors, 0u) << delay;
            ASSERT_EQ(r.board.plc.counters.noise_bytes, 0u) << delay;
            ASSERT_EQ(r.board.plc.counters.retries, 0u) << delay;
        }
    }
}

// What is done in the time between ends just before, at and just after the tick.
TEST(stm32f405_board, a_tick_is_not_slept_over) {
    static board_rig *rigged;
    static std::uint64_t busy_until;
    for (std::uint64_t before = 0; before < 400; ++before) {
        board_rig r;
        rigged = &r;
        EXPECT_EQ(cb_board_wait_tick(&r.board), 0u);
        const auto next_us = static_cast<std::uint64_t>(r.board.next_tick_us + r.board.period_us);
        busy_until = r.m.systick_from + next_us * cycles_per_us - 390 + before;
        r.board.idle = [] {
            if (busy_until < rigged->m.cycles + 900 * cycles_per_us)
                rigged->m.compute_to(busy_until);
        };
        EXPECT_EQ(cb_board_wait_tick(&r.board), 0u);
        EXPECT_LT(cb_time_us() - r.board.next_tick_us, 20) << before;
    }
}

}  // namespace
