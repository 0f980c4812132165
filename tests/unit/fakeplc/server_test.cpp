// SPDX-License-Identifier: MIT
// The sockets, commands and log of fakeplc.
#include "host-tools/fakeplc/server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <set>

#include "host-tools/fakeplc/console.h"
#include "host-tools/fakeplc/log.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "tests/support/paths.h"
#include "tests/support/still_clock.h"
#include "tests/support/temporary.h"

namespace compbox::fakeplc {
namespace {

const std::string example = from_source("examples/gantry-straightness/");
const byte_string read_one = {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
const byte_string read_one_reply = {0, 1, 0, 0, 0, 5, 1, 3, 2, 0x12, 0x34};
const byte_string write_one = {0, 2, 0, 0, 0, 6, 1, 6, 0, 1, 0, 9};

// A server and its registers, driven by the tests' own loop. A millisecond passes when nothing is
// left to do and nothing is under way between server and peers.
struct bench {
    modbus_server server;
    plc_profile profile = plc_profile::find("generic").value();
    modbus::bank bank{{0x1234, 0, 0, 0}, {0, 0, 0, 0}};
    int handled = 0;
    std::int64_t now_us = 0;
    std::set<int> peers;  // their sockets

    explicit bench(int max_clients = 8) : server("127.0.0.1:0", max_clients) {}

    void serve_ms(int duration_ms) {
        for (int ms = 0; ms < duration_ms; ++ms, now_us += 1000) {
            for (int looks = 0; serve() || (looks < 100 && is_under_way()); ++looks)
                still_clock::real_pause();
        }
    }
    // out: whether there was something to do
    bool serve() {
        std::vector<pollfd> set;
        server.append_poll_set(set);
        const int ready = ::poll(set.data(), set.size(), 0);
        server.process(set, now_us, [this](const byte_string &request, bool torn) {
            ++handled;
            return modbus::answer(request, profile, bank, torn);
        });
        return ready > 0;
    }
    bool is_under_way() {
        const int on = 1;
        std::vector<pollfd> set;
        server.append_poll_set(set);
        for (const int fd : peers) set.push_back({fd, 0, 0});
        for (const auto &one : set)  // else the kernel may keep an acknowledgement back for 40 ms
            ::setsockopt(one.fd, IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
        return std::any_of(set.begin(), set.end(),
                           [](const auto &one) { return still_clock::is_under_way(one.fd); });
    }
};

// A client that is connected at once and never blocks.
class peer {
  public:
    explicit peer(bench &to) : to_(to), fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
        const std::string address = to.server.address();
        sockaddr_in at = {};
        at.sin_family = AF_INET;
        at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(10))));
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const int on = 1;
        ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr *>(&at), sizeof at), 0);
        to_.peers.insert(fd_);
    }
    ~peer() {
        to_.peers.erase(fd_);
        ::close(fd_);
    }
    peer(const peer &) = delete;
    peer &operator=(const peer &) = delete;

    void send(const byte_string &bytes) {
        ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    byte_string received() {
        byte_string bytes(4096);
        const ssize_t n = ::recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
        closed_ = n == 0 || (n < 0 && errno != EAGAIN);
        bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
        return bytes;
    }
    bool closed() {
        received();
        return closed_;
    }

  private:
    bench &to_;
    int fd_;
    bool closed_ = false;
};

byte_string twice(const byte_string &bytes) {
    byte_string both = bytes;
    both.insert(both.end(), bytes.begin(), bytes.end());
    return both;
}

TEST(Server, AnswersWholePipelinedAndDribbledRequests) {
    bench b;
    peer p(b);
    p.send(read_one);
    b.serve_ms(5);
    EXPECT_EQ(p.received(), read_one_reply);
    p.send(twice(read_one));
    b.serve_ms(5);
    EXPECT_EQ(p.received(), twice(read_one_reply));
    for (const auto byte : read_one) {
        EXPECT_TRUE(p.received().empty());
        p.send({byte});
        b.serve_ms(2);
    }
    EXPECT_EQ(p.received(), read_one_reply);
}

TEST(Server, ServesSeveralClientsAndTurnsAwayTheRest) {
    bench b(2);
    peer first(b), second(b);
    b.serve_ms(5);
    peer third(b);
    b.serve_ms(5);
    EXPECT_EQ(b.server.clients(), 2u);
    EXPECT_TRUE(third.closed());
    first.send(read_one), second.send(read_one);
    b.serve_ms(5);
    EXPECT_EQ(first.received(), read_one_reply);
    EXPECT_EQ(second.received(), read_one_reply);
}

TEST(Server, AClientThatReconnectsFindsItsPlaceFree) {
    bench b(1);
    auto p = std::make_unique<peer>(b);
    b.serve_ms(5);
    for (int i = 0; i < 20; ++i) {
        p.reset();
        p = std::make_unique<peer>(b);
        p->send(read_one);
        b.serve_ms(3);
        ASSERT_EQ(p->received(), read_one_reply) << i;
    }
}

TEST(Server, ClosesWhoSendsNonsenseAndKeepsTheOthers) {
    bench b;
    peer good(b), bad(b);
    bad.send({'G', 'E', 'T', ' ', '/', ' ', 'H', 'T', 'T', 'P', '\r', '\n'});
    b.serve_ms(5);
    EXPECT_TRUE(bad.closed());
    good.send(read_one);
    b.serve_ms(5);
    EXPECT_EQ(good.received(), read_one_reply);
}

TEST(Server, SurvivesRandomBytesAndAbruptEnds) {
    bench b;
    twin::random_stream random(21, "rubbish");
    for (int i = 0; i < 100; ++i) {
        peer p(b);
        byte_string bytes = i % 2 ? read_one : byte_string();
        for (auto n = random.next() % 300; n > 0; --n) {
            bytes.push_back(static_cast<std::uint8_t>(random.next()));
        }
        p.send(bytes);
        b.serve_ms(1);
    }
    b.serve_ms(10);
    EXPECT_EQ(b.server.clients(), 0u);
    peer p(b);
    p.send(read_one);
    b.serve_ms(5);
    EXPECT_EQ(p.received(), read_one_reply);
}

TEST(Server, DropsAClientThatNeverReads) {
    bench b;
    peer p(b);
    byte_string flood;
    for (int i = 0; i < 200; ++i) flood.insert(flood.end(), read_one.begin(), read_one.end());
    b.server.faults().add({fault_kind::late, 600000}, 1);
    for (int i = 0; i < 400 && (i < 5 || b.server.clients() > 0); ++i) {
        p.send(flood);
        b.serve_ms(1);
    }
    EXPECT_EQ(b.server.clients(), 0u);
}

TEST(Server, FaultsDoToTheWireWhatTheySay) {
    bench b;
    peer p(b);
    const auto exchange = [&](const byte_string &request, int wait_ms = 5) {
        p.send(request);
        b.serve_ms(wait_ms);
        return p.received();
    };
    b.server.faults().add({fault_kind::drop}, 1);
    EXPECT_TRUE(exchange(write_one).empty());
    EXPECT_EQ(b.bank.now[1], 9);  // obeyed all the same

    b.bank.now[1] = 0;
    b.server.faults().add({fault_kind::exception, 4}, 1);
    EXPECT_EQ(exchange(write_one), (byte_string{0, 2, 0, 0, 0, 3, 1, 0x86, 4}));
    EXPECT_EQ(b.bank.now[1], 0);  // not obeyed

    b.server.faults().add({fault_kind::wrong_id}, 1);
    EXPECT_EQ(exchange(read_one)[1], 2);

    b.server.faults().add({fault_kind::truncate}, 1);
    EXPECT_EQ(exchange(read_one).size(), read_one_reply.size() / 2);

    b.server.faults().add({fault_kind::late, 150}, 1);
    EXPECT_TRUE(exchange(read_one, 10).empty());
    EXPECT_TRUE(exchange(write_one, 10).empty());  // waits behind the late one
    b.serve_ms(150);
    byte_string both = read_one_reply;
    both.insert(both.end(), write_one.begin(), write_one.end());
    EXPECT_EQ(p.received(), both);

    b.server.faults().add({fault_kind::dribble, 20}, 1);
    const std::size_t early = exchange(read_one, 30).size();
    EXPECT_GE(early, 1u);
    EXPECT_LE(early, 5u);
    b.serve_ms(240);
    EXPECT_EQ(p.received().size(), read_one_reply.size() - early);

    EXPECT_EQ(exchange(read_one), read_one_reply);
    b.server.close_all_clients();
    EXPECT_TRUE(p.closed());
}

TEST(Server, IsAwayForAsLongAsItWasTold) {
    bench b;
    peer first(b);
    b.serve_ms(5);
    b.server.go_away(120);
    EXPECT_TRUE(first.closed());
    b.serve_ms(1);
    peer second(b);
    second.send(read_one);
    b.serve_ms(20);
    EXPECT_TRUE(second.closed());
    EXPECT_EQ(b.handled, 0);
    b.serve_ms(120);
    peer third(b);
    third.send(read_one);
    b.serve_ms(5);
    EXPECT_EQ(third.received(), read_one_reply);
}

TEST(Server, SaysWhyItCannotListen) {
    for (const char *bad : {"", "1502", ":1502", "127.0.0.1:", "127.0.0.1:x", "h:65536", "h:-1"}) {
        EXPECT_NE(modbus_server::fault_in(bad), "") << bad;
        EXPECT_THROW(modbus_server(bad, 1), input_error) << bad;
    }
    EXPECT_EQ(modbus_server::fault_in("[::1]:0"), "");
    const modbus_server first("127.0.0.1:0", 1);
    try {
        modbus_server second(first.address(), 1);
        FAIL() << "two servers on one port";
    } catch (const input_error &error) {
        EXPECT_NE(std::string(error.what()).find("is in use"), std::string::npos);
    }
}

// ---- commands and log

// Requests that a plan spoils; function 23 reads and writes, and meets every fault.
int left(fault_plan plan) {
    int requests = 0;
    while (plan.take(23)) ++requests;
    return requests;
}

struct desk {
    plc_setup setup;
    fake_plc plc;
    modbus_server server{"127.0.0.1:0", 4};
    console commands{plc, server};

    desk()
        : setup(prepare({"generic", example + "machine_twin.json", "", {}})),
          plc(setup.twin, setup.map, setup.profile, 0) {}
};

TEST(Console, AnswersEveryLineByOneLine) {
    desk d;
    const std::pair<const char *, const char *> cases[] = {
        {"enable 1", "ok"},
        {"enable 2", "error: '2' is not a whole number from 0 to 1"},
        {"enable", "error: usage: enable 0|1"},
        {"permit 0", "ok"},
        {"reset", "ok"},
        {"move X=4300 Y=901 feed=1000", "ok"},
        {"move X=1e9 feed=1000", "error: X 1000000000 mm is outside the travel 0 to 14300 mm"},
        {"move X=1", "error: a move needs a feed above zero"},
        {"move Q=1 feed=1", "error: 'Q' is neither an axis nor feed"},
        {"move feed=1", "error: usage: move X=1 Y=2 Z=3 feed=1000"},
        {"move X=nan feed=1", "error: 'nan' is not a number"},
        {"freeze heartbeat 1", "ok"},
        {"freeze 1", "error: usage: freeze heartbeat 0|1"},
        {"signal X 5", "ok"},
        {"signal X auto", "ok"},
        {"signal Q 5", "error: no signal 'Q' is shown or forced"},
        {"fault late 20 3", "ok"},
        {"fault exception 2 1 write", "ok"},
        {"fault drop read", "ok"},
        {"fault torn 2", "ok"},
        {"fault late", "error: fault late needs a number"},
        {"fault drop 0", "error: '0' is not a whole number from 1 to 1000000000"},
        {"fault drop 1 2 3", "error: usage: fault KIND [VALUE] [COUNT] [read|write]"},
        {"fault", "error: usage: fault late|drop"},
        {"fault close", "ok closed 0"},
        {"fault away 5", "ok closed 0"},
        {"fault away", "error: usage: fault late|drop"},
        {"fault away 0", "error: '0' is not a whole number from 1 to 600000"},
        {"alarms", "ok 0"},
        {"restart", "ok"},
        {"", "error: an empty line"},
        {"dance", "error: 'dance' is not a command; see fakeplc --help"},
    };
    for (const auto &[line, answer] : cases) {
        const std::string got = d.commands.run(line);
        EXPECT_EQ(got.rfind(answer, 0), 0u) << line << "\n  gives: " << got;
        EXPECT_EQ(got.find('\n'), std::string::npos);
    }
    EXPECT_EQ(left(d.server.faults()), 3 + 1 + 1 + 2);
    EXPECT_EQ(d.commands.run("fault clear"), "ok");
    EXPECT_EQ(left(d.server.faults()), 0);
    EXPECT_FALSE(d.commands.quit);
    d.commands.run("quit");
    EXPECT_TRUE(d.commands.quit);
}

TEST(Console, MovesAndReports) {
    desk d;
    d.plc.run_to(0);
    EXPECT_EQ(d.commands.run("position"), "ok X=4290 Y=900 Z=750");
    EXPECT_EQ(d.commands.run("move X=4300 feed=6000"), "ok");
    for (int i = 1; i <= 10; ++i) d.plc.run_to(i * 100000);
    EXPECT_EQ(d.commands.run("position"), "ok X=4300 Y=900 Z=750");
    const std::string status = d.commands.run("status");
    EXPECT_NE(status.find(" mode=0 "), std::string::npos) << status;
    EXPECT_NE(status.find(" moving=0 "), std::string::npos) << status;
    twin::twin_state machine = d.plc.nc().state();
    machine.drive_um = {};
    const twin::xyz truth = d.plc.twin().true_error_um(machine);
    EXPECT_EQ(d.commands.run("error").rfind("ok before X=", 0), 0u);
    EXPECT_NEAR(d.plc.state().error_before_um[2], truth[2], 1e-9);
}

TEST(Console, ListsTheAlarmsThatStand) {
    desk d;
    d.commands.run("freeze heartbeat 1");
    d.plc.run_to(100000);
    EXPECT_EQ(d.commands.run("alarms"),
              "ok 1 nc-coupling since_s=0 \"no positions come from the NC\";");
    EXPECT_NE(d.commands.run("status").find(" alarms=1 "), std::string::npos);
    d.commands.run("freeze heartbeat 0");
    d.plc.run_to(120000);
    EXPECT_EQ(d.commands.run("alarms"), "ok 0");
}

TEST(Log, HasARowForEachScanAndReadsBack) {
    desk d;
    const std::string path = compbox_test::temporary("log.csv");
    {
        plc_log log(path, d.setup.map);
        d.commands.run("move X=4300, feed=1000");
        d.commands.run("signal X 5");
        d.plc.run_to(800000, [&log](const plc_state &state) { log.add(state); });
        EXPECT_TRUE(log.flush());
    }
    std::vector<std::vector<std::string>> words;
    const formats::csv_table table = formats::read_csv(path, {"event"}, &words);
    ASSERT_EQ(table.rows.size(), 101u);
    EXPECT_EQ(table.values("time_s")[100], 0.8);
    EXPECT_EQ(table.values("X_mm")[0], 4290.0);
    for (const char *name :
         {"commanded_X_um", "applied_Z_um", "nc_X_um", "nc_Z_slope", "nc_Y_reference_mm",
          "handshake", "alarms", "displacement_Y_um", "error_before_X_um", "error_after_Z_um",
          "control", "status", "plc_heartbeat", "box_heartbeat"}) {
        EXPECT_GE(table.find(name), 0) << name;
    }
    EXPECT_NE(formats::read_file(path).find("signal X forced | command signal X 5"),
              std::string::npos);
    EXPECT_THROW(plc_log("/nonexistent/log.csv", d.setup.map), input_error);
}

}  // namespace
}  // namespace compbox::fakeplc
