// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/raw.h>
#include <net/if.h>

#include <utility>
#include <vector>

#include "host-tools/fakeplc/rtu.h"
#include "tests/world/can_bus.h"
#include "tests/world/network.h"
#include "tests/world/serial_line.h"

namespace compbox::world {
namespace {

struct box_on_a_desk {
    scheduler time;
    computer box{time, 1};
};

TEST(wires, a_request_on_a_line_is_answered_after_the_time_of_its_bytes) {
    box_on_a_desk of;
    serial_line line(of.box, "/dev/ttyS7", 1);
    rtu_slaves slaves(line, of.time, [](int unit, const fakeplc::byte_string &request, time_ns) {
        return unit == 9 ? rtu_slaves::reply{{request[0], 2, 0, 7}} : rtu_slaves::reply{};
    });
    std::shared_ptr<open_file> file;
    ASSERT_EQ(of.box.files.open("/dev/ttyS7", O_RDWR, &file), 0);
    const fakeplc::byte_string request = fakeplc::rtu::frame(9, {3, 0, 0, 0, 1}),
                               other = fakeplc::rtu::frame(8, {3, 0, 0, 0, 1});
    file->write(other.data(), other.size());
    of.time.at(second, [&] { file->write(request.data(), request.size()); });
    of.time.run();
    char reply[32];
    EXPECT_EQ(file->read(reply, sizeof reply), 7);  // unit, function, count, value, check sum
    EXPECT_GE(of.time.now(), second + 15 * line.character());
}

// Delays the first frame.
struct late_first_frame : line_faults {
    bool first = true;
    line_fate at_line(bool) override {
        line_fate fate;
        if (std::exchange(first, false)) fate.delay_ns = 200 * ms;
        return fate;
    }
};

TEST(wires, a_late_frame_on_a_line_is_not_overtaken) {
    box_on_a_desk of;
    late_first_frame faults;
    serial_line line(of.box, "/dev/ttyS7", 1);
    line.faults = &faults;
    std::vector<fakeplc::byte_string> heard;
    line.heard = [&](const fakeplc::byte_string &bytes, time_ns) { heard.push_back(bytes); };
    std::shared_ptr<open_file> file;
    ASSERT_EQ(of.box.files.open("/dev/ttyS7", O_RDWR, &file), 0);
    file->write("a", 1);
    of.time.at(20 * ms, [&] { file->write("b", 1); });
    of.time.run();
    EXPECT_EQ(heard, (std::vector<fakeplc::byte_string>{{'a'}, {'b'}}));
    EXPECT_GE(of.time.now(), 200 * ms);
}

TEST(wires, a_line_that_is_unplugged_fails_and_needs_another_open) {
    box_on_a_desk of;
    serial_line line(of.box, "/dev/ttyS7", 1);
    std::shared_ptr<open_file> file, again;
    ASSERT_EQ(of.box.files.open("/dev/ttyS7", O_RDWR, &file), 0);
    line.plug(false);
    EXPECT_EQ(file->write("x", 1), -EIO);
    EXPECT_EQ(of.box.files.open("/dev/ttyS7", O_RDWR, &again), -ENODEV);
    line.plug(true);
    EXPECT_EQ(file->write("x", 1), -EIO);
    EXPECT_EQ(of.box.files.open("/dev/ttyS7", O_RDWR, &again), 0);
}

// Receives one frame. out: its identifier; 0: none
canid_t receive(open_file &socket) {
    can_frame frame = {};
    char control[128];
    iovec into = {&frame, sizeof frame};
    msghdr message = {};
    message.msg_iov = &into;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    return socket.receive_message(&message) > 0 ? frame.can_id : 0;
}

TEST(wires, a_can_socket_gets_the_frames_of_its_filters_while_the_interface_is_up) {
    box_on_a_desk of;
    can_bus bus(of.box, {}, 1);
    const auto socket = bus.make_socket();
    const can_filter filter = {0x181, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
    socket->set_option(SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter);
    ASSERT_EQ(socket->bind(nullptr, 0), 0);
    can_frame frame = {};
    for (const canid_t id : {0x181u, 0x182u}) {
        frame.can_id = id;
        bus.put(frame);
    }
    EXPECT_EQ(receive(*socket), 0x181u);
    EXPECT_EQ(receive(*socket), 0u);
    bus.set_interface(can_bus::interface_state::down);
    msghdr none = {};
    EXPECT_EQ(socket->receive_message(&none), -ENETDOWN);
    EXPECT_EQ(socket->send(&frame, sizeof frame), -ENETDOWN);
}

// A server that keeps what it hears.
struct echo : tcp_peer {
    bool accepted(const connection_ptr &) override { return true; }
    void received(const connection_ptr &from, const std::string &bytes, time_ns) override {
        heard += bytes;
        from->send(bytes);
    }
    void closed(const connection_ptr &, bool was_reset) override { ended = was_reset ? 'R' : 'F'; }
    std::string heard;
    char ended = ' ';
};

TEST(wires, bytes_of_a_connection_keep_their_order_and_its_end_comes_behind_them) {
    box_on_a_desk of;
    network net(of.box, 1);
    echo server;
    net.listen(502, &server);
    const auto socket = make_tcp_socket(net);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(502);
    EXPECT_EQ(socket->connect(reinterpret_cast<sockaddr *>(&address), sizeof address),
              -EINPROGRESS);
    of.time.at(10 * ms, [&] {
        for (const char *part : {"a", "b", "c"}) socket->send(part, 1);
    });
    std::string back;
    of.time.at(20 * ms, [&] {
        char bytes[8];
        back.assign(bytes, static_cast<std::size_t>(socket->receive(bytes, sizeof bytes)));
        socket->send("d", 1);
        socket->closed(false);
    });
    of.time.run();
    EXPECT_EQ(server.heard, "abcd");
    EXPECT_EQ(back, "abc");
    EXPECT_NE(server.ended, ' ');
}

// Delays the first segment to the peer.
struct slow_first : link_faults {
    segment_fate at_segment(bool to_box, std::size_t) override {
        segment_fate fate;
        if (!to_box) fate.delay_ns = std::exchange(left_ns, 0);
        return fate;
    }
    segment_fate at_connect() override { return {}; }
    time_ns left_ns = 0;
};

// out: what the server heard of a byte that waits so long while the box resets its connection
std::string heard_after(time_ns wait_ns) {
    box_on_a_desk of;
    network net(of.box, 1);
    echo server;
    slow_first slow;
    slow.left_ns = wait_ns;
    net.faults = &slow;
    net.longest_wait = [](time_ns) { return 200 * ms; };
    net.listen(502, &server);
    const auto socket = make_tcp_socket(net);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(502);
    socket->connect(reinterpret_cast<sockaddr *>(&address), sizeof address);
    of.time.at(10 * ms, [&] {
        const linger discard = {1, 0};
        socket->set_option(SOL_SOCKET, SO_LINGER, &discard, sizeof discard);
        socket->send("a", 1);
    });
    of.time.at(20 * ms, [&] { socket->closed(false); });
    of.time.run();
    return server.heard;
}

TEST(wires, bytes_of_a_reset_connection_wait_in_the_peer_no_longer_than_a_turn_of_its_program) {
    EXPECT_EQ(heard_after(190 * ms), "a");
    EXPECT_EQ(heard_after(300 * ms), "");
}

TEST(wires, nobody_listens_at_another_port) {
    box_on_a_desk of;
    network net(of.box, 1);
    const auto socket = make_tcp_socket(net);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    socket->connect(reinterpret_cast<sockaddr *>(&address), sizeof address);
    of.time.run();
    int error = 0;
    socklen_t size = sizeof error;
    EXPECT_EQ(socket->get_option(SOL_SOCKET, SO_ERROR, &error, &size), 0);
    EXPECT_EQ(error, ECONNREFUSED);
}

}  // namespace
}  // namespace compbox::world
