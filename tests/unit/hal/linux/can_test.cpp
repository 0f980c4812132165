// SPDX-License-Identifier: MIT
// The loop's side of SocketCAN, over a pair of local sockets: a machine that runs unit tests need
// not have CAN. What only the kernel does (filters, bus-off, interface down, overflow) is tested
// with real controllers by scripts/test --system.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

extern "C" {
#include "hal/linux/can_source.h"
#include "hal/linux/clock.h"
}
#include "tests/support/config_fixture.h"

namespace {

using compbox_test::full_example;
using compbox_test::load;
using compbox_test::with;

struct linux_can : ::testing::Test {
    linux_can() {
        int pair[2];
        EXPECT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
        bus = pair[0];
        box = pair[1];
        cb_can_start(&can, true);
    }
    ~linux_can() override {
        cb_can_close(&can);
        if (bus >= 0) close(bus);
    }
    void send(uint32_t id, std::initializer_list<int> bytes) {
        can_frame raw = {};
        raw.can_id = id;
        raw.can_dlc = static_cast<uint8_t>(bytes.size());
        size_t i = 0;
        for (int byte : bytes) raw.data[i++] = static_cast<uint8_t>(byte);
        ASSERT_EQ(write(bus, &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    }
    void controller_says(uint32_t what, int detail = 0) {
        send(CAN_ERR_FLAG | what, {0, detail, 0, 0, 0, 0, 0, 0});
    }
    // As the loop does with an offered socket: behind a cycle in which the old one was empty.
    void take_offer() {
        EXPECT_FALSE(cb_can_receive(&can, &frame, cb_boottime_us()));
        EXPECT_FALSE(cb_can_receive(&can, &frame, cb_boottime_us()));
    }
    cb_can can;
    int bus, box;
    cb_can_frame frame = {};
};

TEST_F(linux_can, asks_for_a_socket_and_takes_the_one_offered) {
    EXPECT_TRUE(cb_can_wanted(&can));
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_wanted(&can)) << "one is on its way";
    send(0x181, {1, 2, 3});
    ASSERT_TRUE(cb_can_receive(&can, &frame, 5000));
    EXPECT_FALSE(cb_can_wanted(&can));
    EXPECT_EQ(frame.id, 0x181u);
    EXPECT_EQ(frame.length, 3);
    EXPECT_EQ(frame.data[2], 3);
    EXPECT_EQ(frame.time_us, 5000);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 5000));
    EXPECT_EQ(can.counters.frames, 1u);
    EXPECT_EQ(can.state, CB_CAN_UP);
    EXPECT_TRUE(cb_can_came_back(&can));
    EXPECT_FALSE(cb_can_came_back(&can));
}

TEST_F(linux_can, counts_what_the_controller_says_and_goes_on) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    cb_can_came_back(&can);
    controller_says(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING);
    controller_says(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
    controller_says(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW);
    controller_says(CAN_ERR_ACK);
    controller_says(CAN_ERR_BUSOFF);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.counters.error_frames, 5u);
    EXPECT_EQ(can.counters.warnings, 1u);
    EXPECT_EQ(can.counters.passives, 1u);
    EXPECT_EQ(can.counters.controller_overflows, 1u);
    EXPECT_EQ(can.counters.bus_offs, 1u);
    EXPECT_EQ(can.state, CB_CAN_BUS_OFF);
    EXPECT_FALSE(cb_can_came_back(&can));
    controller_says(CAN_ERR_RESTARTED);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.counters.restarts, 1u);
    EXPECT_EQ(can.state, CB_CAN_UP);
    EXPECT_TRUE(cb_can_came_back(&can));
    EXPECT_EQ(can.counters.frames, 0u);
}

// Some controllers restart by themselves and never say "restarted".
TEST_F(linux_can, a_controller_that_is_active_again_has_come_back) {
    cb_can_offer(&can, box);
    controller_says(CAN_ERR_BUSOFF);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    cb_can_came_back(&can);
    controller_says(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_UP);
    EXPECT_TRUE(cb_can_came_back(&can));
    EXPECT_EQ(can.counters.restarts, 0u);
}

// What was sent before it is lost.
TEST_F(linux_can, a_controller_that_was_off_the_bus_before_the_socket_has_come_back) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_TRUE(cb_can_came_back(&can));
    controller_says(CAN_ERR_RESTARTED);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_UP);
    EXPECT_TRUE(cb_can_came_back(&can));
    controller_says(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_TRUE(cb_can_came_back(&can));
}

// The kernel's stamp, by the wall clock, becomes the age of a frame that waited.
TEST_F(linux_can, a_frame_is_as_old_as_the_kernel_says) {
    const int on = 1;
    ASSERT_EQ(setsockopt(box, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    cb_can_offer(&can, box);
    const int64_t empty_us = cb_boottime_us();
    EXPECT_FALSE(cb_can_receive(&can, &frame, empty_us));
    usleep(20000);
    const int64_t before_us = cb_boottime_us();
    send(0x181, {1});
    const int64_t after_us = cb_boottime_us();
    usleep(50000);
    const int64_t from_us = cb_boottime_us();
    ASSERT_TRUE(cb_can_receive(&can, &frame, from_us));
    const int64_t between_us = cb_boottime_us() - from_us;  // from now_us to the wall clock
    EXPECT_GE(frame.time_us, before_us - between_us - 1000);
    EXPECT_LE(frame.time_us, after_us + 1000);
    // As if the wall clock had been set: far forward, then back. now_us moves in its place.
    send(0x181, {2});
    const int64_t newest_us = can.not_before_us;
    ASSERT_TRUE(cb_can_receive(&can, &frame, newest_us - 3600000000));
    EXPECT_EQ(frame.time_us, newest_us) << "not older than the frame before it";
    EXPECT_FALSE(cb_can_receive(&can, &frame, newest_us + 1000));
    send(0x181, {3});
    ASSERT_TRUE(cb_can_receive(&can, &frame, newest_us - 3600000000));
    EXPECT_EQ(frame.time_us, newest_us + 1000) << "not older than the empty queue";
    usleep(1000);
    send(0x181, {4});
    can.not_before_us = 0;
    ASSERT_TRUE(cb_can_receive(&can, &frame, 3600000000));
    EXPECT_LE(frame.time_us, 3600000000) << "not younger than now";
}

TEST_F(linux_can, a_frame_that_waited_in_a_socket_since_its_offer_is_as_old) {
    const int on = 1;
    ASSERT_EQ(setsockopt(box, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    cb_can_offer(&can, box);
    send(0x181, {1});
    const int64_t after_us = cb_boottime_us();
    usleep(20000);
    ASSERT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us()));
    EXPECT_LE(frame.time_us, after_us + 1000);
    EXPECT_GE(frame.time_us, can.offered_us);
}

TEST_F(linux_can, an_interface_that_is_up_again_is_noticed_without_a_frame) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    cb_can_came_back(&can);
    can.state = CB_CAN_DOWN;  // as a socket error has it, which a local socket never gives
    can.downs = 1;
    cb_can_look(&can, "no_such_can");
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_DOWN);
    cb_can_look(&can, "lo");
    can.downs = 2;  // it went down once more since somebody looked
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_DOWN);
    cb_can_look(&can, "lo");
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_UP);
    EXPECT_TRUE(cb_can_came_back(&can));
}

// Frames of before, from the queue.
TEST_F(linux_can, an_interface_that_is_down_stays_so_behind_frames_that_waited) {
    const int64_t now_us = cb_boottime_us();
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, now_us));
    can.state = CB_CAN_DOWN;  // as a socket error has it, which a local socket never gives
    can.downs = 1;
    can.down_us = now_us;
    send(0x181, {1});
    controller_says(CAN_ERR_BUSOFF);
    EXPECT_TRUE(cb_can_receive(&can, &frame, now_us));
    EXPECT_FALSE(cb_can_receive(&can, &frame, now_us));
    EXPECT_EQ(can.state, CB_CAN_DOWN);
    EXPECT_EQ(can.counters.bus_offs, 1u);
    send(0x181, {1});
    EXPECT_TRUE(cb_can_receive(&can, &frame, now_us + 1));
    EXPECT_EQ(can.state, CB_CAN_UP);
}

TEST_F(linux_can, a_revoked_socket_is_given_back_and_another_asked_for) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    can.returned = 1000;  // the other thread has not closed the one before yet
    cb_can_revoke(&can);
    send(0x181, {1});
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0)) << "of the wrong interface";
    EXPECT_EQ(can.fd, box);
    can.returned = -1;
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.returned, box);
    EXPECT_EQ(can.fd, -1);
    EXPECT_TRUE(cb_can_wanted(&can));
}

TEST_F(linux_can, a_flood_is_taken_in_portions) {
    cb_can_offer(&can, box);
    int sent = 0;
    for (can_frame f = {}; write(bus, &f, sizeof f) > 0;) ++sent;
    EXPECT_GT(sent, 0);
    int taken = 0;
    while (cb_can_receive(&can, &frame, 0)) ++taken;
    EXPECT_EQ(taken, sent);
}

TEST_F(linux_can, sends_and_counts_what_cannot_be_sent) {
    const cb_can_frame start = {0, 2, {1, 5}, 0};
    EXPECT_FALSE(cb_can_send(&can, &start)) << "there is no socket yet";
    cb_can_offer(&can, box);
    cb_can_receive(&can, &frame, 0);
    EXPECT_TRUE(cb_can_send(&can, &start));
    can_frame heard = {};
    ASSERT_EQ(read(bus, &heard, sizeof heard), static_cast<ssize_t>(sizeof heard));
    EXPECT_EQ(heard.can_id, 0u);
    EXPECT_EQ(heard.can_dlc, 2);
    EXPECT_EQ(heard.data[1], 5);
    while (cb_can_send(&can, &start)) continue;  // until the queue is full
    EXPECT_EQ(can.counters.not_sent, 2u);
}

TEST_F(linux_can, a_socket_that_fails_is_given_back_and_another_asked_for) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    // A connected local socket whose other end is gone answers a send with an error, then nothing
    // more; an integer that is no socket answers everything with one.
    const int kept = dup(can.fd);
    close(can.fd);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.counters.socket_errors, 1u);
    EXPECT_EQ(can.state, CB_CAN_CLOSED);
    EXPECT_TRUE(cb_can_wanted(&can));
    __atomic_store_n(&can.returned, -1, __ATOMIC_RELEASE);  // it is closed already
    cb_can_offer(&can, kept);
    send(0x181, {1});
    EXPECT_TRUE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_UP);
}

// Its error comes once. The socket is given back as soon as the one before it is closed.
TEST_F(linux_can, a_socket_that_fails_while_another_waits_to_be_closed_is_given_back_later) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    can.returned = 1000;
    const int kept = dup(can.fd);
    close(can.fd);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.counters.socket_errors, 1u);
    EXPECT_EQ(dup2(kept, can.fd), can.fd);
    close(kept);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.fd, box);
    can.returned = -1;
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.returned, box);
    EXPECT_TRUE(cb_can_wanted(&can));
}

// The kernel hands out whole frames alone.
TEST_F(linux_can, a_part_of_a_frame_is_none) {
    cb_can_offer(&can, box);
    ASSERT_EQ(write(bus, "part", 4), 4);
    errno = EIO;  // of a call before it
    EXPECT_FALSE(cb_can_receive(&can, &frame, 7));
    EXPECT_EQ(can.counters.socket_errors, 0u);
    EXPECT_EQ(can.counters.frames, 0u);
    send(0x181, {1});
    EXPECT_TRUE(cb_can_receive(&can, &frame, 8));
}

// Other filters after a reload do not bring a controller back to the bus.
TEST_F(linux_can, a_new_socket_of_a_bus_that_is_off_does_not_say_that_it_is_up) {
    cb_can_offer(&can, box);
    controller_says(CAN_ERR_BUSOFF);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    cb_can_came_back(&can);
    int pair[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
    cb_can_offer(&can, pair[1]);
    take_offer();
    EXPECT_EQ(can.fd, pair[1]);
    EXPECT_EQ(can.state, CB_CAN_BUS_OFF);
    EXPECT_FALSE(cb_can_came_back(&can));
    can_frame raw = {};
    ASSERT_EQ(write(pair[0], &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    EXPECT_TRUE(cb_can_receive(&can, &frame, 0));
    EXPECT_EQ(can.state, CB_CAN_UP);
    close(pair[0]);
}

TEST_F(linux_can, a_new_socket_replaces_the_old_one_which_is_closed) {
    cb_can_offer(&can, box);
    cb_can_receive(&can, &frame, 0);
    int pair[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
    cb_can_offer(&can, pair[1]);
    take_offer();
    EXPECT_EQ(can.fd, pair[1]);
    EXPECT_EQ(can.returned, box);
    cb_can_tidy(&can);
    EXPECT_EQ(can.returned, -1);
    char byte = 0;
    EXPECT_LT(write(bus, &byte, 1), 0) << "nobody is there any more";
    close(pair[0]);
}

TEST_F(linux_can, a_third_socket_waits_until_the_first_one_is_closed) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    const int second = dup(box), third = dup(box);
    cb_can_offer(&can, second);
    take_offer();
    cb_can_offer(&can, third);
    take_offer();
    EXPECT_EQ(can.fd, second);
    EXPECT_EQ(can.offered, third);
    cb_can_tidy(&can);
    take_offer();
    EXPECT_EQ(can.fd, third);
}

// A boot-up message among them starts a node.
TEST_F(linux_can, a_new_socket_follows_the_last_frame_of_before_it) {
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, 0));
    const int64_t before_us = cb_boottime_us();
    send(0x705, {0});
    send(0x181, {1});
    int pair[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
    cb_can_offer(&can, pair[1]);
    for (const uint32_t id : {0x705u, 0x181u}) {
        ASSERT_TRUE(cb_can_receive(&can, &frame, before_us));
        EXPECT_EQ(frame.id, id);
    }
    send(0x182, {2});  // the new one has it, too
    ASSERT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us()));
    EXPECT_EQ(can.fd, box);
    can_frame raw = {};
    raw.can_id = 0x182;
    ASSERT_EQ(write(pair[0], &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    EXPECT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us()));
    EXPECT_EQ(can.fd, pair[1]) << "without an end of the frames on the old one";
    close(pair[0]);
}

// Both sockets have the frames between the offer and the change. A second boot-up message would
// count, and start its node again.
TEST_F(linux_can, a_frame_that_both_sockets_have_comes_once) {
    const int on = 1;
    int pair[2];
    const auto send_to_new = [&](uint32_t id) {
        can_frame raw = {};
        raw.can_id = id;
        ASSERT_EQ(write(pair[0], &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    };
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
    ASSERT_EQ(setsockopt(box, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    ASSERT_EQ(setsockopt(pair[1], SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, cb_boottime_us()));
    cb_can_offer(&can, pair[1]);
    usleep(2000);
    send_to_new(0x705);
    send_to_new(CAN_ERR_FLAG | CAN_ERR_BUSOFF);
    controller_says(CAN_ERR_BUSOFF);
    send(0x705, {0});
    ASSERT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us()));
    EXPECT_EQ(frame.id, 0x705u);
    EXPECT_FALSE(cb_can_receive(&can, &frame, cb_boottime_us()));
    EXPECT_EQ(can.fd, pair[1]);
    EXPECT_EQ(can.counters.frames, 1u);
    EXPECT_EQ(can.counters.bus_offs, 1u);
    send_to_new(0x705);
    EXPECT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us())) << "a new one";
    close(pair[0]);
}

// Nothing is dropped for longer than a queue lasts.
TEST_F(linux_can, a_clock_that_was_set_back_hides_no_frame_behind_an_empty_queue) {
    const int on = 1;
    int pair[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, pair), 0);
    ASSERT_EQ(setsockopt(pair[1], SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    cb_can_offer(&can, box);
    EXPECT_FALSE(cb_can_receive(&can, &frame, cb_boottime_us()));
    can.stamp_ns = INT64_MAX;
    cb_can_offer(&can, pair[1]);
    take_offer();
    EXPECT_EQ(can.fd, pair[1]);
    can_frame raw = {};
    raw.can_id = 0x181;
    ASSERT_EQ(write(pair[0], &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    EXPECT_TRUE(cb_can_receive(&can, &frame, cb_boottime_us()));
    close(pair[0]);
}

TEST(linux_can_open, tells_why_it_cannot) {
    const uint32_t id = 0x181;
    const int got = cb_can_open("no_such_can", &id, 1);
    EXPECT_TRUE(got == -ENODEV || got == -EAFNOSUPPORT) << got;
}

// From frames on the bus to samples, and NMT on it.
TEST_F(linux_can, the_source_decodes_and_starts_nodes) {
    const auto loaded =
        load(with(R"("safety":)",
                  R"("can": {"nodes": [{"node": 5, "start": true, "heartbeat_timeout_ms": 1000}]},
        "safety":)"));
    ASSERT_EQ(loaded.error, CB_OK) << loaded.text;
    cb_can_source source;
    cb_can_source_start(&source, loaded.config.get());
    ASSERT_TRUE(cb_can_source_used(&source));
    cb_can_offer(&source.can, box);
    cb_sample samples[CB_MAX_SIGNALS];
    send(0x705, {0});
    send(0x181, {0, 0, 0xEB, 0x00});  // T1: offset 2, int16le: 235
    send(0x181, {0});
    ASSERT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 1000), 1u);
    EXPECT_STREQ(loaded.config->signals[samples[0].signal].name, "T1");
    EXPECT_EQ(samples[0].raw, 235);
    EXPECT_EQ(samples[0].time_us, 1000);
    EXPECT_EQ(source.can.counters.heartbeats, 1u);
    EXPECT_EQ(source.can.counters.short_frames, 1u);
    can_frame heard = {};
    ASSERT_EQ(read(bus, &heard, sizeof heard), static_cast<ssize_t>(sizeof heard));
    EXPECT_EQ(heard.can_id, 0u);
    EXPECT_EQ(heard.data[0], 1);
    EXPECT_EQ(heard.data[1], 5);
    EXPECT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 2000), 0u);
    cb_can_close(&source.can);
}

// Another file takes over: its signals count from the next frame on.
TEST_F(linux_can, the_source_follows_a_new_file) {
    const auto before = load(full_example);
    cb_can_source source;
    cb_can_source_start(&source, before.config.get());
    cb_can_offer(&source.can, box);
    cb_sample samples[CB_MAX_SIGNALS];
    EXPECT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 0), 0u);
    const auto after = load(with("\"0x181\", \"offset\": 2", "\"0x182\", \"offset\": 0"));
    cb_can_source_replan(&source, after.config.get());
    send(0x181, {0, 0, 1, 0});
    send(0x182, {2, 0});
    ASSERT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 0), 1u);
    EXPECT_EQ(samples[0].raw, 2);
    auto none = std::make_unique<cb_config>();
    cb_can_source_replan(&source, none.get());
    EXPECT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 0), 0u);
    EXPECT_EQ(source.can.returned, box) << "the bus is left";
    EXPECT_FALSE(cb_can_wanted(&source.can));
    cb_can_source_replan(&source, before.config.get());
    EXPECT_TRUE(cb_can_wanted(&source.can));
    cb_can_close(&source.can);
}

// What the old interface still says is none of the new file's business.
TEST_F(linux_can, the_source_gives_back_the_socket_of_another_interface) {
    const auto before = load(full_example);
    const auto after = load(with(R"("safety":)", R"("can": {"interface": "can1"}, "safety":)"));
    cb_can_source source;
    cb_can_source_start(&source, before.config.get());
    cb_can_offer(&source.can, box);
    cb_sample samples[CB_MAX_SIGNALS];
    EXPECT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 0), 0u);
    cb_can_source_replan(&source, after.config.get());
    send(0x181, {0, 0, 1, 0});
    EXPECT_EQ(cb_can_source_samples(&source, samples, CB_MAX_SIGNALS, 0), 0u);
    EXPECT_EQ(source.can.returned, box);
    EXPECT_TRUE(cb_can_wanted(&source.can));
    cb_can_close(&source.can);
}

TEST(linux_can_source, watches_nodes_also_where_no_signal_comes_from_them) {
    cb_config config = {};
    config.can.nodes_count = 1;
    config.can.nodes[0].node = 5;
    cb_can_source source;
    cb_can_source_start(&source, &config);
    EXPECT_TRUE(cb_can_source_used(&source));
    EXPECT_TRUE(cb_can_wanted(&source.can));
}

TEST(linux_can_source, asks_for_no_socket_where_the_file_has_no_can) {
    cb_config config = {};
    cb_can_source source;
    cb_can_source_start(&source, &config);
    cb_sample samples[1];
    EXPECT_FALSE(cb_can_source_used(&source));
    EXPECT_FALSE(cb_can_wanted(&source.can));
    EXPECT_EQ(cb_can_source_samples(&source, samples, 1, 0), 0u);
}

}  // namespace
