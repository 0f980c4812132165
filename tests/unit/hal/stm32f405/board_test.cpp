// SPDX-License-Identifier: MIT
// What of the STM32F405's program needs no hardware: the Modbus RTU master on a port that is played
// here, in virtual time, and numbers as text.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <string>
#include <vector>

extern "C" {
#include "firmware/config/rtu_budget.h"
#include "hal/stm32f405/box_hal.h"
#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/text.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/watchdog.h"
#include "hal/stm32f405/wire.h"
}

namespace {

// The port: what was sent and when, what is to be received and when.
struct port {
    std::int64_t now_us = 0;
    std::int64_t sending_until_us = 0;
    std::int64_t byte_us = 0;
    std::deque<cb_usart_byte> received;
    std::vector<std::uint8_t> sent;
    std::vector<std::int64_t> sent_us;
    std::uint32_t baud = 0;
    cb_usart_parity parity = CB_USART_NONE;
    unsigned stop_bits = 0;
    std::function<void()> on_send = [] {};
    unsigned feeds = 0;
    std::vector<std::uint32_t> watchdog_ms;
};
port the_port;

}  // namespace

extern "C" {
void cb_usart_open(enum cb_usart, uint32_t baud, enum cb_usart_parity parity, unsigned stop_bits) {
    the_port.baud = baud;
    the_port.parity = parity;
    the_port.stop_bits = stop_bits;
}

bool cb_usart_take(enum cb_usart, struct cb_usart_byte *byte) {
    auto &received = the_port.received;
    if (received.empty() || static_cast<std::int32_t>(static_cast<std::uint32_t>(the_port.now_us) -
                                                      received.front().time_us) < 0)
        return false;
    *byte = received.front();
    received.pop_front();
    return true;
}

bool cb_usart_send(enum cb_usart, const void *bytes, size_t size) {
    const auto *from = static_cast<const std::uint8_t *>(bytes);
    the_port.sent.assign(from, from + size);
    the_port.sent_us.push_back(the_port.now_us);
    the_port.sending_until_us =
        the_port.now_us + static_cast<std::int64_t>(size) * the_port.byte_us;
    the_port.on_send();
    return true;
}

int64_t cb_time_us(void) {
    return the_port.now_us;
}
uint32_t cb_time_interrupts(void) {
    return 0;
}
// Until the next interrupt: SysTick, a byte, the end of sending.
void cb_time_sleep(uint32_t) {
    std::int64_t next_us = (the_port.now_us / 1000 + 1) * 1000;
    const auto at_most = [&](std::int64_t us) {
        if (us > the_port.now_us && us < next_us) next_us = us;
    };
    at_most(the_port.sending_until_us);
    if (!the_port.received.empty()) at_most(the_port.received.front().time_us);
    the_port.now_us = next_us;
}
bool cb_guard_intact(void) {
    return true;
}
void cb_watchdog_start(uint32_t timeout_ms) {
    the_port.watchdog_ms.push_back(timeout_ms);
}
void cb_watchdog_feed(void) {
    ++the_port.feeds;
}
[[noreturn]] void cb_restart(int cause);
[[noreturn]] void cb_restart(int) {
    std::abort();
}

bool cb_usart_busy(enum cb_usart) {
    return the_port.now_us < the_port.sending_until_us;
}
}

namespace {

constexpr std::int64_t byte_us = 96;  // 8E1 at 115 200 baud
constexpr std::int64_t silence_us = 1750;

struct rig {
    cb_wire wire{};
    std::uint16_t registers[4] = {7, 7, 7, 7};
    cb_modbus_request request{};

    explicit rig(std::int64_t start_us = 1000000, std::uint32_t lumps_us = 0) {
        the_port = port{};
        the_port.now_us = start_us;
        the_port.byte_us = byte_us;
        const cb_rtu_line line = {115200, CB_PARITY_EVEN, 1};
        cb_wire_start(&wire, CB_USART_PLC, &line, lumps_us);
        request.function = CB_MODBUS_READ;
        request.read_start = 0x10;
        request.read_count = 2;
    }

    void send(std::int64_t patience_us) {
        cb_wire_send(&wire, CB_RTU_SEND_REQUEST, 5, &request, registers,
                     the_port.now_us + patience_us);
    }

    // Bytes on the line from `at_us` on, one after the other.
    void receive(const std::vector<std::uint8_t> &bytes, std::int64_t at_us, bool bad = false) {
        for (const std::uint8_t byte : bytes) {
            the_port.received.push_back({static_cast<std::uint32_t>(at_us), byte, bad});
            at_us += byte_us;
        }
    }

    // Polls every 10 us until it is done; out: how long that took.
    std::int64_t run() {
        const std::int64_t from_us = the_port.now_us;
        while (!cb_wire_poll(&wire, the_port.now_us)) the_port.now_us += 10;
        return the_port.now_us - from_us;
    }
};

std::vector<std::uint8_t> framed(std::vector<std::uint8_t> bytes) {
    const std::uint16_t crc = cb_rtu_crc(bytes.data(), bytes.size());
    bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
    return bytes;
}

const std::vector<std::uint8_t> reply = framed({5, 3, 4, 0x12, 0x34, 0xAB, 0xCD});

TEST(wire, port_is_opened_as_the_line_is) {
    rig r;
    EXPECT_EQ(the_port.baud, 115200u);
    EXPECT_EQ(the_port.parity, CB_USART_EVEN);
    EXPECT_EQ(the_port.stop_bits, 1u);
}

TEST(wire, a_reply_is_taken_when_its_last_byte_is_there) {
    rig r;
    r.send(20000);
    r.receive(reply, the_port.now_us + 3000);
    const auto took_us = r.run();
    EXPECT_EQ(the_port.sent, framed({5, 3, 0, 0x10, 0, 2}));
    EXPECT_EQ(r.wire.end, CB_RTU_END_REPLY);
    EXPECT_EQ(r.registers[0], 0x1234);
    EXPECT_EQ(r.registers[1], 0xABCD);
    EXPECT_EQ(r.registers[2], 7);
    EXPECT_LE(took_us, 3000 + static_cast<std::int64_t>(reply.size()) * byte_us);
    EXPECT_EQ(r.wire.counters.replies, 1u);
}

// The low 32 bits of the clock wrap every 72 minutes.
TEST(wire, a_reply_over_the_wrap_of_the_bytes_clock) {
    rig r((std::int64_t{1} << 33) - 3200);
    r.send(20000);
    r.receive(reply, the_port.now_us + 3000);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_REPLY);
}

// The clock is read, then a byte comes, then the ring is emptied: the byte is newer than the
// reading.
TEST(wire, a_byte_after_the_look_at_the_clock_is_not_dated_71_minutes_back) {
    for (std::int64_t behind_us = 0; behind_us < byte_us; ++behind_us) {
        rig r;
        r.send(20000);
        r.receive(reply, the_port.now_us + 3000);
        bool done = false;
        while (!done) {
            const std::int64_t looked_us = the_port.now_us;
            the_port.now_us += behind_us;
            done = cb_wire_poll(&r.wire, looked_us);
            the_port.now_us = looked_us + byte_us;
        }
        EXPECT_EQ(r.wire.end, CB_RTU_END_REPLY) << behind_us;
        EXPECT_EQ(r.wire.counters.crc_errors, 0u) << behind_us;
    }
}

// The same while the line is awaited to be silent: its silence begins with that byte.
TEST(wire, silence_is_counted_from_a_byte_after_the_look_at_the_clock) {
    rig r;
    r.send(20000);
    const std::int64_t looked_us = the_port.now_us;
    r.receive({0x55}, looked_us + 3);
    the_port.now_us += 3;
    EXPECT_FALSE(cb_wire_poll(&r.wire, looked_us));
    EXPECT_TRUE(the_port.sent.empty());
    r.run();
    ASSERT_EQ(the_port.sent_us.size(), 1u);
    EXPECT_GE(the_port.sent_us[0], looked_us + 3 + silence_us);
}

// A ring that nobody emptied for as long as a silent module of the bus is left alone.
TEST(wire, a_byte_of_half_an_hour_ago_is_old) {
    rig r;
    r.receive({0x55}, the_port.now_us);
    the_port.now_us += std::int64_t{32} * 60 * 1000000;
    const std::int64_t begin_us = the_port.now_us;
    r.send(20000);
    r.run();
    ASSERT_EQ(the_port.sent_us.size(), 1u);
    EXPECT_EQ(the_port.sent_us[0], begin_us);
}

TEST(wire, nothing_is_sent_before_the_line_was_silent) {
    rig r;
    const std::int64_t from_us = the_port.now_us;
    r.receive({1, 2, 3, 4}, from_us - 4 * byte_us);
    r.send(20000);
    r.run();
    ASSERT_EQ(the_port.sent_us.size(), 1u);
    const std::int64_t last_us = from_us - byte_us;
    EXPECT_GE(the_port.sent_us[0], last_us + silence_us);
    EXPECT_LE(the_port.sent_us[0], last_us + silence_us + 20);
    EXPECT_EQ(r.wire.counters.noise_bytes, 4u);
}

TEST(wire, a_line_that_is_never_silent_ends_with_the_time) {
    rig r;
    for (int i = 0; i < 30; ++i) r.receive({0x55}, the_port.now_us + 1000 * i);
    r.send(20000);
    EXPECT_LE(r.run(), 20010);
    EXPECT_EQ(r.wire.end, CB_RTU_END_NOT_SENT);
    EXPECT_TRUE(the_port.sent.empty());
}

// The processor is busy elsewhere until the time of the request is over, or only that of its reply.
TEST(wire, a_request_that_is_looked_at_late_is_not_sent_or_takes_its_reply) {
    rig r;
    r.receive({0x55}, the_port.now_us);
    r.send(5000);
    EXPECT_FALSE(cb_wire_poll(&r.wire, the_port.now_us));
    the_port.now_us += 5000;
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_NOT_SENT);
    EXPECT_TRUE(the_port.sent.empty());
    r.send(5000);
    EXPECT_FALSE(cb_wire_poll(&r.wire, the_port.now_us));
    EXPECT_EQ(the_port.sent.size(), 8u);
    r.receive(reply, the_port.now_us + 3000);
    the_port.now_us += 5000;
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_REPLY);
    EXPECT_EQ(r.registers[0], 0x1234);
}

// They may have been a reply, and more may follow.
TEST(wire, a_frames_worth_of_bytes_before_a_request_that_is_not_sent_leaves_a_doubt) {
    for (const bool wary : {false, true}) {
        rig r;
        r.wire.wary = wary;
        for (int i = 0; i < 30; ++i) r.receive({0x55}, the_port.now_us + 1000 * i);
        r.send(20000);
        r.run();
        EXPECT_EQ(r.wire.end, wary ? CB_RTU_END_STRAY : CB_RTU_END_NOT_SENT);
        EXPECT_TRUE(the_port.sent.empty());
    }
}

TEST(wire, no_answer_ends_with_the_time) {
    rig r;
    r.send(20000);
    EXPECT_LE(r.run(), 20010);
    EXPECT_EQ(r.wire.end, CB_RTU_END_SILENT);
    EXPECT_EQ(r.wire.counters.timeouts, 1u);
    EXPECT_EQ(r.registers[0], 7);
}

TEST(wire, what_comes_while_sending_is_no_answer) {
    rig r;
    r.send(20000);
    r.receive(reply, the_port.now_us + 20 - byte_us);  // before the request is out
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_SILENT);
    EXPECT_EQ(r.registers[0], 7);
}

TEST(wire, a_wrong_byte_spoils_the_reply_at_once_when_it_ends) {
    rig r;
    auto wrong = reply;
    wrong[4] ^= 1;
    r.send(20000);
    r.receive(wrong, the_port.now_us + 3000);
    EXPECT_LE(r.run(), 3000 + static_cast<std::int64_t>(reply.size()) * byte_us + silence_us);
    EXPECT_EQ(r.wire.end, CB_RTU_END_DAMAGED);
    EXPECT_EQ(r.wire.counters.crc_errors, 1u);
    EXPECT_EQ(r.registers[0], 7);
}

// Where bytes come in lumps, a gap ends no frame; a damaged one that is complete need not wait for
// more.
TEST(wire, a_damaged_reply_ends_after_a_short_silence_where_bytes_come_in_lumps) {
    constexpr std::uint32_t lumps_us = 8000;
    auto wrong = reply;
    wrong[4] ^= 1;
    rig r(1000000, lumps_us);
    r.send(30000);
    r.receive(wrong, the_port.now_us + 3000);
    EXPECT_LE(r.run(), 3000 + static_cast<std::int64_t>(reply.size()) * byte_us + silence_us + 20);
    EXPECT_EQ(r.wire.end, CB_RTU_END_DAMAGED);
}

// Two frames with a silence between them are looked at together. A probe waits for the second one.
TEST(wire, a_silence_that_nobody_looked_at_still_separates_frames) {
    for (const auto what : {CB_RTU_SEND_REQUEST, CB_RTU_SEND_PROBE}) {
        rig r;
        cb_wire_send(&r.wire, what, 5, &r.request, r.registers, the_port.now_us + 30000);
        while (r.wire.state != CB_WIRE_LISTENING) {
            EXPECT_FALSE(cb_wire_poll(&r.wire, the_port.now_us));
            the_port.now_us += 10;
        }
        r.receive(framed({6, 3, 4, 0x12, 0x34, 0xAB, 0xCD}), the_port.now_us + 100);
        r.receive(reply, the_port.now_us + 5000);
        the_port.now_us += 10000;
        r.run();
        EXPECT_EQ(r.wire.counters.wrong_units, 1u);
        EXPECT_EQ(r.wire.end, what == CB_RTU_SEND_PROBE ? CB_RTU_END_REPLY : CB_RTU_END_RUBBISH);
    }
}

// The hardware saw a parity or framing error in bytes that are right by luck.
TEST(wire, a_byte_that_the_hardware_calls_bad_is_not_believed) {
    rig r;
    r.send(20000);
    r.receive(reply, the_port.now_us + 3000, true);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_RUBBISH);
    EXPECT_EQ(r.registers[0], 7);
}

TEST(wire, another_units_reply_and_a_refusal_are_distinguished) {
    rig r;
    r.send(20000);
    r.receive(framed({6, 3, 4, 0x12, 0x34, 0xAB, 0xCD}), the_port.now_us + 3000);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_RUBBISH);
    EXPECT_EQ(r.wire.counters.wrong_units, 1u);
    r.send(20000);
    r.receive(framed({5, 0x83, 2}), the_port.now_us + 5000);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_REFUSED);
    EXPECT_EQ(r.wire.exception, 2);
    EXPECT_EQ(r.wire.counters.exceptions, 1u);
}

// The reply to a request that was given up comes before the next one is sent: it is thrown away.
TEST(wire, a_late_reply_before_the_next_request_is_not_taken) {
    rig r;
    r.send(5000);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_SILENT);
    r.receive(reply, the_port.now_us + 100);
    r.send(20000);
    r.run();
    EXPECT_EQ(r.wire.end, CB_RTU_END_SILENT);
    EXPECT_EQ(r.wire.counters.noise_bytes, reply.size());
}

TEST(wire, a_request_that_cannot_be_is_not_sent) {
    rig r;
    r.request.read_count = 126;
    r.send(20000);
    EXPECT_EQ(r.run(), 0);
    EXPECT_EQ(r.wire.end, CB_RTU_END_NOT_SENT);
    EXPECT_TRUE(the_port.sent.empty());
}

// The whole board: cycles of 30 ms against a slave that answers when and what the test says.
struct board_rig {
    cb_board board{};
    cb_hal hal = cb_board_hal(&board);
    std::int64_t delay_us = 1000;  // of the slave
    std::uint16_t value = 100;     // of both registers; counts the requests
    std::function<void(std::vector<std::uint8_t> &)> change = [](auto &) {};
    std::uint16_t registers[2] = {0, 0};

    board_rig() {
        the_port = port{};
        the_port.now_us = 1000000;
        the_port.byte_us = byte_us;
        the_port.on_send = [this] { answer(); };
        cb_plc_config plc{};
        plc.serial.line = {115200, CB_PARITY_EVEN, 1};
        plc.serial.slave_delay_us = 2000;
        plc.exchange = CB_EXCHANGE_FC23;
        plc.read = {0, 2, false};
        plc.write = {50, 4, false};
        const cb_rtu_manners manners = cb_rtu_manners_of(&plc);
        cb_board_start_plc(&board, 5, &manners, 0);
        board.dialog.doubtful = false;
        board.period_us = 30000;
        board.idle = board.meanwhile = [] { the_port.now_us += 5; };
    }

    void answer() {
        const auto &sent = the_port.sent;
        const bool probe = sent[1] == CB_MODBUS_READ && sent[5] % 2 == 1;
        if (!probe) ++value;
        const auto low = static_cast<std::uint8_t>(value);
        std::vector<std::uint8_t> bytes = {5, 3, 4, 0, low, 0, low};
        if (probe) bytes = {5, 3, 2, 0, 0};
        if (probe && sent[5] == 3) bytes = {5, 3, 6, 0, 0, 0, 0, 0, 0};
        if (sent[1] == CB_MODBUS_WRITE) bytes = {5, 16, sent[2], sent[3], sent[4], sent[5]};
        bytes = framed(bytes);
        change(bytes);
        std::int64_t at_us = the_port.sending_until_us + delay_us;
        for (const std::uint8_t byte : bytes) {
            the_port.received.push_back({static_cast<std::uint32_t>(at_us), byte, false});
            at_us += byte_us;
        }
    }

    std::int64_t deadline_us = 0;
    void tick() {
        EXPECT_EQ(hal.wait_tick(&board), 0u);
        deadline_us = the_port.now_us + 24000;
    }

    cb_transfer read() {
        const auto result = hal.read(&board, 0, 2, registers, deadline_us);
        EXPECT_LE(the_port.now_us, deadline_us + 200);
        return result;
    }

    cb_transfer write() {
        const std::uint16_t words[1] = {7};
        const auto result = hal.write(&board, 50, 1, words, deadline_us);
        EXPECT_LE(the_port.now_us, deadline_us + 200);
        return result;
    }
};

TEST(board, reads_and_writes) {
    board_rig r;
    for (int cycle = 0; cycle < 5; ++cycle) {
        r.tick();
        EXPECT_EQ(r.read(), CB_TRANSFER_OK);
        EXPECT_EQ(r.registers[0], r.value);
        EXPECT_EQ(r.write(), CB_TRANSFER_OK);
    }
    EXPECT_EQ(r.board.plc.counters.requests, 10u);
    r.hal.feed_watchdog(&r.board);
    EXPECT_EQ(the_port.feeds, 1u);
}

// Until then it has the time of the start, in which the file is loaded.
TEST(board, the_first_cycle_shortens_the_watchdogs_time) {
    board_rig r;
    r.board.watchdog_ms = 300;
    EXPECT_TRUE(the_port.watchdog_ms.empty());
    for (int cycle = 0; cycle < 3; ++cycle) r.hal.feed_watchdog(&r.board);
    EXPECT_EQ(the_port.watchdog_ms, std::vector<std::uint32_t>{300});
    EXPECT_EQ(the_port.feeds, 3u);
}

// A reply that comes in a later cycle is never taken for that cycle's, whenever it comes. The slave
// answers one after the other.
TEST(board, a_late_reply_is_not_taken_for_another) {
    for (std::int64_t late_us = 22000; late_us < 120000; late_us += 500) {
        board_rig r;
        r.tick();
        ASSERT_EQ(r.read(), CB_TRANSFER_OK);
        r.tick();
        r.delay_us = late_us;
        EXPECT_EQ(r.read(), CB_TRANSFER_UNKNOWN);
        r.delay_us = 1000;
        const auto before = r.value;
        for (int cycle = 0; cycle < 6; ++cycle) {
            r.tick();
            const bool good = r.read() == CB_TRANSFER_OK;
            EXPECT_TRUE(!good || r.registers[0] == r.value) << late_us;
        }
        EXPECT_GE(r.value, before + 2) << "the next request goes out once it has come";
        EXPECT_EQ(r.registers[0], r.value);
    }
}

TEST(board, the_first_frame_of_all_is_a_probe) {
    board_rig r;
    r.board.dialog.doubtful = true;
    r.tick();
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
    EXPECT_EQ(r.board.plc.counters.probes, 1u);
    EXPECT_EQ(r.board.plc.counters.requests, 2u);
}

TEST(board, a_spoilt_reply_is_asked_for_again_at_once) {
    board_rig r;
    int left = 1;
    r.change = [&left](std::vector<std::uint8_t> &bytes) {
        bytes[3] ^= static_cast<std::uint8_t>(left-- > 0);
    };
    r.tick();
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
    EXPECT_EQ(r.registers[0], r.value);
    EXPECT_EQ(r.board.plc.counters.retries, 1u);
    r.tick();
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
}

TEST(board, repeating_a_reading_leaves_the_time_of_the_write) {
    board_rig r;
    r.board.dialog.manners.reserve_us = 9000;
    r.tick();
    r.change = [](std::vector<std::uint8_t> &bytes) { bytes[3] ^= 1; };
    EXPECT_EQ(r.read(), CB_TRANSFER_UNKNOWN);
    EXPECT_GE(r.board.plc.counters.retries, 1u);
    EXPECT_LE(the_port.now_us, r.deadline_us - 9000 + 200);
    r.change = [](std::vector<std::uint8_t> &) {};
    EXPECT_EQ(r.write(), CB_TRANSFER_OK);
}

TEST(board, bytes_that_nobody_asked_for_are_followed_by_a_probe) {
    board_rig r;
    r.tick();
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
    for (const std::uint8_t byte : framed({5, 3, 4, 9, 9, 9, 9}))
        the_port.received.push_back({static_cast<std::uint32_t>(the_port.now_us), byte, false});
    EXPECT_EQ(r.read(), CB_TRANSFER_OK);
    EXPECT_EQ(r.registers[0], r.value);
    EXPECT_EQ(r.board.plc.counters.probes, 1u);
}

TEST(board, what_is_refused_and_what_has_no_time_is_distinguished) {
    board_rig r;
    r.tick();
    r.change = [](std::vector<std::uint8_t> &bytes) { bytes = framed({5, 0x83, 2}); };
    EXPECT_EQ(r.read(), CB_TRANSFER_REFUSED);
    r.deadline_us = the_port.now_us + 3000;
    const auto requests = r.board.plc.counters.requests;
    EXPECT_EQ(r.write(), CB_TRANSFER_FAILED);
    EXPECT_EQ(r.board.plc.counters.requests, requests);
}

TEST(board, ticks_keep_their_places_and_missed_ones_are_skipped) {
    board_rig r;
    r.tick();
    const std::int64_t first_us = the_port.now_us;
    EXPECT_LT(first_us % 1000, 10);
    r.tick();
    EXPECT_LT(the_port.now_us - first_us - 30000, 10);
    the_port.now_us += 70000;
    EXPECT_EQ(r.hal.wait_tick(&r.board), 2u);
    EXPECT_LT(the_port.now_us - first_us - 4 * 30000, 10);
}

TEST(board, samples_are_handed_over_once) {
    board_rig r;
    r.board.samples[r.board.waiting++] = {3, 21.5f, 77};
    cb_sample list[64];
    ASSERT_EQ(r.hal.samples(&r.board, list, 64), 1u);
    EXPECT_EQ(list[0].signal, 3);
    EXPECT_EQ(r.hal.samples(&r.board, list, 64), 0u);
}

std::string words(const cb_text &text) {
    return {text.bytes, text.length};
}

template <typename F>
std::string text_of(F put) {
    cb_text text{};
    put(&text);
    return words(text);
}

TEST(text, numbers) {
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_unsigned(t, 0); }), "0");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_unsigned(t, 4294967295u); }), "4294967295");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_signed64(t, INT64_MIN); }),
              "-9223372036854775808");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_hex(t, 0xBEEF, 4); }), "beef");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_hex(t, 0xBEEF, 8); }), "0000beef");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_thousandths(t, -12045, 3); }), "-12.045");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_thousandths(t, 999, 1); }), "0.9");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_float_bits(t, -2.0f); }), "c0000000");
}

TEST(text, tenths) {
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_tenths(t, 12.34f); }), "+12.3");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_tenths(t, -0.06f); }), "-0.1");
    EXPECT_EQ(text_of([](cb_text *t) { cb_text_put_tenths(t, 99999.0f); }), "+99999.0");
    for (const float none : {NAN, INFINITY, -INFINITY, 1e30f})
        EXPECT_EQ(text_of([none](cb_text *t) { cb_text_put_tenths(t, none); }), "?");
}

TEST(text, what_does_not_fit_is_cut_off) {
    cb_text text{};
    for (int i = 0; i < 200; ++i) cb_text_put(&text, "12345");
    EXPECT_EQ(text.length, sizeof text.bytes);
    cb_text_put_unsigned(&text, 7);
    EXPECT_EQ(text.length, sizeof text.bytes);
    cb_text_clear(&text);
    cb_text_put(&text, "a");
    EXPECT_EQ(words(text), "a");
}

}  // namespace
