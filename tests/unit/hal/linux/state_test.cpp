// SPDX-License-Identifier: MIT
// What outlives a run in a file: lags, by a clock that is known to be right; how the run ended; the
// PLC's heartbeat. What is not used.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iterator>

#include "tests/support/bank_rig.h"
#include "tests/support/box_fixture.h"
#include "tests/support/probe_rig.h"
#include "tests/support/short_reads.h"
#include "tests/support/temporary.h"

extern "C" {
#include "firmware/base/crc32.h"
#include "hal/linux/files/state.h"
}

std::size_t short_reads::most = SIZE_MAX;
std::size_t short_reads::left = SIZE_MAX;

// In place of the C library's.
extern "C" ssize_t read(int fd, void *to, size_t count) {
    const ssize_t got =
        syscall(SYS_read, fd, to, std::min({count, short_reads::most, short_reads::left}));
    if (got > 0 && short_reads::left != SIZE_MAX)
        short_reads::left -= static_cast<std::size_t>(got);
    return got;
}

namespace compbox {
namespace {

constexpr int64_t second = 1000000;

// Thermometer T with a fast and a slow lag, and a lag of the square of the slow one.
config_builder lags() {
    config_builder b;
    std::strcpy(b.config->machine, "mill");
    b.position("X", 8);
    const unsigned t = b.thermometer("T");
    const auto lag = [&](const char *name, unsigned of, float tau_s, uint8_t power) {
        cb_signal_config &s = b.signal(name, "degC", CB_SOURCE_LAG, CB_NUMBER_INT16, 0);
        s.lag_of = static_cast<uint8_t>(of);
        s.tau_s = tau_s;
        s.power = power;
        s.min = -10;
        s.max = 9000;
        s.max_age_ms = 2000;
        b.config->lags[b.config->lags_count++] = static_cast<uint8_t>(b.config->signals_count - 1);
    };
    lag("fast", t, 60, 1);
    lag("slow", t, 7200, 1);
    lag("square", t + 2, 7200, 2);
    return b;
}

struct state_file : testing::Test {
    std::string path = compbox_test::temporary("lags.state");
    cb_state state{};
    char message[512] = "";

    ~state_file() override { std::remove(path.c_str()); }

    // A box that ran through a warm-up of 20 minutes.
    static box_rig warm() {
        box_rig rig(lags());
        for (int i = 0; i < 1200; ++i) {
            rig.position(8, 100);
            rig.sample(1, i < 10 ? 200.0f : 350.0f);
            rig.step(second);
        }
        return rig;
    }
    static cb_state_clock clock(int64_t boottime_us, int64_t unix_us, const char *boot,
                                bool synchronised = true) {
        cb_state_clock clock{boottime_us, unix_us, synchronised, ""};
        std::strcpy(clock.boot_id, boot);
        return clock;
    }
    int write(const box_rig &rig, const cb_state_clock &now, const char *to) {
        cb_state taken;
        cb_state_take(&taken, rig.box.get());
        return cb_state_write(&taken, &rig.box->config, to, &now);
    }
    void save(const box_rig &rig, int64_t unix_us, bool synchronised = true) {
        ASSERT_EQ(write(rig, clock(rig.now_us, unix_us, "boot", synchronised), path.c_str()), 0);
    }
    // Warms two lags of T2, of which the first acts within the lower range.
    void save_apart(bank_rig &rig) {
        rig.t2 = 20;
        for (int i = 0; i < 10; ++i) rig.go();
        rig.t2 = 35;
        for (int i = 0; i < 10000; ++i) rig.go();
        ASSERT_GT(rig.box->bank.lags[1].hi, rig.box->bank.lags[0].hi + 1);
        save(rig, 1000 * second);
    }
    bool read_at(const cb_config &config, const cb_state_clock &now) {
        return cb_state_read(&state, &config, path.c_str(), &now, message, sizeof message);
    }
    // After another boot, whose wall clock is right.
    bool read(const cb_config &config, int64_t boottime_us, int64_t unix_us) {
        return read_at(config, clock(boottime_us, unix_us, "another boot"));
    }
    unsigned settled() const {
        unsigned count = 0;
        for (const cb_lag_state &lag : state.lags) count += lag.settled;
        return count;
    }
    bool reports(const std::string &words) const {
        return std::string(message).find(words) != std::string::npos;
    }
    std::string bytes() {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    void put(const std::string &text) { std::ofstream(path, std::ios::binary) << text; }
    // in : text, whose last four bytes become the CRC of those before
    void put_with_crc(std::string text) {
        const uint32_t crc = cb_crc32(0, text.data(), static_cast<uint32_t>(text.size() - 4));
        std::memcpy(&text[text.size() - 4], &crc, sizeof crc);
        put(text);
    }
};

// b, g and their uncertainty go on, also after a pause of unknown length; the count is a reference
// again.
TEST_F(state_file, has_what_probes_adapted) {
    probe_rig rig;
    rig.touch(43);
    const cb_adapt before = rig.state().filter;
    save(rig, 1000 * second);
    cb_adapt grown = before;
    for (const int64_t pause_s : {60, 3600, 7 * 24 * 3600}) {
        const bool known = pause_s <= 3600;
        ASSERT_TRUE(read_at(rig.box->config,
                            clock(3 * second, (1000 + pause_s) * second, "another boot", known)));
        probe_rig again;
        cb_box_start(again.box.get());
        again.now_us = 3 * second;
        again.control(2);
        again.out = {};
        cb_state_give(&state, again.box.get());
        EXPECT_EQ(again.state().filter.bias_um, before.bias_um);
        again.in.registers[14] = again.count = 9;
        again.step();
        EXPECT_NEAR(again.y(), 23, 0.2);
        EXPECT_EQ(again.state().taken, 1u);
        again.step();
        again.probe(43);  // in STANDBY with zero outputs
        EXPECT_EQ(again.state().taken, 2u);
        grown = before;
        cb_adapt_wait(&rig.box->config.terms[2].as.adapt.settings, &grown,
                      static_cast<float>(pause_s) / 3600);
        const float s = cb_adapt_sigma(&grown, 20, nullptr);
        EXPECT_NEAR(again.state().filter.expected_um, std::sqrt(s * s + 1.5f * 1.5f), 0.02f * s)
            << pause_s;
    }
    const std::string other_model = adapted_file({{"\"name\": \"thermal\"", "\"name\": \"other\""},
                                                  {"\"of\": \"thermal\"", "\"of\": \"other\""}});
    probe_rig other(other_model);
    ASSERT_TRUE(read(other.box->config, 3 * second, 1060 * second));
    EXPECT_FALSE(state.probes[0].timed);
}

TEST_F(state_file, without_probes_is_that_of_the_version_before) {
    save(warm(), 1000 * second);
    EXPECT_EQ(bytes()[8], 3);
    probe_rig rig;
    save(rig, 1000 * second);
    EXPECT_EQ(bytes()[8], 4);
    const std::string good = bytes();
    constexpr size_t header = 104, probe = 160;
    const auto with_probes = [&](unsigned number, size_t more) {
        std::string other = good;
        other[100] = static_cast<char>(number);
        other.insert(header, more, '\0');
        put_with_crc(other);
        return read(rig.box->config, 3 * second, 1060 * second);
    };
    EXPECT_TRUE(with_probes(1, 0)) << message;
    EXPECT_FALSE(with_probes(2, 0));
    EXPECT_TRUE(reports("has the wrong length")) << message;
    EXPECT_TRUE(with_probes(CB_MAX_ADAPTS, (CB_MAX_ADAPTS - 1) * probe)) << message;
    EXPECT_FALSE(with_probes(CB_MAX_ADAPTS + 1, CB_MAX_ADAPTS * probe));
    EXPECT_TRUE(reports("has the wrong length")) << message;
}

TEST_F(state_file, with_a_time_of_a_probe_that_no_clock_shows_begins_it_anew) {
    probe_rig rig;
    rig.touch(43);
    save(rig, 1000 * second);
    const std::string good = bytes();
    constexpr size_t header = 104, unix_us = header + 48, boottime_us = header + 56;
    for (const int64_t time_us : {INT64_MIN, int64_t{-1}, INT64_MAX}) {
        for (const size_t at : {unix_us, boottime_us}) {
            std::string bad = good;
            std::memcpy(&bad[at], &time_us, sizeof time_us);
            put_with_crc(bad);
            ASSERT_TRUE(read(rig.box->config, 3 * second, 1060 * second)) << message;
            const bool is_before_the_boot = at == boottime_us && time_us == -1;
            EXPECT_EQ(state.probes[0].timed, is_before_the_boot) << time_us;
        }
    }
    put(good);
    ASSERT_TRUE(read(rig.box->config, 3 * second, 1060 * second)) << message;
    EXPECT_TRUE(state.probes[0].timed);
}

const std::string warm_bank =
    R"({"name": "banked", "type": "linear", "bank": {"inputs": ["T2", "rpm"],
 "powers": {"rpm": [1, 2]}, "tau_s": [0, 60, 3600], "weights": [[1, 2, 3, 4, 5, 6, 0.7, 0.8, 0.9]]}})";

// Half a minute of pause: the lags of 60 s start steady, those of an hour go on.
TEST_F(state_file, has_the_lags_of_banks) {
    bank_rig rig(warm_bank);
    rig.t2 = 20;
    for (int i = 0; i < 10; ++i) rig.go();
    rig.t2 = 35;
    rig.rpm = -200;
    for (int i = 0; i < 10000; ++i) rig.go();
    save(rig, 1000 * second);
    bank_rig again(warm_bank);
    again.now_us = 3 * second;
    ASSERT_TRUE(read(again.box->config, again.now_us, 1030 * second)) << message;
    EXPECT_TRUE(reports("3 of 6 lags go on after a pause of 30.0 s")) << message;
    cb_state_give(&state, again.box.get());
    again.t2 = rig.t2;
    again.rpm = rig.rpm;
    again.go();
    rig.box->life.now_us += 30 * second;  // a pause without a clock jump
    rig.now_us += 30 * second;
    rig.go();
    for (unsigned lag = 0; lag < 6; ++lag) {
        const auto key = cb_bank_key_of(&again.box->config, lag);
        const auto own = again.box->bank.lags[lag];
        if (key.tau_s == 60) {
            EXPECT_EQ(own.hi, key.signal == AT_T2 ? 35 : std::pow(-200, key.power)) << lag;
        } else {
            EXPECT_EQ(cb_bits_of(own.hi), cb_bits_of(rig.box->bank.lags[lag].hi)) << lag;
        }
    }
    EXPECT_LT(again.box->bank.lags[1].hi, 30) << "35 only after hours";
}

// Two banks of one input, of which one was trained up to 24 degC.
TEST_F(state_file, keeps_lags_of_two_ranges_apart) {
    const std::string banks = R"({"name": "held", "type": "linear", "bank": {"inputs": ["T2"],
 "input_min": [10], "input_max": [24], "tau_s": [600], "weights": [[1]]}},
 {"name": "banked", "type": "linear", "bank": {"inputs": ["T2"], "tau_s": [600], "weights": [[1]]}})";
    bank_rig rig(banks);
    save_apart(rig);
    ASSERT_TRUE(read(rig.box->config, 3 * second, 1030 * second)) << message;
    for (unsigned lag = 0; lag < 2; ++lag)
        EXPECT_EQ(state.bank.lags[lag].hi, rig.box->bank.lags[lag].hi) << lag;
}

TEST_F(state_file, has_the_first_of_other_ranges_for_a_lag_whose_range_is_new) {
    const auto bank = [](const std::string &name, int to) {
        return R"({"name": ")" + name + R"(", "type": "linear", "bank": {"inputs": ["T2"],
 "input_min": [10], "input_max": [)" +
               std::to_string(to) + R"(], "tau_s": [600], "weights": [[1]]}})";
    };
    bank_rig rig(bank("low", 24) + ",\n" + bank("banked", 30));
    save_apart(rig);
    const bank_rig again(bank("banked", 27));
    ASSERT_TRUE(read(again.box->config, 3 * second, 1030 * second)) << message;
    EXPECT_EQ(state.bank.lags[0].hi, rig.box->bank.lags[0].hi);
}

TEST_F(state_file, another_power_or_time_constant_of_a_bank_starts_steady) {
    bank_rig rig(warm_bank);
    for (int i = 0; i < 10; ++i) rig.go();
    save(rig, 1000 * second);
    const auto resumed = [&](const std::string &piece, const std::string &other) {
        std::string term = warm_bank;
        term.replace(term.find(piece), piece.size(), other);
        const bank_rig again(term);
        EXPECT_TRUE(read(again.box->config, 3 * second, 1001 * second));
        return std::string(message);
    };
    EXPECT_NE(resumed("3600]", "3600]").find("6 of 6 lags"), std::string::npos);
    EXPECT_NE(resumed("3600]", "3601]").find("3 of 6 lags"), std::string::npos);
    EXPECT_NE(resumed("[1, 2]", "[1, 3]").find("4 of 6 lags"), std::string::npos);
    EXPECT_NE(resumed("\"T2\"", "\"T1\"").find("4 of 6 lags"), std::string::npos);
}

TEST_F(state_file, a_short_pause_is_bridged_as_if_the_box_had_run) {
    box_rig rig = warm();
    save(rig, 1000 * second);
    box_rig again(lags());
    again.now_us = 3 * second;  // the machine was booted meanwhile
    ASSERT_TRUE(read(again.box->config, again.now_us, 1010 * second)) << message;
    EXPECT_NE(std::string(message).find("3 of 3 lags go on after a pause of 11.0 s"),
              std::string::npos)
        << message;
    cb_state_give(&state, again.box.get());
    again.position(8, 100);
    again.sample(1, 350);  // 10 s after the last value by the wall clock
    again.box->life.now_us = 0;
    again.now_us -= 30000;
    again.in.samples[0].time_us = again.now_us + 30000;
    again.step();
    rig.position(8, 100);
    rig.in.sample_count = 0;
    rig.now_us += 10 * second - 30000;
    rig.sample(1, 350);
    rig.in.samples[0].time_us = rig.now_us + 30000;
    rig.step();
    for (unsigned i = 2; i < 5; ++i) {
        EXPECT_TRUE(again.box->signals[i].fresh) << i;
        EXPECT_NEAR(again.box->signals[i].value, rig.box->signals[i].value,
                    2e-6 * std::fabs(rig.box->signals[i].value))
            << i;
        EXPECT_LE(again.box->signals[i].value, i == 4 ? 1225 : 35.0f);
    }
}

// The power fails twice, and between them no thermometer and no probe gave a value: by the clock of
// the second boot the lags and the probe are from before it.
TEST_F(state_file, outlives_a_run_that_has_measured_nothing) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    box_rig between(lags());
    between.now_us = 3 * second;
    ASSERT_TRUE(read(between.box->config, between.now_us, 1010 * second)) << message;
    cb_state_give(&state, between.box.get());
    save(between, 1010 * second);
    ASSERT_TRUE(read(rig.box->config, 2 * second, 1013 * second)) << message;
    EXPECT_TRUE(reports("3 of 3 lags go on after a pause of 14.0 s")) << message;

    probe_rig touched;
    touched.touch(43);
    save(touched, 1000 * second);
    probe_rig untouched;
    cb_box_start(untouched.box.get());
    untouched.now_us = 3 * second;
    ASSERT_TRUE(read(untouched.box->config, untouched.now_us, 5000 * second)) << message;
    cb_state_give(&state, untouched.box.get());
    save(untouched, 5000 * second);
    ASSERT_TRUE(read(touched.box->config, 2 * second, 5010 * second)) << message;
    ASSERT_TRUE(state.probes[0].timed);
    EXPECT_EQ(state.probes[0].filter.bias_um, touched.state().filter.bias_um);
}

// A board without a clock restores its wall clock from a file: a stop of 60 h looks like 12 s.
TEST_F(state_file, a_pause_by_a_wall_clock_that_is_not_synchronised_is_unknown) {
    const box_rig rig = warm();
    for (const bool then : {false, true}) {
        save(rig, 1000 * second, then);
        ASSERT_TRUE(
            read_at(rig.box->config, clock(3 * second, 1012 * second, "another boot", !then)));
        EXPECT_EQ(settled(), 0u);
        EXPECT_TRUE(reports(then ? "is not synchronised" : "was not synchronised")) << message;
        EXPECT_TRUE(reports("lags start steady")) << message;
    }
    save(rig, 1000 * second, false);
    ASSERT_TRUE(read_at(rig.box->config, clock(3 * second, 1012 * second, "another boot", false)));
    EXPECT_EQ(settled(), 0u);
}

TEST_F(state_file, within_one_boot_the_wall_clock_does_not_count) {
    const box_rig rig = warm();
    for (const int64_t unix_us : {int64_t{0}, 1000 * second, 400000 * second}) {
        save(rig, 1000 * second, false);
        ASSERT_TRUE(
            read_at(rig.box->config, clock(rig.now_us + 9 * second, unix_us, "boot", false)));
        EXPECT_EQ(settled(), 3u) << message;
        EXPECT_TRUE(reports("after a pause of 10.0 s")) << message;
        EXPECT_EQ(state.lags[3].time_us, rig.box->signals[3].time_us);
        ASSERT_TRUE(
            read_at(rig.box->config, clock(rig.now_us + 9000 * second, unix_us, "boot", true)));
        EXPECT_EQ(settled(), 0u) << "a long stop that the wall clock does not show";
    }
}

// The kernel writes the bytes up to the limit, and names the fault when the rest is written.
TEST_F(state_file, a_short_write_goes_on_with_the_rest) {
    box_rig rig(lags());
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit little{50, before.rlim_max};
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
    const int error = write(rig, clock(rig.now_us, 1, "boot", true), path.c_str());
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(error, EFBIG);
}

TEST_F(state_file, a_boot_without_an_id_is_another_one) {
    const box_rig rig = warm();
    ASSERT_EQ(write(rig, clock(rig.now_us, 1000 * second, "", false), path.c_str()), 0);
    ASSERT_TRUE(read_at(rig.box->config, clock(rig.now_us + second, 1001 * second, "", true)));
    EXPECT_EQ(settled(), 0u);
    EXPECT_TRUE(reports("unknown")) << message;
}

// A part would be damaged: lags would start steady.
TEST_F(state_file, that_comes_in_parts_is_whole) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    short_reads::most = 100;
    EXPECT_TRUE(read(rig.box->config, 3 * second, 1001 * second)) << message;
    short_reads::most = SIZE_MAX;
    EXPECT_EQ(settled(), 3u) << message;
}

// A part of the id is that of no boot: the pause would be measured by the wall clock.
TEST_F(state_file, a_boot_id_that_comes_in_parts_is_whole) {
    cb_state_clock at_once, in_parts;
    cb_state_clock_read(&at_once);
    short_reads::most = 7;
    cb_state_clock_read(&in_parts);
    short_reads::most = SIZE_MAX;
    EXPECT_STREQ(in_parts.boot_id, at_once.boot_id);
}

TEST_F(state_file, a_boot_id_without_its_end_is_none) {
    for (const std::size_t length : {0u, 7u, 36u}) {
        cb_state_clock clock;
        short_reads::left = length;
        cb_state_clock_read(&clock);
        short_reads::left = SIZE_MAX;
        EXPECT_STREQ(clock.boot_id, "") << length;
    }
}

TEST_F(state_file, the_kernels_clocks_are_read) {
    cb_state_clock now, later;
    cb_state_clock_read(&now);
    cb_state_clock_read(&later);
    EXPECT_EQ(std::string(now.boot_id).size(), 36u);
    EXPECT_STREQ(now.boot_id, later.boot_id);
    EXPECT_LE(now.boottime_us, later.boottime_us);
    EXPECT_GT(now.unix_us, 0);
}

// A box at a PLC, for some cycles.
box_rig at_work() {
    box_rig rig(lags());
    for (int i = 0; i < 20; ++i) {
        rig.position(8, 100);
        rig.sample(1, 350);
        rig.step();
    }
    return rig;
}

TEST_F(state_file, a_run_that_goes_on_has_not_ended_stopped) {
    const box_rig rig = at_work();
    ASSERT_TRUE(rig.box->life.wrote);
    EXPECT_FALSE(cb_state_ended_stopped(rig.box.get()));
    save(rig, 1000 * second);
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 1001 * second));
    EXPECT_FALSE(state.stopped);
    EXPECT_TRUE(reports("; the previous run did not end STOPPED")) << message;
}

TEST_F(state_file, a_run_that_the_plc_confirmed_stopped_is_known_to_the_next) {
    box_rig rig = at_work();
    rig.in.stop = true;
    for (int i = 0; i < 2000 && !rig.out.stopped; ++i) {
        EXPECT_FALSE(cb_state_ended_stopped(rig.box.get())) << i;
        rig.step();
    }
    ASSERT_TRUE(rig.out.stopped);
    cb_state taken;
    cb_state_take(&taken, rig.box.get());
    taken.stopped = cb_state_ended_stopped(rig.box.get());
    const cb_state_clock then = clock(rig.now_us, 1000 * second, "boot", false);
    ASSERT_EQ(cb_state_write(&taken, &rig.box->config, path.c_str(), &then), 0);
    for (const bool synchronised : {false, true}) {  // however long ago that was
        ASSERT_TRUE(
            read_at(rig.box->config, clock(second, 400000 * second, "another boot", synchronised)));
        EXPECT_TRUE(state.stopped);
        EXPECT_TRUE(reports("; the previous run ended STOPPED")) << message;
    }
    box_rig again(lags());
    cb_state_give(&state, again.box.get());
    EXPECT_TRUE(again.box->life.stopped_before);
    EXPECT_TRUE(cb_state_ended_stopped(again.box.get())) << "it wrote nothing: the PLC has STOPPED";
}

TEST_F(state_file, a_machine_without_lags_keeps_it_too) {
    config_builder b;
    std::strcpy(b.config->machine, "mill");
    b.position("X", 8);
    box_rig rig(b);
    cb_state taken;
    cb_state_take(&taken, rig.box.get());
    taken.stopped = true;
    const cb_state_clock now = clock(second, 1000 * second, "boot");
    ASSERT_EQ(cb_state_write(&taken, &rig.box->config, path.c_str(), &now), 0);
    ASSERT_TRUE(read_at(rig.box->config, now));
    EXPECT_TRUE(state.stopped);
    EXPECT_STREQ(message, (path + ": no lags; the previous run ended STOPPED").c_str());
}

// A heartbeat that went back is that of a PLC that has restarted, while 16 bits can show it.
TEST_F(state_file, the_plcs_heartbeat_outlives_a_short_pause_alone) {
    const box_rig rig = at_work();
    ASSERT_TRUE(rig.box->plc.beat);
    save(rig, 1000 * second);
    const int64_t read_us = rig.box->plc.read_us;
    const auto given = [&](const cb_state_clock &now) {
        EXPECT_TRUE(read_at(rig.box->config, now)) << message;
        box_rig again(lags());
        cb_state_give(&state, again.box.get());
        EXPECT_EQ(again.box->plc.beat, state.beat);
        if (!state.beat) return false;
        EXPECT_EQ(again.box->plc.plc_heartbeat, rig.box->plc.plc_heartbeat);
        EXPECT_FALSE(again.box->plc.readable);
        return true;
    };
    EXPECT_TRUE(given(clock(read_us + CB_STATE_BEAT_US, 0, "boot", false)));
    EXPECT_EQ(state.beat_us, read_us);
    EXPECT_FALSE(given(clock(read_us + CB_STATE_BEAT_US + 1, 0, "boot", false)));
    EXPECT_FALSE(given(clock(read_us - 1, 0, "boot", false))) << "from the future";
    EXPECT_TRUE(given(clock(second, 1010 * second, "another boot", true)));
    EXPECT_FALSE(given(clock(second, 1010 * second, "another boot", false))) << "pause unknown";
    EXPECT_FALSE(given(clock(second, 1040 * second, "another boot", true)));
}

// One whose heartbeat went on has not.
TEST_F(state_file, a_plc_that_restarted_during_the_pause_is_noticed) {
    for (const bool restarted : {false, true}) {
        box_rig before = at_work();
        save(before, 1000 * second);
        box_rig rig(lags());
        rig.now_us = before.now_us + second;
        ASSERT_TRUE(read_at(rig.box->config, clock(rig.now_us, 0, "boot", false))) << message;
        cb_state_give(&state, rig.box.get());
        rig.heartbeat =
            static_cast<uint16_t>(before.box->plc.plc_heartbeat + (restarted ? -20 : 20));
        rig.in.held = CB_TRANSFER_UNKNOWN;  // a contact would use it up
        rig.step();
        EXPECT_EQ(rig.box->plc.went_back, restarted);
    }
}

// Format 2 ended after the lags: they go on, and nothing is known of how the run ended.
TEST_F(state_file, a_file_of_the_version_before_counts_as_not_stopped) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    std::string old = bytes();
    old.resize(old.size() - 4 - 32);
    old[8] = 2;
    const uint32_t crc = cb_crc32(0, old.data(), static_cast<uint32_t>(old.size()));
    old.append(reinterpret_cast<const char *>(&crc), sizeof crc);
    put(old);
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 1001 * second)) << message;
    EXPECT_EQ(settled(), 3u);
    EXPECT_FALSE(state.stopped || state.beat);
    EXPECT_TRUE(reports("did not end STOPPED")) << message;
}

// Format 1 had the wall clock alone and did not say how good it was.
TEST_F(state_file, a_file_of_the_first_version_is_refused) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    std::string old = bytes();
    old[8] = 1;
    put(old);
    EXPECT_FALSE(read(rig.box->config, rig.now_us, 1001 * second));
    EXPECT_TRUE(reports("is of another version and is not used; lags start steady")) << message;
    EXPECT_EQ(settled(), 0u);
}

TEST_F(state_file, each_lag_is_judged_by_its_own_time_constant) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 1016 * second));
    EXPECT_FALSE(state.lags[2].settled) << "16 s are more than a quarter of 60 s";
    EXPECT_TRUE(state.lags[3].settled);
    EXPECT_NE(std::string(message).find("2 of 3"), std::string::npos) << message;
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 2801 * second));
    EXPECT_FALSE(state.lags[3].settled);
    EXPECT_NE(std::string(message).find("0 of 3"), std::string::npos) << message;
}

TEST_F(state_file, a_lag_that_is_another_one_now_starts_steady) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    config_builder other = lags();
    other.config->signals[2].tau_s = 61;
    other.config->signals[4].power = 1;
    std::strcpy(other.config->signals[3].name, "slower");
    ASSERT_TRUE(read(*other.config, rig.now_us, 1001 * second));
    for (unsigned i = 0; i < CB_MAX_SIGNALS; ++i) EXPECT_FALSE(state.lags[i].settled) << i;
}

TEST_F(state_file, what_is_no_good_is_reported_and_not_used) {
    const box_rig rig = warm();
    const cb_config &config = rig.box->config;
    const auto refused = [&](const std::string &why) {
        EXPECT_FALSE(read(config, rig.now_us, 1001 * second));
        EXPECT_NE(std::string(message).find(why), std::string::npos) << message;
        for (const cb_lag_state &lag : state.lags) EXPECT_FALSE(lag.settled);
    };
    refused("is not there yet");
    save(rig, 1000 * second);
    const std::string good = bytes();
    for (size_t length = 0; length < good.size(); ++length) {
        put(good.substr(0, length));
        refused("lags start steady");
    }
    for (size_t at = 0; at < good.size(); ++at) {
        std::string bad = good;
        bad[at] = static_cast<char>(bad[at] ^ 0x10);
        put(bad);
        refused("lags start steady");
    }
    put(good + "x");
    refused("has the wrong length");
    put(std::string(100000, 'x'));
    refused("is no state file");
    put(good);
    config_builder other = lags();
    std::strcpy(other.config->machine, "lathe");
    EXPECT_FALSE(read(*other.config, rig.now_us, 1001 * second));
    EXPECT_NE(std::string(message).find("is of another machine"), std::string::npos) << message;
    EXPECT_TRUE(read(config, rig.now_us, 900 * second));
    EXPECT_NE(std::string(message).find("from the future"), std::string::npos) << message;
    EXPECT_FALSE(state.lags[3].settled);
}

// A restart must not bring an older signed file, or that of another machine.
TEST_F(state_file, has_machine_and_revision_of_the_last_run) {
    cb_last_run ran{};
    EXPECT_FALSE(cb_state_last_run(&ran, path.c_str())) << "it is not there yet";
    box_rig rig = warm();
    rig.box->config.revision = 12;
    save(rig, 1000 * second);
    ASSERT_TRUE(cb_state_last_run(&ran, path.c_str()));
    EXPECT_STREQ(ran.machine, "mill");
    EXPECT_EQ(ran.revision, 12u);
    std::string damaged = bytes();
    damaged[20] = static_cast<char>(damaged[20] ^ 1);
    put(damaged);
    EXPECT_FALSE(cb_state_last_run(&ran, path.c_str()));
    put(std::string());
    EXPECT_FALSE(cb_state_last_run(&ran, path.c_str()));
}

// A file with a good CRC and a time that no clock shows: differences of times would overflow.
TEST_F(state_file, a_time_that_no_clock_shows_is_not_used) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    const std::string good = bytes();
    constexpr size_t header = 104, record = 88, ending = header + 3 * record;
    for (const int64_t time_us : {INT64_MIN, int64_t{-1}, INT64_MAX}) {
        std::string bad = good;
        const auto set = [&](size_t at) { std::memcpy(&bad[at], &time_us, sizeof time_us); };
        for (const size_t clock_at : {0u, 8u}) {  // of the wall, of the boot
            for (size_t i = 0; i < 3; ++i) set(header + i * record + 48 + clock_at);
            set(ending + clock_at);
            put_with_crc(bad);
            for (const char *boot : {"boot", "another boot"}) {
                const cb_state_clock now = clock(rig.now_us, 1001 * second, boot);
                ASSERT_TRUE(read_at(rig.box->config, now)) << message;
                const bool is_before_the_boot = clock_at == 8 && time_us == -1;
                const bool goes_on = is_before_the_boot && std::string(boot) != "boot";
                EXPECT_TRUE(reports(goes_on ? "3 of 3" : "of 3")) << time_us << ": " << message;
                if (is_before_the_boot) continue;
                EXPECT_TRUE(reports("0 of 3")) << time_us << ": " << message;
                EXPECT_FALSE(state.beat);
            }
            bad = good;
        }
    }
}

TEST_F(state_file, a_state_that_is_no_number_or_of_another_power_is_not_used) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    const std::string good = bytes();
    constexpr size_t header = 104, hi = 64, power = 80;
    for (const size_t at : {hi, hi + 4, hi + 8, power}) {
        std::string bad = good;
        const float value = at == power ? 9 : NAN;
        std::memcpy(&bad[header + at], &value, sizeof value);
        put_with_crc(bad);
        ASSERT_TRUE(read(rig.box->config, rig.now_us, 1001 * second)) << message;
        EXPECT_TRUE(reports("2 of 3")) << at << ": " << message;
    }
}

TEST_F(state_file, a_file_that_cannot_be_written_leaves_the_old_one) {
    const box_rig rig = warm();
    const cb_state_clock now = clock(rig.now_us, 0, "boot");
    EXPECT_NE(write(rig, now, "/nowhere/x"), 0);
    save(rig, 1000 * second);
    const std::string good = bytes();
    ASSERT_EQ(mkdir((path + ".new").c_str(), 0700), 0);
    EXPECT_NE(write(rig, now, path.c_str()), 0);
    rmdir((path + ".new").c_str());
    EXPECT_EQ(bytes(), good);
}

}  // namespace
}  // namespace compbox
