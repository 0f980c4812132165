// SPDX-License-Identifier: MIT
// libmodbus beside the loop, against a server of raw sockets that misbehaves on purpose. The test
// is the loop: it runs cycles until what it waits for is there.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/raw_server.h"

extern "C" {
#include "hal/linux/clock.h"
#include "hal/linux/libmodbus.h"
}

namespace libmodbus_client {
namespace {

using raw_server::behave;
using raw_server::bytes;
using raw_server::peer;
using raw_server::server;
using raw_server::sleep_ms;
using raw_server::two_registers;
using raw_server::two_written;

constexpr uint32_t period_us = 20000;

// What one cycle of the loop was given.
struct cycle {
    cb_transfer read;
    cb_handed handed;
    uint16_t registers[2];
    int64_t at_us;
};

class loop {
  public:
    explicit loop(uint16_t port, cb_exchange exchange = CB_EXCHANGE_FC3_FC16,
                  uint32_t with_us = period_us) {
        cb_plc_config plc = {};
        std::strcpy(plc.host, "127.0.0.1");
        plc.port = port;
        plc.unit = 1;
        plc.exchange = exchange;
        EXPECT_EQ(cb_libmodbus_start(client.get(), &plc, with_us, &cb_no_hurry, shown.get()), 0);
    }
    ~loop() { stop(); }

    // out: whether the thread has ended within the client's patience. Where the machine stood still
    // it has not, and goes on to use what it was given.
    bool stop() {
        static auto &used_for_ever = *new std::vector<std::pair<cb_libmodbus *, cb_tcp *>>;
        if (std::exchange(stopped, true)) return true;
        const bool ended = cb_libmodbus_stop(client.get());
        if (!ended) used_for_ever.push_back({client.release(), shown.release()});
        return ended;
    }

    // in : writes: registers 100 and 101 are written, to the number of the cycle
    cycle run(bool writes = false) {
        cycle now = {};
        now.at_us = cb_boottime_us();
        now.read = cb_libmodbus_read(client.get(), 8, 2, now.registers);
        uint16_t held[2];
        if (reads_back) cb_libmodbus_read(client.get(), 100, 2, held);
        now.handed = cb_libmodbus_handed(client.get());
        if (at_handed) at_handed(now);
        const uint16_t block[2] = {++cycles, cycles};
        if (writes) cb_libmodbus_write(client.get(), 100, 2, block);
        cb_libmodbus_post(client.get(), cb_boottime_us() + due_us);
        sleep_ms(period_us / 1000);
        for (int i = 0; awaits && i < 100000 && !awaits(); ++i) sleep_ms(1);
        return now;
    }
    // Runs cycles until one is as wanted.
    template <typename condition>
    cycle until(bool writes, condition wanted) {
        for (int i = 0; i < 1000; ++i) {
            const cycle now = run(writes);
            if (wanted(now)) return now;
        }
        ADD_FAILURE() << "not within 1000 cycles";
        return {};
    }
    // out: what the client's thread has written there
    static uint32_t seen(const uint32_t &shared) {
        return __atomic_load_n(&shared, __ATOMIC_ACQUIRE);
    }
    cycle until_read() {
        return until(false, [](const cycle &c) { return c.read == CB_TRANSFER_OK; });
    }
    cycle until_fate(cb_transfer fate) {
        return until(true, [fate](const cycle &c) { return c.handed.write == fate; });
    }

    std::function<void(const cycle &)> at_handed;  // before the cycle posts
    std::function<bool()> awaits;                  // what the next cycle begins behind, if given
    int64_t due_us = period_us;                    // from the post to the next tick
    bool reads_back = false;
    std::unique_ptr<cb_libmodbus> client = std::make_unique<cb_libmodbus>();
    std::unique_ptr<cb_tcp> shown = std::make_unique<cb_tcp>();
    uint16_t cycles = 0;
    bool stopped = false;
};

// libmodbus waits by the clock of the machine. This client gives up no reply, however long the
// machine stands still. The fifth of its period until the next tick is what it needs for readings:
// it neither waits before them nor leaves a write out.
class patient_loop : public loop {
  public:
    explicit patient_loop(uint16_t port, cb_exchange exchange = CB_EXCHANGE_FC3_FC16)
        : loop(port, exchange, patient_us) {
        due_us = patient_us / 5;
    }

  private:
    static constexpr uint32_t patient_us = 500000000;
};

bytes reply_to(const bytes &request, uint8_t value = 7) {
    return request[7] == 3 ? two_registers(request, value) : two_written(request);
}

void serve(peer &p) {
    for (bytes r = p.request(); !r.empty(); r = p.request()) p.reply(reply_to(r));
}

TEST(libmodbus, a_reading_of_one_cycle_is_returned_in_the_next_with_the_time_of_its_request) {
    server plc(behave);
    patient_loop box(plc.port());
    const cycle first = box.run();
    EXPECT_EQ(first.read, CB_TRANSFER_FAILED) << "nothing was requested before";
    int64_t before_us = 0;
    const cycle found = box.until(false, [&](const cycle &c) {
        if (c.read == CB_TRANSFER_OK) return true;
        before_us = c.at_us;
        return false;
    });
    EXPECT_EQ(found.registers[1], found.registers[0] + 1);
    EXPECT_GT(found.handed.read_us, first.at_us);
    EXPECT_LT(found.handed.read_us, found.at_us);
    EXPECT_EQ(found.handed.write, CB_TRANSFER_NONE);
    EXPECT_EQ(box.shown->link.state, CB_LINK_UP);
    EXPECT_EQ(box.shown->link.connects, 1u);
}

TEST(libmodbus, each_reading_is_returned_once) {
    std::atomic<int> replies{0};
    std::atomic<bool> mute{false};
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            if (mute) continue;
            ++replies;
            p.reply(reply_to(r));
        }
    });
    loop box(plc.port());
    int returned = 0;
    int64_t read_us = 0;
    const auto run = [&] {
        const cycle now = box.run();
        if (now.read != CB_TRANSFER_OK) return;
        EXPECT_GT(now.handed.read_us, read_us);
        read_us = now.handed.read_us;
        ++returned;
    };
    while (returned < 3) run();
    mute = true;
    for (int i = 0; i < 5; ++i) run();
    EXPECT_LE(returned, replies);
}

TEST(libmodbus, a_write_is_reported_in_the_next_cycle_with_the_time_of_its_reply) {
    server plc(serve);
    loop box(plc.port());
    const cycle done = box.until_fate(CB_TRANSFER_OK);
    EXPECT_LT(done.handed.written_us, done.at_us);
    box.until(false, [&](const cycle &) { return box.shown->counters.replies >= 1; });
}

// Also the readings behind it, which wait for the end of the period, do not delay the report. With
// fc23 the read-back follows it.
TEST(libmodbus, a_write_is_reported_while_the_reading_behind_it_is_pending) {
    for (const cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        std::atomic<bool> reported{false};
        server plc([&](peer &p) {
            for (bytes r = p.request(); !r.empty(); r = p.request()) {
                while (r[7] == 3 && !reported) sleep_ms(1);
                p.reply(r[7] == 23 ? bytes{r[0], r[1], 0, 0, 0, 7, r[6], 23, 4, 0, 1, 0, 2}
                                   : reply_to(r));
            }
        });
        patient_loop box(plc.port(), exchange);
        box.reads_back = true;
        box.awaits = [&] { return box.seen(box.client->ended) != CB_TRANSFER_NONE; };
        const cycle done = box.until_fate(CB_TRANSFER_OK);
        EXPECT_NE(done.read, CB_TRANSFER_OK);
        reported = true;
        box.awaits = nullptr;
        box.until_read();
    }
}

// Each write carries the number of its cycle, so the server knows those that arrived.
TEST(libmodbus, without_a_reply_a_write_is_unknown_and_those_that_failed_never_arrive) {
    std::atomic<bool> mute{false}, muted{false};
    std::mutex mutex;
    std::set<int> arrived, failed;
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            if (r[7] == 16) {
                const std::lock_guard<std::mutex> lock(mutex);
                arrived.insert(r[13] * 256 + r[14]);
            }
            if (mute)
                muted = true;
            else
                p.reply(reply_to(r));
        }
    });
    loop box(plc.port());
    box.until_fate(CB_TRANSFER_OK);
    mute = true;
    box.at_handed = [&](const cycle &c) {
        if (c.handed.write == CB_TRANSFER_FAILED) failed.insert(box.cycles);
    };
    box.until_fate(CB_TRANSFER_UNKNOWN);
    box.until(true, [&](const cycle &) { return muted && box.shown->counters.blocked > 0; });
    mute = false;
    box.until_fate(CB_TRANSFER_OK);
    box.until(true, [&](const cycle &) { return box.shown->link.connects >= 2; });
    EXPECT_GE(box.shown->counters.timeouts, 1u);
    EXPECT_FALSE(failed.empty());
    const std::lock_guard<std::mutex> lock(mutex);
    for (const int number : failed) EXPECT_EQ(arrived.count(number), 0u) << number;
}

TEST(libmodbus, a_late_reply_is_not_taken_for_the_next_one) {
    std::atomic<int> readings{0};
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            const int number = ++readings;
            if (number == 3) p.gone();  // until the client gives up or, wrongly, asks again
            p.reply(two_registers(r, static_cast<uint8_t>(number)));
        }
    });
    loop box(plc.port());
    std::vector<uint16_t> values;
    while (values.size() < 6) values.push_back(box.until_read().registers[0]);
    for (size_t i = 1; i < values.size(); ++i) EXPECT_GT(values[i], values[i - 1]);
    EXPECT_EQ(std::count(values.begin(), values.end(), 3), 0);
    EXPECT_GE(plc.connections(), 2);
}

TEST(libmodbus, an_exception_refuses_the_request_and_keeps_the_connection) {
    server plc([](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            if (r[7] == 16)
                p.reply({r[0], r[1], 0, 0, 0, 3, r[6], 0x90, 6});
            else
                p.reply(two_registers(r, 1));
        }
    });
    patient_loop box(plc.port());
    box.until_fate(CB_TRANSFER_REFUSED);
    box.until_fate(CB_TRANSFER_REFUSED);
    EXPECT_EQ(box.shown->link.disconnects, 0u);
    EXPECT_GE(box.shown->counters.exceptions_by_code[6], 1u);
}

TEST(libmodbus, a_missing_function_is_shown_to_the_log) {
    server plc([](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request())
            p.reply({r[0], r[1], 0, 0, 0, 3, r[6], static_cast<uint8_t>(r[7] | 0x80), 1});
    });
    loop box(plc.port());
    box.until_fate(CB_TRANSFER_REFUSED);
    box.until(true,
              [&](const cycle &) { return (box.shown->peer.refused_functions & 1u << 16) != 0; });
}

TEST(libmodbus, a_closed_connection_is_made_again) {
    server plc([](peer &p) {
        for (int i = 0; i < 6; ++i) {
            const bytes r = p.request();
            if (r.empty()) return;
            p.reply(reply_to(r));
        }
    });
    loop box(plc.port());
    box.until(true, [&](const cycle &) { return plc.connections() >= 3; });
    box.until_fate(CB_TRANSFER_OK);
    box.until(true, [&](const cycle &) { return box.shown->counters.closed_by_peer >= 2; });
    EXPECT_GE(box.shown->link.disconnects, 2u);
}

TEST(libmodbus, garbage_costs_the_connection) {
    server plc([](peer &p) {
        const bytes r = p.request();
        if (p.number == 0)
            p.reply(bytes(13, 0x55));
        else if (!r.empty())
            p.reply(reply_to(r));
        serve(p);
    });
    loop box(plc.port());
    box.until_read();
    EXPECT_GE(plc.connections(), 2);
    EXPECT_GE(box.shown->counters.invalid_replies + box.shown->counters.timeouts, 1u);
}

TEST(libmodbus, with_fc23_a_write_and_a_reading_are_one_request) {
    std::atomic<int> combined{0}, others{0};
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            ++(r[7] == 23 ? combined : others);
            p.reply({r[0], r[1], 0, 0, 0, 7, r[6], r[7], 4, 0, 1, 0, 2});
        }
    });
    patient_loop box(plc.port(), CB_EXCHANGE_FC23);
    const cycle done = box.until_fate(CB_TRANSFER_OK);
    EXPECT_EQ(done.read, CB_TRANSFER_OK);
    EXPECT_EQ(done.registers[1], 2);
    EXPECT_EQ(others, 0);
}

TEST(libmodbus, without_a_server_nothing_is_sent_and_the_attempts_back_off) {
    uint16_t port = 0;
    {
        server gone(serve);
        port = gone.port();
    }
    loop box(port);
    box.until(true, [&](const cycle &c) {
        return c.handed.write == CB_TRANSFER_FAILED && box.shown->link.failures >= 2;
    });
    EXPECT_EQ(box.shown->link.error_number, ECONNREFUSED);
    EXPECT_GE(box.shown->link.backoff_us, 100000u) << "twice the first";
    EXPECT_GE(box.shown->counters.not_connected, box.shown->link.failures);
    server back(serve, port);
    box.until_fate(CB_TRANSFER_OK);
}

// The server sees the end of the stream, and no reset, behind the last write.
TEST(libmodbus, leaving_ends_the_stream_behind_the_pending_write) {
    std::atomic<ssize_t> end{-2};
    std::atomic<bool> left{false};
    server plc([&](peer &p) {
        if (p.number > 0) return serve(p);
        bytes r = p.request();
        while (!r.empty() && r[7] != 16) {
            p.reply(reply_to(r));
            r = p.request();
        }
        while (!left) sleep_ms(1);
        p.reply(two_written(r));
        char byte;
        end = recv(p.fd, &byte, 1, 0);
    });
    patient_loop box(plc.port());
    box.until_read();
    box.at_handed = [&](const cycle &c) {
        if (left || c.handed.write != CB_TRANSFER_UNKNOWN) return;
        cb_libmodbus_leave(box.client.get());
        left = true;
    };
    box.until_fate(CB_TRANSFER_UNKNOWN);
    box.until(false, [&](const cycle &) { return box.shown->link.connects >= 2; });
    EXPECT_EQ(end, 0);
    EXPECT_EQ(box.shown->link.cause, CB_LINK_CAUSE_LEFT);
}

// The connection with that write is lost by then. The next one has nothing to leave.
TEST(libmodbus, leaving_behind_a_connection_that_is_lost_keeps_the_next_one) {
    server plc([](peer &p) {
        if (p.number > 0) return serve(p);
        for (bytes r = p.request(); r[7] != 16; r = p.request()) p.reply(reply_to(r));
    });
    patient_loop box(plc.port());
    bool left = false;
    box.awaits = [&] { return box.seen(box.client->state) == CB_JOB_DONE; };
    box.at_handed = [&](const cycle &c) {
        if (left || c.handed.write != CB_TRANSFER_UNKNOWN || !box.client->fresh) return;
        cb_libmodbus_leave(box.client.get());
        left = true;
    };
    box.until(true, [&](const cycle &) { return left; });
    box.until_fate(CB_TRANSFER_OK);
    box.until_read();
    EXPECT_EQ(box.shown->link.connects, 2u);
    EXPECT_EQ(box.shown->link.cause, CB_LINK_CAUSE_PEER);
}

// A PLC that ends the stream and then resets it: the next request has no receiver.
TEST(libmodbus, a_connection_that_was_ended_and_reset_is_closed_by_the_peer) {
    server plc([](peer &p) {
        if (p.number > 0) return serve(p);
        p.reply(reply_to(p.request()));
        shutdown(p.fd, SHUT_WR);
        const linger discard = {1, 0};
        setsockopt(p.fd, SOL_SOCKET, SO_LINGER, &discard, sizeof discard);
        dup2(open("/dev/null", O_RDWR), p.fd);  // closes it at once
    });
    patient_loop box(plc.port());
    box.until(false, [&](const cycle &) { return box.shown->link.connects >= 2; });
    EXPECT_EQ(box.shown->counters.closed_by_peer, 1u);
    EXPECT_EQ(box.shown->counters.socket_errors, 0u);
}

// What it still sends, and a pause before it closes, are no reason to reset it.
// The client listens for a second. Where the machine stood still for as long, it rightly ends with
// a reset, and the exchange is made again.
TEST(libmodbus, at_the_end_a_plc_that_still_sends_is_listened_to_until_it_closes) {
    constexpr std::int64_t listens_us = 1000000;
    std::atomic<std::int64_t> left_us{0}, took_us{0};
    std::atomic<ssize_t> end{-2};
    do {
        server plc([&](peer &p) {
            for (bytes r = p.request(); !r.empty(); r = p.request()) p.reply(reply_to(r));
            p.reply(bytes(2000, 0x55));
            sleep_ms(250);
            p.reply(bytes(10, 0x55));
            char byte;
            end = recv(p.fd, &byte, 1, 0);
            took_us = cb_boottime_us() - left_us;
        });
        patient_loop box(plc.port());
        box.until_read();
        left_us = cb_boottime_us();
    } while (end != 0 && took_us >= listens_us);
    EXPECT_EQ(end, 0) << "no reset";
}

// A machine that stands still for the client's patience may keep the thread from its end, so it may
// take more than one attempt.
TEST(libmodbus, the_thread_ends_when_it_is_stopped) {
    server plc(serve);
    bool ended = false;
    for (int i = 0; i < 20 && !ended; ++i) {
        patient_loop box(plc.port());
        box.until_fate(CB_TRANSFER_OK);
        ended = box.stop();
    }
    EXPECT_TRUE(ended);
}

TEST(libmodbus, with_fc23_a_write_without_a_reading_is_a_write) {
    std::atomic<int> writes{0};
    server plc([&](peer &p) {
        for (bytes r = p.request(); !r.empty(); r = p.request()) {
            writes += r[7] == 16;
            p.reply(reply_to(r));
        }
    });
    loop box(plc.port(), CB_EXCHANGE_FC23);
    const uint16_t block[2] = {1, 2};
    for (int i = 0; i < 1000 && writes == 0; ++i) {
        (void)cb_libmodbus_handed(box.client.get());
        cb_libmodbus_write(box.client.get(), 100, 2, block);
        cb_libmodbus_post(box.client.get(), cb_boottime_us() + period_us);
        sleep_ms(period_us / 1000);
    }
    EXPECT_GT(writes, 0);
}

// A job has room for so many readings; each is known by its registers.
TEST(libmodbus, a_reading_beyond_the_room_of_a_job_is_none) {
    const auto client = std::make_unique<cb_libmodbus>();
    const auto shown = std::make_unique<cb_tcp>();
    client->shown = shown.get();
    client->job.reads[0] = {8, 2, CB_TRANSFER_OK, 0, {1, 2}};
    client->state = CB_JOB_DONE;  // as the thread leaves it
    uint16_t registers[2] = {0xEEEE, 0xEEEE};
    EXPECT_EQ(cb_libmodbus_read(client.get(), 8, 1, registers), CB_TRANSFER_FAILED)
        << "it has the start of the last one, not its number";
    for (unsigned i = 1; i < CB_JOB_READS; ++i)
        EXPECT_EQ(cb_libmodbus_read(client.get(), static_cast<uint16_t>(20 + i), 2, registers),
                  CB_TRANSFER_NONE);
    EXPECT_EQ(cb_libmodbus_read(client.get(), 60, 2, registers), CB_TRANSFER_NONE);
    EXPECT_EQ(registers[0], 0xEEEE);
    for (unsigned i = 0; i < CB_JOB_READS; ++i)
        EXPECT_NE(client->next.reads[i].start, 60) << "there is no room";
    EXPECT_EQ(cb_libmodbus_read(client.get(), 8, 2, registers), CB_TRANSFER_OK);
    EXPECT_EQ(registers[1], 2);
}

// A job that the thread has not begun is taken back, so its write certainly has no effect.
TEST(libmodbus, a_write_that_was_not_begun_is_withdrawn) {
    auto client = std::make_unique<cb_libmodbus>();
    std::memset(client.get(), 0, sizeof *client);
    sem_init(&client->wake, 0, 0);
    const uint16_t block[2] = {1, 2};
    uint16_t registers[2];
    cb_libmodbus_write(client.get(), 100, 2, block);
    cb_libmodbus_post(client.get(), 0);
    EXPECT_EQ(client->state, static_cast<uint32_t>(CB_JOB_POSTED));
    EXPECT_EQ(cb_libmodbus_read(client.get(), 8, 2, registers), CB_TRANSFER_FAILED);
    EXPECT_EQ(cb_libmodbus_handed(client.get()).write, CB_TRANSFER_FAILED);
    EXPECT_EQ(client->state, static_cast<uint32_t>(CB_JOB_IDLE));
    sem_destroy(&client->wake);
}

// A connect may take longer than the cycle. Outputs of an earlier cycle are not sent after it, with
// either exchange; the reading is.
TEST(libmodbus, a_write_is_not_sent_after_the_next_tick) {
    for (const cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        std::atomic<int> writes{0}, readings{0};
        server plc([&](peer &p) {
            for (bytes r = p.request(); !r.empty(); r = p.request()) {
                ++(r[7] == 3 ? readings : writes);
                p.reply(r[7] == 23 ? bytes{r[0], r[1], 0, 0, 0, 7, r[6], 23, 4, 0, 1, 0, 2}
                                   : reply_to(r));
            }
        });
        loop box(plc.port(), exchange);
        box.due_us = 0;
        box.until(true, [](const cycle &c) { return c.read == CB_TRANSFER_OK; });
        EXPECT_EQ(writes, 0);
        EXPECT_GT(readings, 0);
        box.due_us = period_us;
        box.until_fate(CB_TRANSFER_OK);
        EXPECT_GT(writes, 0);
    }
}

// A read-back that was not requested in the cycle before counts as no request.
TEST(libmodbus, a_second_reading_is_none_until_it_was_requested) {
    server plc(serve);
    loop box(plc.port());
    box.until_read();
    uint16_t held[2];
    cb_transfer first = CB_TRANSFER_OK, second = CB_TRANSFER_NONE;
    for (int i = 0; i < 1000 && second != CB_TRANSFER_OK; ++i) {
        uint16_t registers[2];
        cb_libmodbus_read(box.client.get(), 8, 2, registers);
        second = cb_libmodbus_read(box.client.get(), 100, 2, held);
        if (i == 0) first = second;
        cb_libmodbus_post(box.client.get(), cb_boottime_us() + period_us);
        sleep_ms(period_us / 1000);
    }
    EXPECT_EQ(first, CB_TRANSFER_NONE);
    EXPECT_EQ(held[0], 7);
}

}  // namespace
}  // namespace libmodbus_client
