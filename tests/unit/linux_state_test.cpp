// SPDX-License-Identifier: MIT
// The memory of the lags in a file: comes back as it was, by wall-clock time; what is not used.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "tests/unit/box_fixture.h"
#include "tests/unit/temporary.h"

extern "C" {
#include "hal/linux/daemon/state.h"
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
    char said[512] = "";

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
    void save(const box_rig &rig, int64_t unix_us) {
        cb_state taken;
        cb_state_take(&taken, rig.box.get());
        ASSERT_EQ(cb_state_write(&taken, &rig.box->config, path.c_str(), rig.now_us, unix_us), 0);
    }
    bool read(const cb_config &config, int64_t boottime_us, int64_t unix_us) {
        return cb_state_read(&state, &config, path.c_str(), boottime_us, unix_us, said,
                             sizeof said);
    }
    std::string bytes() {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    void put(const std::string &text) { std::ofstream(path, std::ios::binary) << text; }
};

TEST_F(state_file, a_short_pause_is_bridged_as_if_the_box_had_run) {
    box_rig rig = warm();
    save(rig, 1000 * second);
    box_rig again(lags());
    again.now_us = 3 * second;  // the machine was booted meanwhile
    ASSERT_TRUE(read(again.box->config, again.now_us, 1010 * second)) << said;
    EXPECT_NE(std::string(said).find("3 of 3 lags go on after a pause of 11.0 s"),
              std::string::npos)
        << said;
    cb_state_give(&state, again.box.get());
    again.position(8, 100);
    again.sample(1, 350);  // 10 s after the last value by the wall clock
    again.box->now_us = 0;
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

TEST_F(state_file, each_lag_is_judged_by_its_own_time_constant) {
    const box_rig rig = warm();
    save(rig, 1000 * second);
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 1016 * second));
    EXPECT_FALSE(state.lags[2].settled) << "16 s are more than a quarter of 60 s";
    EXPECT_TRUE(state.lags[3].settled);
    EXPECT_NE(std::string(said).find("2 of 3"), std::string::npos) << said;
    ASSERT_TRUE(read(rig.box->config, rig.now_us, 2801 * second));
    EXPECT_FALSE(state.lags[3].settled);
    EXPECT_NE(std::string(said).find("0 of 3"), std::string::npos) << said;
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

TEST_F(state_file, what_is_no_good_is_told_and_not_used) {
    const box_rig rig = warm();
    const cb_config &config = rig.box->config;
    const auto refused = [&](const std::string &why) {
        EXPECT_FALSE(read(config, rig.now_us, 1001 * second));
        EXPECT_NE(std::string(said).find(why), std::string::npos) << said;
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
    refused("is cut off");
    put(std::string(100000, 'x'));
    refused("is no state file");
    put(good);
    config_builder other = lags();
    std::strcpy(other.config->machine, "lathe");
    EXPECT_FALSE(read(*other.config, rig.now_us, 1001 * second));
    EXPECT_NE(std::string(said).find("is of another machine"), std::string::npos) << said;
    EXPECT_TRUE(read(config, rig.now_us, 900 * second));
    EXPECT_NE(std::string(said).find("from the future"), std::string::npos) << said;
    EXPECT_FALSE(state.lags[3].settled);
}

TEST_F(state_file, a_file_that_cannot_be_written_leaves_the_old_one) {
    const box_rig rig = warm();
    cb_state taken;
    cb_state_take(&taken, rig.box.get());
    EXPECT_NE(cb_state_write(&taken, &rig.box->config, "/nowhere/x", rig.now_us, 0), 0);
    save(rig, 1000 * second);
    const std::string good = bytes();
    ASSERT_EQ(mkdir((path + ".new").c_str(), 0700), 0);
    EXPECT_NE(cb_state_write(&taken, &rig.box->config, path.c_str(), rig.now_us, 0), 0);
    rmdir((path + ".new").c_str());
    EXPECT_EQ(bytes(), good);
}

}  // namespace
}  // namespace compbox
