// SPDX-License-Identifier: MIT
// The client against a server of raw sockets that misbehaves on purpose. Frames are written by
// hand.
#include <gtest/gtest.h>
#include <poll.h>

#include "tests/support/raw_server.h"

extern "C" {
#include "hal/linux/clock.h"
#include "hal/linux/tcp.h"
}

namespace tcp_client {
namespace {

using raw_server::behave;
using raw_server::bytes;
using raw_server::peer;
using raw_server::server;
using raw_server::sleep_ms;
using raw_server::two_registers;
using raw_server::two_written;

// A client and its registers, read with a deadline some ms away.
struct client {
    cb_tcp tcp;
    uint16_t registers[125] = {0xEEEE, 0xEEEE, 0xEEEE};
    int64_t overdue_us = 0;  // how late the latest return after its deadline was

    explicit client(uint16_t port) {
        EXPECT_TRUE(cb_tcp_start(&tcp, "127.0.0.1", port, 1));
        for (int i = 0; i < 200 && !cb_link_ready(&tcp.link, cb_boottime_us()); i++) sleep_ms(1);
    }
    ~client() { cb_link_close(&tcp.link); }
    cb_transfer read(int ms = 20) {
        const int64_t deadline = cb_boottime_us() + ms * 1000;
        const cb_modbus_request request = cb_modbus_read(8, 2);
        const cb_transfer result = cb_tcp_exchange(&tcp, &request, registers, deadline);
        overdue_us = std::max(overdue_us, cb_boottime_us() - deadline);
        return result;
    }
    // out: the first register of a reading that had time; -1: it failed
    int value() { return read(1000) == CB_TRANSFER_OK ? registers[0] : -1; }
    cb_transfer write(int ms = 20) {
        const uint16_t values[2] = {1, 2};
        const cb_modbus_request request = cb_modbus_write(100, 2, values);
        return cb_tcp_exchange(&tcp, &request, nullptr, cb_boottime_us() + ms * 1000);
    }
};

// In the time of a still clock (tests/support/still_clock.h), in which computing takes none.
struct tcp : ::testing::Test {
    still_clock::clock clock;
};

constexpr int64_t tolerated_us = 100;  // looks at the clock

TEST_F(tcp, a_read_on_the_wire_is_what_the_specification_says) {
    bytes seen;
    server plc([&](peer &p) {
        seen = p.request();
        p.reply({0x00, 0x01, 0x00, 0x00, 0x00, 0x07, 0x01, 0x03, 0x04, 0x12, 0x34, 0xAB, 0xCD});
        p.gone();
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    EXPECT_EQ(seen,
              (bytes{0x00, 0x01, 0x00, 0x00, 0x00, 0x06, 0x01, 0x03, 0x00, 0x08, 0x00, 0x02}));
    EXPECT_EQ(c.registers[0], 0x1234);
    EXPECT_EQ(c.registers[1], 0xABCD);
    EXPECT_EQ(c.registers[2], 0xEEEE);
}

TEST_F(tcp, a_write_on_the_wire_is_what_the_specification_says) {
    bytes seen;
    server plc([&](peer &p) {
        seen = p.request();
        p.reply({0x00, 0x01, 0x00, 0x00, 0x00, 0x06, 0x01, 0x10, 0x00, 0x64, 0x00, 0x03});
        p.gone();
    });
    client c(plc.port());
    const uint16_t values[3] = {0x0102, 0xFFFE, 0x8000};
    const cb_modbus_request request = cb_modbus_write(100, 3, values);
    EXPECT_EQ(cb_tcp_exchange(&c.tcp, &request, nullptr, cb_boottime_us() + 1000000),
              CB_TRANSFER_OK);
    EXPECT_EQ(seen, (bytes{0x00, 0x01, 0x00, 0x00, 0x00, 0x0D, 0x01, 0x10, 0x00, 0x64, 0x00, 0x03,
                           0x06, 0x01, 0x02, 0xFF, 0xFE, 0x80, 0x00}));
}

TEST_F(tcp, a_write_and_read_on_the_wire_is_what_the_specification_says) {
    bytes seen;
    server plc([&](peer &p) {
        seen = p.request();
        p.reply({0x00, 0x01, 0x00, 0x00, 0x00, 0x05, 0x01, 0x17, 0x02, 0x55, 0xAA});
        p.gone();
    });
    client c(plc.port());
    const uint16_t values[2] = {0x0102, 0xFFFE};
    const cb_modbus_request request = cb_modbus_write_read(100, 2, values, 7, 1);
    EXPECT_EQ(cb_tcp_exchange(&c.tcp, &request, c.registers, cb_boottime_us() + 1000000),
              CB_TRANSFER_OK);
    EXPECT_EQ(seen, (bytes{0x00, 0x01, 0x00, 0x00, 0x00, 0x0F, 0x01, 0x17, 0x00, 0x07, 0x00,
                           0x01, 0x00, 0x64, 0x00, 0x02, 0x04, 0x01, 0x02, 0xFF, 0xFE}));
    EXPECT_EQ(c.registers[0], 0x55AA);
    EXPECT_EQ(c.registers[1], 0xEEEE);
}

TEST_F(tcp, a_late_reply_costs_one_exchange_and_is_never_taken_for_the_next) {
    server plc([](peer &p) {
        const bytes first = p.request();
        sleep_ms(90);
        p.reply(two_registers(first, 77));
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_EQ(c.tcp.counters.timeouts, 1u);
    EXPECT_EQ(c.tcp.counters.late_replies, 1u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
    EXPECT_LT(c.overdue_us, tolerated_us);
}

TEST_F(tcp, a_late_reply_that_waits_in_the_socket_is_dropped_before_the_next_request) {
    server plc([](peer &p) {
        const bytes first = p.request();
        sleep_ms(60);
        p.reply(two_registers(first, 77));
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(5), CB_TRANSFER_UNKNOWN);
    sleep_ms(120);
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_EQ(c.tcp.counters.late_replies, 1u);
}

TEST_F(tcp, nothing_is_sent_when_the_computer_slept_while_it_waited_for_a_late_reply) {
    server plc([](peer &p) {
        const bytes first = p.request();
        sleep_ms(60);
        p.reply(two_registers(first, 77));
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(5), CB_TRANSFER_UNKNOWN);
    still_clock::suspend_ms(3000);
    EXPECT_EQ(c.write(500), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.tcp.counters.late_replies, 1u);
    EXPECT_EQ(c.tcp.counters.out_of_time, 1u);
    EXPECT_EQ(c.tcp.counters.requests, 1u);
    EXPECT_EQ(c.value(), 2);
}

TEST_F(tcp, never_has_two_requests_out_and_connects_anew_after_three_failures) {
    std::atomic<int> on_first{0};
    server plc([&](peer &p) {
        if (p.number > 0) return behave(p);
        while (!p.request().empty()) on_first++;
    });
    client c(plc.port());
    EXPECT_EQ(c.read(10), CB_TRANSFER_UNKNOWN);  // sent, not answered
    EXPECT_EQ(c.read(10), CB_TRANSFER_FAILED);   // not sent
    EXPECT_EQ(c.read(10), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.tcp.counters.given_up, 1u);
    sleep_ms(100);
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(on_first, 1);
    EXPECT_EQ(c.tcp.counters.timeouts, 1u);
    EXPECT_EQ(c.tcp.counters.blocked, 2u);
    EXPECT_EQ(plc.connections(), 2);
    EXPECT_LT(c.overdue_us, tolerated_us);
}

TEST_F(tcp, a_reply_that_dribbles_in_time_is_taken) {
    server plc([](peer &p) {
        for (uint8_t byte : two_registers(p.request(), 5)) p.reply({byte}), sleep_ms(1);
        p.gone();
    });
    client c(plc.port());
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[1], 6);
}

TEST_F(tcp, a_reply_that_dribbles_past_the_deadline_costs_one_exchange) {
    server plc([](peer &p) {
        for (uint8_t byte : two_registers(p.request(), 77)) p.reply({byte}), sleep_ms(4);
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(20), CB_TRANSFER_UNKNOWN);  // 13 bytes take 52 ms
    EXPECT_GT(c.tcp.have, 0u);                   // what came is kept
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_EQ(c.tcp.counters.late_replies, 1u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
    EXPECT_LT(c.overdue_us, tolerated_us);
}

TEST_F(tcp, a_wrong_id_costs_one_exchange_and_the_connection_stays) {
    server plc([](peer &p) {
        bytes reply = two_registers(p.request(), 77);
        reply[0] = 0x80;
        p.reply(reply);
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(c.value(), 2);
    EXPECT_EQ(c.tcp.counters.wrong_ids, 1u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
}

TEST_F(tcp, a_reply_of_another_unit_costs_one_exchange_and_the_connection_stays) {
    server plc([](peer &p) {
        bytes reply = two_registers(p.request(), 77);
        reply[6] ^= 5;
        p.reply(reply);
        reply = two_written(p.request());
        reply[6] = 0;
        p.reply(reply);
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(c.write(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.value(), 3);
    EXPECT_EQ(c.tcp.counters.invalid_replies, 2u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
}

TEST_F(tcp, a_wrong_id_before_the_right_reply_leaves_a_stray_that_is_dropped) {
    server plc([](peer &p) {
        const bytes right = two_registers(p.request(), 77);
        bytes wrong = right;
        wrong[0] = 0x80;
        p.reply(wrong);
        sleep_ms(5);
        p.reply(right);
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.value(), 2);
    EXPECT_EQ(c.tcp.counters.stray_replies, 1u);
}

TEST_F(tcp, a_server_that_answers_everything_twice_is_understood) {
    server plc([](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            const bytes reply = two_registers(r, static_cast<uint8_t>(p.requests));
            p.reply(reply);
            p.reply(reply);
        }
    });
    client c(plc.port());
    for (uint16_t i = 1; i <= 20; i++) {
        ASSERT_EQ(c.value(), i);
    }
    EXPECT_GE(c.tcp.counters.stray_replies, 18u);
}

// Between two requests it can be no reply to the pending one.
TEST_F(tcp, a_frame_that_was_never_asked_for_costs_nothing_between_two_requests) {
    server plc([](peer &p) {
        const bytes right = two_registers(p.request(), 77);
        bytes wrong = right;
        wrong[0] = 0x80;
        p.reply(right);
        p.reply(wrong);
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.value(), 77);
    sleep_ms(5);
    EXPECT_EQ(c.value(), 2);
    EXPECT_EQ(c.tcp.counters.wrong_ids, 1u);
    EXPECT_EQ(plc.connections(), 1);
}

TEST_F(tcp, a_flood_of_replies_nobody_asked_for_delays_nothing_past_the_deadline) {
    server plc([](peer &p) {
        bytes reply = two_registers(p.request(), 9);
        reply[1]--;  // the request before: late, for all that can be known
        bytes many;
        for (int i = 0; i < 50; i++) many.insert(many.end(), reply.begin(), reply.end());
        while (send(p.fd, many.data(), many.size(), MSG_NOSIGNAL) > 0) continue;
    });
    client c(plc.port());
    for (int i = 0; i < 20; i++) EXPECT_NE(c.read(10), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_LT(c.overdue_us, tolerated_us);
}

TEST_F(tcp, exceptions_are_reported_and_counted_by_code) {
    server plc([](peer &p) {
        for (const uint8_t code : bytes{1, 2, 4, 0xE0}) {
            const bytes r = p.request();
            p.reply({r[0], r[1], 0, 0, 0, 3, 1, 0x83, code});
        }
        behave(p);
    });
    client c(plc.port());
    for (int i = 0; i < 4; i++) EXPECT_EQ(c.read(1000), CB_TRANSFER_REFUSED);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    EXPECT_EQ(c.tcp.counters.exceptions, 4u);
    for (int code : {0, 1, 2, 4}) EXPECT_EQ(c.tcp.counters.exceptions_by_code[code], 1u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
}

TEST_F(tcp, what_answers_something_else_is_named) {
    int number = 0;
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            bytes reply = two_registers(r, 1);
            number++;
            if (number == 1) reply[6] = 255;
            if (number == 2) reply[7] = 4;
            if (number == 3) reply = {r[0], r[1], 0, 0, 0, 5, r[6], 3, 2, 0, 1};
            if (number == 5) reply = {r[0], r[1], 0, 0, 0, 6, r[6], 16, 0, 101, 0, 2};
            if (number == 6) reply = {r[0], r[1], 0, 0, 0, 6, r[6], 16, 0, 100, 0, 1};
            p.reply(reply);
        }
    });
    client c(plc.port());
    const auto odd = [&](cb_odd kind, uint32_t count, unsigned got, unsigned expected) {
        const cb_odd_reply &reply = c.tcp.peer.odd[kind];
        return reply.count == count && reply.got == got && reply.expected == expected;
    };
    c.read(1000);
    EXPECT_TRUE(odd(CB_ODD_UNIT, 1, 255, 1));
    c.read(1000);
    EXPECT_TRUE(odd(CB_ODD_FUNCTION, 1, 4, 3));
    c.tcp.failures_in_row = 0;
    c.read(1000);
    EXPECT_TRUE(odd(CB_ODD_LENGTH, 1, 4, 6));
    EXPECT_TRUE(odd(CB_ODD_UNIT, 1, 255, 1)) << "each is of one kind";
    c.tcp.failures_in_row = 0;
    EXPECT_EQ(c.write(1000), CB_TRANSFER_UNKNOWN);  // number 4: a reading
    EXPECT_TRUE(odd(CB_ODD_FUNCTION, 2, 3, 16));
    EXPECT_EQ(c.write(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_TRUE(odd(CB_ODD_ECHO, 1, 101, 100));
    c.tcp.failures_in_row = 0;
    EXPECT_EQ(c.write(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_TRUE(odd(CB_ODD_LENGTH, 2, 2, 4));
}

TEST_F(tcp, a_function_that_is_refused_as_illegal_is_remembered_until_it_is_answered) {
    int number = 0;
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            const uint8_t codes[] = {1, 6};
            if (number < 2) p.reply({r[0], r[1], 0, 0, 0, 3, r[6], 0x83, codes[number]});
            if (number >= 2) p.reply(two_registers(r, 1));
            number++;
        }
    });
    client c(plc.port());
    for (const uint32_t refused : {1u << 3, 1u << 3, 0u}) {
        c.read(1000);
        EXPECT_EQ(c.tcp.peer.refused_functions, refused);
    }
}

TEST_F(tcp, a_late_reply_is_timed) {
    server plc([](peer &p) {
        bytes r = p.request();
        sleep_ms(60);
        p.reply(two_registers(r, 1));
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(5), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(cb_peer_slowest_us(&c.tcp.peer), 0u);
    EXPECT_EQ(c.read(5000), CB_TRANSFER_OK);
    EXPECT_GE(cb_peer_slowest_us(&c.tcp.peer), 60000u);
}

// Left behind a write, the connection carries all that was sent and its end; the replies that come
// meanwhile do not reset it, which could throw away what the PLC has not read.
TEST_F(tcp, a_connection_that_is_left_is_closed_in_order) {
    std::atomic<int> requests{0}, reset{0}, ended{0};
    server plc([&](peer &p) {
        if (p.number > 0) return behave(p);
        const bytes read = p.request();
        sleep_ms(100);  // the client left meanwhile
        p.reply(two_registers(read, 1));
        sleep_ms(20);  // time for what would answer an unwanted reply
        const bytes write = p.request();
        requests = static_cast<int>(!write.empty() && write[7] == 16) + 1;
        p.reply(two_written(write));
        sleep_ms(20);
        const ssize_t got = p.byte();
        reset = got < 0;
        ended = got == 0;
    });
    client c(plc.port());
    EXPECT_EQ(c.read(5), CB_TRANSFER_UNKNOWN);
    c.tcp.awaiting = false;  // the write goes out behind the reading
    EXPECT_EQ(c.write(5), CB_TRANSFER_UNKNOWN);
    cb_tcp_leave(&c.tcp);
    EXPECT_EQ(c.read(5), CB_TRANSFER_FAILED) << "nothing follows";
    for (int i = 0; i < 500 && !ended && !reset; i++) {
        EXPECT_NE(c.tcp.link.state, CB_LINK_UP);
        cb_link_ready(&c.tcp.link, cb_boottime_us());
        sleep_ms(2);
    }
    EXPECT_EQ(requests, 2);
    EXPECT_EQ(reset, 0);
    EXPECT_EQ(ended, 1);
    cb_transfer result = CB_TRANSFER_FAILED;
    for (int i = 0; i < 500 && result != CB_TRANSFER_OK; i++, sleep_ms(2)) result = c.read(500);
    EXPECT_EQ(result, CB_TRANSFER_OK) << "another connection";
    EXPECT_EQ(plc.connections(), 2);
}

TEST_F(tcp, a_plc_that_does_not_close_a_connection_that_was_left_is_waited_for_no_longer) {
    server plc([](peer &p) {
        if (p.number > 0) return behave(p);
        p.request();
        sleep_ms(1500);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(5), CB_TRANSFER_UNKNOWN);
    const int64_t left_us = cb_boottime_us();
    cb_tcp_leave(&c.tcp);
    while (c.tcp.link.state == CB_LINK_LEAVING) {
        cb_link_ready(&c.tcp.link, cb_boottime_us());
        sleep_ms(2);
    }
    EXPECT_GE(cb_boottime_us() - left_us, 1000000);
    EXPECT_EQ(c.tcp.link.cause, CB_LINK_CAUSE_LEFT);
    EXPECT_EQ(c.tcp.link.disconnects, 1u);
}

TEST_F(tcp, a_reply_of_the_wrong_length_costs_one_exchange) {
    server plc([](peer &p) {
        bytes r = p.request();
        p.reply({r[0], r[1], 0, 0, 0, 5, 1, 3, 2, 0, 77});  // one register instead of two
        r = p.request();
        p.reply({r[0], r[1], 0, 0, 0, 7, 1, 3, 200, 0, 77, 0, 78});  // states 100 registers
        behave(p);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    EXPECT_EQ(c.tcp.counters.invalid_replies, 2u);
    EXPECT_EQ(c.tcp.link.connects, 1u);
}

TEST_F(tcp, a_reply_that_stops_short_costs_one_exchange_and_its_connection) {
    server plc([](peer &p) {
        if (p.number > 0) return behave(p);
        bytes reply = two_registers(p.request(), 77);
        reply.resize(9);
        p.reply(reply);
        p.gone();
    });
    client c(plc.port());
    EXPECT_EQ(c.read(100), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.tcp.counters.incomplete_replies, 1u);
    sleep_ms(100);
    EXPECT_EQ(c.read(500), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
}

// With a short period, silence within a frame takes several exchanges to show.
TEST_F(tcp, a_reply_that_stops_short_is_given_up_after_ten_milliseconds) {
    server plc([](peer &p) {
        if (p.number > 0) return behave(p);
        bytes reply = two_registers(p.request(), 77);
        reply.resize(9);
        p.reply(reply);
        p.gone();
    });
    client c(plc.port());
    EXPECT_EQ(c.read(6), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.read(6), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.tcp.counters.incomplete_replies, 1u);
    EXPECT_EQ(c.tcp.link.disconnects, 1u);
}

TEST_F(tcp, a_connection_closed_in_mid_reply_costs_one_exchange) {
    server plc([](peer &p) {
        if (p.number > 0) return behave(p);
        bytes reply = two_registers(p.request(), 77);
        reply.resize(9);
        p.reply(reply);
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
    sleep_ms(50);
    EXPECT_EQ(c.value(), 2);
    EXPECT_EQ(c.tcp.counters.closed_by_peer, 1u);
}

TEST_F(tcp, a_connection_closed_between_two_exchanges_is_seen_before_the_request_is_sent) {
    server plc([](peer &p) {
        if (p.number > 0) return behave(p);
        p.reply(two_registers(p.request(), 1));
    });
    client c(plc.port());
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    sleep_ms(50);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_FAILED);  // certainly not sent
    sleep_ms(50);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
}

TEST_F(tcp, what_is_no_header_closes_the_connection) {
    for (const bytes &garbage : {bytes{'H', 'T', 'T', 'P', '/', '1', '.', '1', ' '},
                                 bytes{0, 1, 0, 0, 0, 1, 1, 3, 4},           // too short to be
                                 bytes{0, 1, 0, 0, 0, 255, 1, 3, 4},         // too long
                                 bytes{0, 1, 0, 1, 0, 7, 1, 3, 4, 0, 0}}) {  // another protocol
        server plc([&](peer &p) {
            if (p.number > 0) return behave(p);
            p.request();
            p.reply(garbage);
            p.gone();
        });
        client c(plc.port());
        EXPECT_EQ(c.read(1000), CB_TRANSFER_UNKNOWN);
        EXPECT_EQ(c.tcp.counters.framing_errors, 1u);
        sleep_ms(50);
        EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    }
}

TEST_F(tcp, a_plc_that_is_absent_costs_no_time_and_is_found_when_it_comes) {
    uint16_t port;
    {
        server reserved([](peer &) {});
        port = reserved.port();
    }
    client c(port);
    const int64_t start = cb_boottime_us();
    for (int i = 0; i < 20; i++) EXPECT_EQ(c.read(1000), CB_TRANSFER_FAILED);
    EXPECT_LT(cb_boottime_us() - start, 100000);
    EXPECT_EQ(c.tcp.counters.not_connected, 20u);
    EXPECT_GT(c.tcp.link.failures, 0u);
    server plc(behave, port);
    cb_transfer result = CB_TRANSFER_FAILED;
    for (int i = 0; i < 300 && result != CB_TRANSFER_OK; i++) sleep_ms(5), result = c.read(100);
    EXPECT_EQ(result, CB_TRANSFER_OK);
}

TEST_F(tcp, attempts_to_connect_become_rarer_up_to_one_a_second) {
    cb_link link;
    uint16_t port;
    {
        server reserved([](peer &) {});
        port = reserved.port();
    }
    ASSERT_TRUE(cb_link_start(&link, "127.0.0.1", port));
    int64_t now = 1000000;
    for (int i = 0; i < 10000; i++, now += 1000) cb_link_ready(&link, now);  // ten seconds
    EXPECT_GE(link.failures, 10u);
    EXPECT_LE(link.failures, 16u);
}

// Each connection answers one reading, and the first two a write as well.
TEST_F(tcp, a_loss_is_answered_at_once_where_readings_and_writes_were) {
    server plc([](peer &p) {
        p.reply(two_registers(p.request(), 1));
        const bytes write = p.request();
        if (p.number < 2) p.reply(two_written(write));
    });
    client c(plc.port());
    for (int connection = 0; connection < 4; connection++) {
        SCOPED_TRACE(connection);
        const bool proven = connection < 2;
        for (int i = 0; i < 500 && !cb_link_ready(&c.tcp.link, cb_boottime_us()); i++) sleep_ms(1);
        ASSERT_EQ(c.read(1000), CB_TRANSFER_OK);
        EXPECT_EQ(c.write(1000), proven ? CB_TRANSFER_OK : CB_TRANSFER_UNKNOWN);
        while (c.tcp.link.disconnects == static_cast<uint32_t>(connection)) c.read(10);
        EXPECT_EQ(c.tcp.link.state != CB_LINK_DOWN, proven);
        EXPECT_EQ(c.tcp.link.backoff_us, proven ? 50000u : connection == 2 ? 100000u : 200000u);
    }
}

TEST_F(tcp, a_server_that_answers_no_write_is_connected_to_less_and_less) {
    server plc([](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request())
            if (r[7] == 3) p.reply(two_registers(r, 1));
    });
    client c(plc.port());
    const int64_t until_us = cb_boottime_us() + 1500000;
    while (cb_boottime_us() < until_us) {
        c.read(5);
        c.write(5);
        sleep_ms(1);
    }
    EXPECT_GE(plc.connections(), 3);
    EXPECT_LE(plc.connections(), 8);  // pauses of 0, 50, 100, 200, 400, 800 ms
    EXPECT_GT(c.tcp.counters.given_up, 1u);
}

TEST_F(tcp, without_time_nothing_is_sent) {
    server plc(behave);
    client c(plc.port());
    EXPECT_EQ(c.read(0), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.read(-5), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.tcp.counters.out_of_time, 2u);
    EXPECT_EQ(c.read(1000), CB_TRANSFER_OK);
    EXPECT_EQ(plc.requests(), 1);
}

TEST_F(tcp, a_name_is_refused_because_a_resolver_would_block) {
    cb_tcp client;
    EXPECT_FALSE(cb_tcp_start(&client, "localhost", 502, 1));
    EXPECT_FALSE(cb_tcp_start(&client, "plc.example", 502, 1));
    EXPECT_FALSE(cb_tcp_start(&client, "", 502, 1));
}

TEST_F(tcp, an_address_may_be_ipv6) {
    cb_link link;
    ASSERT_TRUE(cb_link_start(&link, "::1", 502));
    EXPECT_EQ(link.address.ss_family, AF_INET6);
    ASSERT_TRUE(cb_link_start(&link, "192.168.0.1", 502));
    EXPECT_EQ(link.address.ss_family, AF_INET);
}

TEST_F(tcp, ids_wrap_without_a_gap) {
    server plc(behave);
    client c(plc.port());
    c.tcp.transaction = 0xFFFD;
    for (int i = 1; i <= 10; i++) ASSERT_EQ(c.read(1000), CB_TRANSFER_OK);
}

}  // namespace
}  // namespace tcp_client
