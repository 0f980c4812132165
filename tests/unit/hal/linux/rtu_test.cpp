// SPDX-License-Identifier: MIT
// The serial client against a slave on a pseudo-terminal that misbehaves on purpose, in the time of
// a still clock (tests/support/still_clock.h).
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/still_clock.h"
#include "tests/support/temporary.h"

extern "C" {
#include "firmware/config/rtu_budget.h"
#include "hal/linux/clock.h"
#include "hal/linux/rtu.h"
}

namespace {

using bytes = std::vector<uint8_t>;

using still_clock::sleep_ms;

struct rtu : ::testing::Test {
    still_clock::clock clock;
};

bytes with_crc(bytes frame) {
    const uint16_t crc = cb_rtu_crc(frame.data(), frame.size());
    frame.push_back(static_cast<uint8_t>(crc & 0xFF));
    frame.push_back(static_cast<uint8_t>(crc >> 8));
    return frame;
}

bytes two_registers(int v, uint8_t unit = 17) {
    return with_crc({unit, 3, 4, 0, static_cast<uint8_t>(v), 0, static_cast<uint8_t>(v + 1)});
}

bytes two_written() {
    return with_crc({17, 16, 0, 100, 0, 2});
}

// Readings of 1 or 3 registers: the blocks have 2 and 4.
bool is_probe(const bytes &request) {
    return request[1] == 3 && request[5] % 2 == 1;
}

// The far end of a serial line. The handler gets each request, with its number from 1. Probes are
// answered by themselves, behind what the handler of the one before had to send, or given to
// `probed`.
class slave {
  public:
    using handler = std::function<void(slave &, const bytes &request, int number)>;

    explicit slave(handler handle) : handle_(std::move(handle)) {
        link_ = compbox_test::temporary("rtu-" + std::to_string(reinterpret_cast<uintptr_t>(this)));
        plug_in();
        still_clock::join();
        thread_ = std::thread([this] { serve(); });
    }
    ~slave() {
        over_ = true;
        still_clock::leave();  // time goes on for the slave
        thread_.join();
        still_clock::join();
        unplug();
    }
    void plug_in() {
        const std::lock_guard<std::mutex> guard(mutex_);
        master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
        if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) abort();
        std::filesystem::create_symlink(ptsname(master_), link_);
    }
    void unplug() {
        const std::lock_guard<std::mutex> guard(mutex_);
        pull();
    }
    // As unplug(), in a handler.
    void pull() {
        std::filesystem::remove(link_);
        if (master_ >= 0) close(master_);
        master_ = -1;
    }
    void send(const bytes &some) {
        EXPECT_EQ(write(master_, some.data(), some.size()), static_cast<ssize_t>(some.size()));
    }
    bytes probe_reply() const {
        if (probed_ == 1) return with_crc({17, 3, 2, 0, 0});
        return with_crc({17, 3, 6, 0, 0, 0, 0, 0, 0});
    }
    void answer_probe() { send(probe_reply()); }
    int requests() const { return requests_; }
    int probes() const { return probes_; }
    std::function<void(slave &, int number)> probed = [](slave &s, int) { s.answer_probe(); };
    bytes last() {
        const std::lock_guard<std::mutex> guard(mutex_);
        return last_;
    }
    const std::string &device() const { return link_; }

  private:
    static size_t length_of(const bytes &some) {
        if (some.size() < 7) return 0;
        return some[1] == 3 ? 8 : 9u + some[6];
    }
    void serve() {
        while (!over_) {
            if (!take_request()) sleep_ms(1);
        }
        still_clock::leave();
    }
    // Reads what has come. out: whether anything had
    bool take_request() {
        const std::lock_guard<std::mutex> guard(mutex_);
        uint8_t block[256];
        pollfd look{master_, POLLIN, 0};
        const bool there = master_ >= 0 && poll(&look, 1, 0) > 0;
        const ssize_t n = there ? read(master_, block, sizeof block) : 0;
        if (n > 0) got_.insert(got_.end(), block, block + n);
        const size_t length = length_of(got_);
        if (length == 0 || got_.size() < length) return n > 0;
        const bytes request(got_.begin(), got_.begin() + static_cast<long>(length));
        got_.clear();
        if (is_probe(request)) {
            probed_ = request[5];
            probed(*this, ++probes_);
        } else {
            last_ = request;
            handle_(*this, request, ++requests_);
        }
        return true;
    }
    handler handle_;
    std::string link_;
    std::mutex mutex_;
    int master_ = -1;
    std::atomic<int> requests_{0}, probes_{0};
    int probed_ = 0;  // registers of the last probe
    std::atomic<bool> over_{false};
    bytes got_, last_;
    std::thread thread_;
};

constexpr int DEADLINE_MS = 300;

cb_serial_config config_of(const slave &at) {
    cb_serial_config config{};
    at.device().copy(config.device, sizeof config.device - 1);
    config.line = {115200, CB_PARITY_EVEN, 1};
    config.unit = 17;
    config.slave_delay_us = 2000;
    return config;
}

struct client {
    cb_rtu rtu;
    uint16_t registers[125] = {0xEEEE, 0xEEEE, 0xEEEE};

    explicit client(const slave &at, cb_serial_opener *opener = nullptr) {
        cb_plc_config plc{};
        plc.serial = config_of(at);
        plc.read = {8, 2, false};
        plc.write = {100, 4, false};
        plc.exchange = CB_EXCHANGE_FC23;  // no time is kept for a write
        const cb_rtu_manners manners = cb_rtu_manners_of(&plc);
        cb_rtu_start(&rtu, &plc.serial, &manners, opener);
    }
    ~client() { cb_serial_close(&rtu.serial); }
    cb_transfer read(int ms = DEADLINE_MS) {
        const cb_modbus_request request = cb_modbus_read(8, 2);
        return cb_rtu_exchange(&rtu, &request, registers, cb_boottime_us() + ms * 1000);
    }
    cb_transfer write(int ms = DEADLINE_MS) {
        const uint16_t values[2] = {1, 2};
        const cb_modbus_request request = cb_modbus_write(100, 2, values);
        return cb_rtu_exchange(&rtu, &request, nullptr, cb_boottime_us() + ms * 1000);
    }
};

cb_transfer read_until_good(client &c) {
    cb_transfer got = CB_TRANSFER_FAILED;
    for (int i = 0; i < 500 && got != CB_TRANSFER_OK; ++i, sleep_ms(5)) got = c.read();
    return got;
}

// A whole frame that was not the reply: by itself, or in one piece with the reply behind it.
bool was_dropped(const client &c) {
    return c.rtu.counters.late_replies + c.rtu.counters.noise_bytes > 0;
}

void behave(slave &s, const bytes &request, int number) {
    s.send(request[1] == 3 ? two_registers(number) : two_written());
}

TEST_F(rtu, what_is_on_the_wire_is_what_the_specification_says) {
    slave plc(behave);
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(plc.last(), with_crc({17, 3, 0, 8, 0, 2}));
    EXPECT_EQ(c.registers[0], 1);
    EXPECT_EQ(c.registers[1], 2);
    EXPECT_EQ(c.registers[2], 0xEEEE);
    EXPECT_EQ(c.write(), CB_TRANSFER_OK);
    EXPECT_EQ(plc.last(), with_crc({17, 16, 0, 100, 0, 2, 4, 0, 1, 0, 2}));
    EXPECT_EQ(c.rtu.counters.replies, 3u);  // and the probe's, the first of all
    EXPECT_EQ(plc.probes(), 1);
}

TEST_F(rtu, a_refusal_is_distinguished) {
    uint8_t code = 2;
    slave plc([&](slave &s, const bytes &, int) { s.send(with_crc({17, 0x83, code})); });
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_REFUSED);
    EXPECT_EQ(c.rtu.counters.exceptions_by_code[2], 1u);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(c.rtu.peer.refused_functions, 0u);
    code = 1;
    EXPECT_EQ(c.read(), CB_TRANSFER_REFUSED);
    EXPECT_EQ(c.rtu.peer.refused_functions, 1u << 3);
}

// Each kind of wrong reply is retried at once, where there is time; what is not the damaged
// reply itself only when a probe has shown that nothing else is to come.
TEST_F(rtu, wrong_replies_are_asked_for_again) {
    slave plc([](slave &s, const bytes &request, int number) {
        bytes reply = two_registers(number);
        if (number == 1) reply[4] ^= 0x10;
        if (number == 2) reply = two_registers(number, 18);
        if (number == 3) reply = with_crc({17, 3, 8, 0, 1, 0, 2, 0, 3, 0, 4});
        if (number == 4) reply.resize(6);
        if (number > 4)
            behave(s, request, number);
        else
            s.send(reply);
    });
    client c(plc);
    c.rtu.dialog.doubtful = false;
    EXPECT_EQ(c.read(5000), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 5);
    EXPECT_EQ(c.rtu.counters.timeouts, 0u);
    EXPECT_EQ(c.rtu.counters.crc_errors, 2u);
    EXPECT_EQ(c.rtu.counters.wrong_units, 1u);
    EXPECT_EQ(c.rtu.counters.invalid_replies, 1u);
    EXPECT_EQ(c.rtu.peer.odd[CB_ODD_UNIT].got, 18);
    EXPECT_EQ(c.rtu.peer.odd[CB_ODD_UNIT].expected, 17);
    EXPECT_EQ(c.rtu.peer.odd[CB_ODD_LENGTH].got, 10);
    EXPECT_EQ(c.rtu.peer.odd[CB_ODD_LENGTH].expected, 6);
    EXPECT_EQ(c.rtu.counters.retries, 4u);
    EXPECT_EQ(c.rtu.counters.probes, 3u);
    EXPECT_EQ(c.rtu.counters.requests, 8u);
}

// 21 characters and silences take 5.1 ms, and the slave and the driver may take 8 ms more.
TEST_F(rtu, without_time_for_another_try_a_wrong_reply_costs_its_exchange) {
    slave plc([](slave &s, const bytes &request, int number) {
        bytes reply = two_registers(number);
        reply[4] ^= static_cast<uint8_t>(number == 1);
        if (number > 1) behave(s, request, number);
        if (number == 1) s.send(reply);
    });
    client c(plc);
    c.rtu.dialog.doubtful = false;
    c.rtu.dialog.manners.reserve_us = 10000000;
    EXPECT_EQ(c.read(), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(plc.requests(), 1);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.rtu.counters.probes, 0u);  // that reply was its own, damaged: nothing is to come
}

TEST_F(rtu, noise_before_a_reply_costs_nothing) {
    slave plc([](slave &s, const bytes &request, int number) {
        s.send({0, 17, 3, 0xFF});
        behave(s, request, number);
    });
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 1);
    EXPECT_EQ(c.rtu.counters.noise_bytes, 4u);
}

TEST_F(rtu, stale_bytes_are_thrown_away_before_a_request) {
    slave plc(behave);
    client c(plc);
    plc.send(two_registers(99));
    sleep_ms(20);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 1);
    EXPECT_EQ(c.rtu.counters.stray_replies, 1u);
}

TEST_F(rtu, without_a_reply_a_probe_goes_first) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number > 1) behave(s, request, number);
    });
    plc.probed = [](slave &s, int number) {
        if (number != 2) s.answer_probe();
    };
    client c(plc);
    c.rtu.dialog.manners.reserve_us = 10000000;  // one try a cycle
    EXPECT_EQ(c.read(), CB_TRANSFER_UNKNOWN);    // nothing until its deadline
    EXPECT_EQ(c.read(50), CB_TRANSFER_FAILED);   // nor to the probe
    EXPECT_EQ(plc.requests(), 1);
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_GE(plc.probes(), 2);
}

// It says nothing to each second request.
TEST_F(rtu, a_lost_reply_is_asked_for_again_in_its_period_where_there_is_time) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number % 2 == 0) behave(s, request, number);
    });
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.rtu.counters.timeouts, 1u);
    EXPECT_EQ(c.rtu.counters.retries, 1u);
    EXPECT_EQ(c.registers[0], plc.requests());
}

// However late: it comes before the reply to the probe, and is dropped.
TEST_F(rtu, a_late_reply_is_dropped_and_the_next_request_goes_out) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number > 1) behave(s, request, number);
    });
    plc.probed = [](slave &s, int number) {
        if (number == 2) s.send(two_registers(1));  // of the request that was given up
        if (number == 2) sleep_ms(20);
        s.answer_probe();
    };
    client c(plc);
    c.rtu.dialog.manners.reserve_us = 10000000;
    EXPECT_EQ(c.read(), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_TRUE(was_dropped(c));
}

// The case that time alone cannot tell: the slave answers more than two periods late, and has lost
// the requests since. Its reply has all that the next request's would have.
TEST_F(rtu, a_very_late_reply_is_not_taken_though_the_next_request_is_lost) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number > 1) behave(s, request, number);
    });
    plc.probed = [](slave &s, int number) {
        if (number == 1 || number > 3) s.answer_probe();
        if (number == 3) s.send(two_registers(1));
    };
    client c(plc);
    c.rtu.dialog.manners.reserve_us = 10000000;
    for (int cycle = 0; cycle < 3; ++cycle) EXPECT_NE(c.read(60), CB_TRANSFER_OK) << cycle;
    EXPECT_EQ(c.registers[0], 0xEEEE);
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_TRUE(was_dropped(c));
}

TEST_F(rtu, a_probe_that_is_refused_leaves_the_doubt) {
    slave plc(behave);
    plc.probed = [](slave &s, int number) {
        if (number == 1)
            s.send(with_crc({17, 0x83, 6}));
        else
            s.answer_probe();
    };
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_REFUSED);
    EXPECT_EQ(plc.requests(), 0);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
}

TEST_F(rtu, a_probe_with_a_damaged_reply_is_sent_again) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number > 1) behave(s, request, number);
    });
    plc.probed = [](slave &s, int number) {
        bytes reply = s.probe_reply();
        if (number == 1) reply.back() ^= 1;
        s.send(reply);
    };
    client c(plc);
    c.rtu.dialog.manners.reserve_us = 10000000;  // one try a cycle
    EXPECT_EQ(c.read(), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(plc.probes(), 2);
    EXPECT_EQ(c.rtu.counters.crc_errors, 1u);
    EXPECT_EQ(c.registers[0], 2);
}

// It may be the reply to an earlier request, and the next one would be taken for this one's.
TEST_F(rtu, a_frame_that_nobody_asked_for_is_followed_by_a_probe) {
    slave plc(behave);
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    const int probes = plc.probes();
    plc.send(two_registers(99));
    sleep_ms(20);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.registers[0], 2);
    EXPECT_EQ(plc.probes(), probes + 1);
    EXPECT_EQ(c.rtu.counters.stray_replies, 1u);
}

TEST_F(rtu, a_line_that_is_never_silent_is_not_waited_for_beyond_the_deadline) {
    slave plc([](slave &s, const bytes &request, int number) {
        behave(s, request, number);
        for (int i = 0; number == 1 && i < 100; ++i, sleep_ms(1)) s.send({0x55});
    });
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    sleep_ms(10);
    const int64_t from_us = cb_boottime_us();
    EXPECT_EQ(c.read(30), CB_TRANSFER_FAILED);
    EXPECT_LT(cb_boottime_us() - from_us, 31000);
    EXPECT_EQ(plc.requests(), 1);
    sleep_ms(100);
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
}

// They may have been a reply, and more may follow.
TEST_F(rtu, bytes_before_a_request_that_is_not_sent_are_counted_and_leave_a_doubt) {
    slave plc([](slave &s, const bytes &request, int number) {
        behave(s, request, number);
        for (int i = 0; number == 1 && i < 100; ++i, sleep_ms(1)) s.send({0x55});
    });
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.read(30), CB_TRANSFER_FAILED);
    EXPECT_EQ(plc.requests(), 1);
    EXPECT_GE(c.rtu.counters.noise_bytes, CB_RTU_MIN_FRAME + 0u);
    EXPECT_EQ(c.rtu.counters.stray_replies, 1u);
    EXPECT_TRUE(c.rtu.dialog.doubtful);
}

TEST_F(rtu, a_device_that_is_unplugged_in_the_wait_for_a_reply_ends_it) {
    slave plc([](slave &s, const bytes &request, int number) {
        if (number == 1)
            s.pull();
        else
            behave(s, request, number);
    });
    client c(plc);
    const int64_t from_us = cb_boottime_us();
    EXPECT_NE(c.read(1000), CB_TRANSFER_OK);
    EXPECT_LT(cb_boottime_us() - from_us, 500000);
    EXPECT_EQ(c.rtu.serial.disconnects, 1u);
    EXPECT_EQ(c.rtu.counters.timeouts, 0u) << "it is the device's";
    plc.plug_in();
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
}

TEST_F(rtu, modules_of_a_bus_do_not_wait_for_each_other) {
    slave modules([](slave &s, const bytes &request, int number) {
        if (request[0] == 18) s.send(two_registers(number, 18));
    });
    cb_rtu bus;
    const cb_serial_config config = config_of(modules);
    cb_rtu_start_bus(&bus, &config, nullptr);
    uint16_t registers[2];
    const cb_modbus_request request = cb_modbus_read(8, 2);
    const auto read = [&](uint8_t unit, int ms) {
        return cb_rtu_read_module(&bus, unit, &request, registers, cb_boottime_us() + ms * 1000);
    };
    EXPECT_EQ(read(17, 30), CB_TRANSFER_UNKNOWN);
    EXPECT_EQ(read(18, 150), CB_TRANSFER_OK);
    EXPECT_EQ(registers[0], 2);
    EXPECT_EQ(modules.probes(), 0);
    cb_serial_close(&bus.serial);
}

TEST_F(rtu, what_could_not_be_answered_in_time_is_not_sent) {
    slave plc(behave);
    client c(plc);
    sleep_ms(20);
    c.rtu.dialog.doubtful = false;
    EXPECT_EQ(c.read(4), CB_TRANSFER_FAILED);  // 21 characters and silences take 5.1 ms
    EXPECT_EQ(c.write(0), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.rtu.counters.out_of_time, 2u);
    EXPECT_EQ(plc.requests(), 0);
}

TEST_F(rtu, a_device_that_is_unplugged_is_opened_again) {
    slave plc(behave);
    client c(plc);
    EXPECT_EQ(c.read(), CB_TRANSFER_OK);
    plc.unplug();
    EXPECT_NE(c.read(), CB_TRANSFER_OK);
    EXPECT_EQ(c.read(), CB_TRANSFER_FAILED);
    EXPECT_EQ(c.rtu.serial.disconnects, 1u);
    EXPECT_GE(c.rtu.counters.not_connected, 1u);
    for (int i = 0; i < 10; ++i) c.read();  // returns at once, and does not try each time
    EXPECT_LE(c.rtu.serial.failures, 8u);
    plc.plug_in();
    cb_transfer got = CB_TRANSFER_FAILED;
    for (int i = 0; i < 300 && got != CB_TRANSFER_OK; ++i, sleep_ms(10)) got = c.read();
    EXPECT_EQ(got, CB_TRANSFER_OK);
    EXPECT_EQ(c.rtu.serial.connects, 2u);
}

TEST_F(rtu, a_device_that_is_not_there_is_no_reason_to_wait) {
    slave plc(behave);
    plc.unplug();
    client c(plc);
    const int64_t from_us = cb_boottime_us();
    EXPECT_EQ(c.read(5000), CB_TRANSFER_FAILED);
    EXPECT_LT(cb_boottime_us() - from_us, 100);
    EXPECT_EQ(c.rtu.serial.error_number, ENOENT);
}

// Two masters on one line would each take the other's replies for their own.
TEST_F(rtu, a_line_has_one_master) {
    slave plc(behave);
    const cb_serial_config config = config_of(plc);
    const cb_serial_opened first = cb_serial_open(&config);
    ASSERT_GE(first.fd, 0) << strerror(first.error);
    const cb_serial_opened second = cb_serial_open(&config);
    EXPECT_LT(second.fd, 0);
    EXPECT_EQ(second.error, EBUSY);
    EXPECT_STREQ(cb_serial_error(second.error), "another program has it open");
    cb_serial_shut(first.fd);
    const cb_serial_opened third = cb_serial_open(&config);
    ASSERT_GE(third.fd, 0) << strerror(third.error);
    cb_serial_shut(third.fd);
}

// The transmitter would stay off, or on.
TEST_F(rtu, a_driver_without_rs485_mode_is_refused_where_the_file_wants_it) {
    slave plc(behave);
    cb_serial_config config = config_of(plc);
    config.rs485 = true;
    const cb_serial_opened got = cb_serial_open(&config);
    EXPECT_LT(got.fd, 0);
    EXPECT_STREQ(cb_serial_error(got.error),
                 "its driver has no RS-485 mode: leave rs485 out, or use an adapter that switches "
                 "by itself");
}

TEST_F(rtu, something_else_than_a_serial_device_is_refused) {
    cb_serial_config config{};
    std::string("/dev/null").copy(config.device, sizeof config.device - 1);
    config.line = {115200, CB_PARITY_EVEN, 1};
    cb_rtu bus;
    cb_rtu_start_bus(&bus, &config, nullptr);
    EXPECT_LT(bus.serial.fd, 0);
    EXPECT_EQ(bus.serial.error_number, ENOTTY);
}

// A thread that opens the device, and a driver that takes until the test lets it.
std::atomic<bool> driver_hangs{false};
std::atomic<int> opening{0}, opened{0};

cb_serial_opened open_slowly(const cb_serial_config *config) {
    ++opening;
    while (driver_hangs) sleep_ms(1);
    ++opened;
    return cb_serial_open(config);
}

struct opener {
    cb_serial_opener thread;
    explicit opener(const slave &at) {
        const cb_serial_config config = config_of(at);
        EXPECT_EQ(cb_serial_opener_start(&thread, &config), 0);
        thread.open = open_slowly;
    }
    ~opener() {
        driver_hangs = false;
        cb_serial_opener_stop(&thread);
    }
};

TEST(rtu_opener, a_driver_that_hangs_keeps_nobody_waiting) {
    slave plc(behave);
    driver_hangs = true;
    opened = 0;
    opener helper(plc);
    client c(plc, &helper.thread);
    for (int i = 0; i < 20; ++i)
        EXPECT_EQ(c.read(5000), CB_TRANSFER_FAILED);  // would wait for ever
    EXPECT_EQ(opened, 0);
    EXPECT_EQ(c.rtu.counters.not_connected, 20u);
    EXPECT_EQ(c.rtu.serial.failures, 0u);
    driver_hangs = false;
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
    EXPECT_EQ(c.rtu.serial.connects, 1u);
}

TEST(rtu_opener, a_device_that_is_unplugged_again_and_again_is_opened_by_the_thread) {
    slave plc(behave);
    opener helper(plc);
    client c(plc, &helper.thread);
    for (uint32_t times = 1; times <= 4; ++times) {
        EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
        EXPECT_EQ(c.rtu.serial.connects, times);
        plc.unplug();
        for (int i = 0; i < 500 && c.rtu.serial.disconnects < times; ++i) c.read(20);
        EXPECT_EQ(c.rtu.serial.disconnects, times);
        EXPECT_LT(c.rtu.serial.fd, 0);
        for (int i = 0; i < 500 && c.rtu.serial.failures < times; ++i, sleep_ms(1)) c.read(20);
        EXPECT_EQ(c.rtu.serial.error_number, ENOENT);
        plc.plug_in();
    }
    EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
}

TEST(rtu_opener, a_device_that_was_not_there_leaves_nothing_to_close) {
    slave plc(behave);
    plc.unplug();
    opener helper(plc);
    ASSERT_TRUE(cb_serial_opener_request(&helper.thread));
    const auto is_done = [&] {
        return __atomic_load_n(&helper.thread.state, __ATOMIC_ACQUIRE) == CB_OPENER_DONE;
    };
    for (int i = 0; i < 2000 && !is_done(); ++i) sleep_ms(1);
    EXPECT_TRUE(is_done());
    EXPECT_EQ(helper.thread.opened.error, ENOENT);
}

// The end does not wait for it, and what it opens in the end is closed again.
TEST(rtu_opener, a_driver_that_hangs_is_left_behind) {
    static cb_serial_opener left;
    slave plc(behave);
    const cb_serial_config config = config_of(plc);
    driver_hangs = true;
    opening = opened = 0;
    ASSERT_EQ(cb_serial_opener_start(&left, &config), 0);
    left.open = open_slowly;
    ASSERT_TRUE(cb_serial_opener_request(&left));
    for (int i = 0; i < 2000 && opening == 0; ++i) sleep_ms(1);
    EXPECT_FALSE(cb_serial_opener_stop(&left));
    EXPECT_EQ(opened, 0);
    driver_hangs = false;
    for (int i = 0; i < 2000 && opened == 0; ++i) sleep_ms(1);
    EXPECT_EQ(opened, 1);
    sleep_ms(50);  // until the thread has closed it: what the next test counts
}

// The descriptor that nobody took is closed, and so is the one that was lost.
TEST(rtu_opener, no_descriptor_is_left_over) {
    const auto descriptors = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
    };
    slave plc(behave);
    const auto before = descriptors();
    for (int times = 0; times < 3; ++times) {
        opener helper(plc);
        client c(plc, &helper.thread);
        if (times == 0) continue;
        EXPECT_EQ(read_until_good(c), CB_TRANSFER_OK);
        if (times == 1) continue;
        plc.unplug();
        for (int i = 0; i < 500 && c.rtu.serial.disconnects == 0; ++i) c.read(20);
        plc.plug_in();
    }
    EXPECT_EQ(descriptors(), before);
}

}  // namespace
