// SPDX-License-Identifier: MIT
// Lags in the box: steady at the start, exact over any pause, still while their signal is missing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/box_fixture.h"
#include "tests/support/config_fixture.h"

namespace compbox {
namespace {

// X in register 8, the thermometer T1, slow = lag of T1 with 600 s, and a term that shows it.
struct lag_builder : config_builder {
    unsigned slow, slower;
    explicit lag_builder(float tau_s = 600, uint8_t power = 1, uint32_t max_age_ms = 2000) {
        position("X", 8);
        const unsigned t = thermometer("T1", max_age_ms);
        slower = lag("slower", t + 2, tau_s, 1);  // stands before the lag that it follows
        slow = lag("slow", t, tau_s, power);
        config->lags[0] = static_cast<uint8_t>(slow);
        config->lags[1] = static_cast<uint8_t>(slower);
        config->lags_count = 2;
        channel("Z", {polynomial("KT", slow, {0, 1})}, 4);
    }
    unsigned lag(const char *name, unsigned of, float tau_s, uint8_t power) {
        cb_signal_config &s = signal(name, "degC", CB_SOURCE_LAG, CB_NUMBER_INT16, 0);
        s.lag_of = static_cast<uint8_t>(of);
        s.tau_s = tau_s;
        s.power = power;
        s.min = power == 2 ? 0 : -10;
        s.max = power == 2 ? 8100 : 90;
        s.max_age_ms = config->signals[1].max_age_ms;
        return config->signals_count - 1u;
    }
    // T1 in register 10, read in each cycle.
    void on_the_plc() {
        cb_signal_config &t = config->signals[1];
        t.source = CB_SOURCE_PLC;
        t.reg = 10;
        t.type = CB_NUMBER_INT16;
    }
};

struct lag_rig : box_rig {
    explicit lag_rig(const lag_builder &b) : box_rig(b) { position(8, 100); }
    void step_at(float celsius, int64_t elapsed_us = 30000) {
        in.samples[in.sample_count++] = {1, celsius * 10, now_us + elapsed_us};
        step(elapsed_us);
    }
    double value(const char *name = "slow") const {
        for (unsigned i = 0; i < box->config.signals_count; ++i) {
            if (std::string(name) == box->config.signals[i].name) return box->signals[i].value;
        }
        return NAN;
    }
    bool fresh() const { return box->signals[3].fresh; }
};

TEST(lags, start_in_the_steady_state_of_the_first_value) {
    lag_rig rig{lag_builder()};
    rig.step();
    EXPECT_FALSE(rig.fresh());
    rig.step_at(37);
    EXPECT_TRUE(rig.fresh());
    EXPECT_FLOAT_EQ(static_cast<float>(rig.value()), 37);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.value("slower")), 37);
}

// Half an hour at uneven steps: y = 20 + 30 (1 - (1 + t/tau) e^-t/tau) for the chain.
TEST(lags, a_chain_follows_a_jump_as_it_must) {
    lag_rig rig{lag_builder()};
    rig.step_at(20);
    double t = 0;
    for (int i = 0; i < 60000; ++i) {
        const int64_t dt_us = 30000 + (i * 7919) % 900 - 450;
        t += static_cast<double>(dt_us) * 1e-6;
        rig.step_at(50, dt_us);
        if (i % 997 != 0) continue;
        const double h = (t - 0.015) / 600;  // the jump took one step
        EXPECT_NEAR(rig.value(), 20 + 30 * (1 - std::exp(-h)), 1e-4) << t;
        EXPECT_NEAR(rig.value("slower"), 20 + 30 * (1 - (1 + h) * std::exp(-h)), 2e-4) << t;
    }
    EXPECT_NEAR(t, 1800, 1);
}

TEST(lags, of_the_square) {
    lag_rig rig{lag_builder(600, 2)};
    rig.step_at(-3);
    EXPECT_NEAR(rig.value(), 9, 1e-5);
    for (int i = 0; i < 20000; ++i) rig.step_at(8);
    EXPECT_NEAR(rig.value(), 9 + 55 * (1 - std::exp(-(600 - 0.015) / 600)), 1e-3);
}

// A thermometer that is polled now and then moves the lag as one polled in every cycle.
TEST(lags, only_new_values_move_a_lag_and_over_the_whole_time_between) {
    lag_rig every{lag_builder()}, seldom{lag_builder()};
    every.step_at(20);
    seldom.step_at(20);
    for (int i = 1; i <= 3000; ++i) {
        const float now =
            20 + 0.005f * static_cast<float>(i - i % 50) + 0.005f * static_cast<float>(i % 50);
        every.step_at(now);
        if (i % 50 == 0) {
            seldom.step_at(now);
        } else {
            const double before = seldom.value();
            seldom.step();
            EXPECT_EQ(seldom.value(), before);
        }
    }
    EXPECT_NEAR(seldom.value(), every.value(), 2e-5);
}

// A reply that comes late has a value that is too old from the first.
TEST(lags, of_readings_that_are_too_old_are_stale) {
    lag_builder b(600, 1, 10);
    b.on_the_plc();
    lag_rig rig(b);
    rig.in.registers[10] = 200;
    rig.steps(10);
    EXPECT_TRUE(rig.fresh());
    rig.reading_us = 12000;
    rig.steps(2);
    EXPECT_FALSE(rig.box->signals[1].fresh);
    EXPECT_FALSE(rig.fresh());
    rig.reading_us = 0;
    rig.steps(2);
    EXPECT_TRUE(rig.fresh());
}

TEST(lags, are_stale_with_their_signal_and_go_on_over_the_gap) {
    lag_rig rig{lag_builder(600, 1, 1000)};
    for (int i = 0; i < 10; ++i) rig.step_at(20);
    const auto stale = rig.box->counters.signals_stale;
    for (int i = 0; i < 33; ++i) rig.step();
    EXPECT_TRUE(rig.fresh());
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    for (int i = 0; i < 400; ++i) rig.step();
    EXPECT_FALSE(rig.fresh());
    EXPECT_EQ(rig.box->counters.signals_stale, stale + 3) << "the thermometer and both lags";
    EXPECT_FALSE(rig.box->terms[0].live);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_EQ(rig.value(), 20);
    rig.step_at(40);
    const double h = 434 * 0.03 / 600;  // it went straight from 20 to 40
    EXPECT_NEAR(rig.value(), 20 + 20 * (1 - (1 - std::exp(-h)) / h), 1e-4);
    EXPECT_TRUE(rig.box->terms[0].live);
}

// The box needs the lag, so it holds and names the thermometer, however long the chain is.
TEST(lags, an_essential_one_stops_the_box_with_its_signal) {
    for (const char *essential : {"slow", "slower"}) {
        lag_builder b(600, 1, 1000);
        b.config->signals[essential == std::string("slow") ? b.slow : b.slower].essential = true;
        lag_rig rig(b);
        for (int i = 0; i < 10; ++i) rig.step_at(20);
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
        rig.steps(34);
        EXPECT_EQ(rig.mode(), CB_MODE_HOLD) << essential;
        EXPECT_EQ(rig.reason(), CB_REASON_SIGNAL);
        EXPECT_EQ(rig.box->cause.kind, CB_CAUSE_STALE);
        EXPECT_STREQ(rig.box->config.signals[rig.box->cause.index].name, "T1");
    }
}

TEST(lags, keep_their_memory_over_a_jump_of_the_clock) {
    lag_rig rig{lag_builder()};
    rig.step_at(20);
    for (int i = 0; i < 2000; ++i) rig.step_at(50);
    const double before = rig.value();
    EXPECT_LT(before, 24);
    rig.step(1000000);
    EXPECT_EQ(rig.box->counters.clock_jumps, 1u);
    EXPECT_FALSE(rig.fresh());
    rig.step_at(50);
    EXPECT_NEAR(rig.value(), 50 - (50 - before) * std::exp(-1.03 / 600), 1e-4);
    const double later = rig.value();
    rig.step(-5000000);
    rig.step_at(50);
    EXPECT_NEAR(rig.value(), later, 1e-6) << "time that went backward moves nothing";
    rig.step_at(50);
    EXPECT_GT(rig.value(), later);
}

TEST(lags, a_night_asleep_is_a_night) {
    lag_rig rig{lag_builder(7200)};
    rig.step_at(20);
    rig.step(8LL * 3600 * 1000000);
    rig.step_at(50);
    const double h = 8.0 * 3600 / 7200;
    EXPECT_NEAR(rig.value(), 20 + 30 * (1 - (1 - std::exp(-h)) / h), 1e-3);
}

TEST(lags, a_sample_for_a_lag_is_nobodys) {
    lag_rig rig{lag_builder()};
    rig.step_at(20);
    rig.sample(3, 500);
    rig.step();
    EXPECT_EQ(rig.box->counters.samples_unknown, 1u);
    EXPECT_EQ(rig.value(), 20);
}

// What a lag has to be, by the model alone: followed from reading to reading, held in its range.
struct lag_by_itself {
    cb_lag lag{};
    bool begun = false;
    int64_t time_us = 0;
    float value = 0;
    void follow(const cb_signal_config &config, float input, int64_t now_us) {
        const float u = config.power == 2 ? input * input : input;
        if (!begun) cb_lag_start(&lag, u);
        const float seconds = static_cast<float>(now_us - time_us) * 1e-6f;
        if (begun && now_us != time_us)
            cb_lag_step_to(&lag, cb_lag_gains_for(seconds, config.tau_s), u);
        begun = true;
        time_us = now_us;
        value = cb_clamp(lag.hi, config.min, config.max);
    }
};

// A thermometer on the PLC that goes from one end of its range to the other and back, with noise,
// values that are not plausible and readings that fail: every lag has the bits of the model, and
// with that it never leaves its range, although the usual way (lags.c) does not look.
TEST(lags, of_a_plc_signal_are_the_model_whatever_becomes_of_the_readings) {
    lag_builder b;
    b.on_the_plc();
    const unsigned fast = b.lag("fast", 1, 0.5f, 1), square = b.lag("square", 1, 20, 2);
    for (unsigned i : {fast, square})
        b.config->lags[b.config->lags_count++] = static_cast<uint8_t>(i);
    lag_rig rig(b);
    std::vector<lag_by_itself> own(b.config->signals_count);
    std::mt19937 random(5);
    unsigned at_ends = 0;
    for (int i = 0; i < 20000; ++i) {
        const int tenths = std::clamp(400 + static_cast<int>(700 * std::sin(i * 0.004)), -100, 900);
        const int noise = static_cast<int>(random() % 3) - 1;
        rig.in.registers[10] = static_cast<uint16_t>(std::clamp(tenths + noise, -100, 900));
        if (random() % 50 == 0) rig.in.registers[10] = 20000;
        rig.reading = random() % 40 != 0;
        rig.step(30000 - 500 + static_cast<int64_t>(random() % 1000));
        const cb_signal_state *const states = rig.box->signals;
        if (!states[1].known) continue;
        for (unsigned k = 0; k < b.config->lags_count; ++k) {
            const unsigned lag = b.config->lags[k], of = b.config->signals[lag].lag_of;
            const float input = of == 1 ? states[1].value : own[of].value;
            own[lag].follow(b.config->signals[lag], input, states[1].time_us);
            ASSERT_EQ(states[lag].value, own[lag].value) << b.config->signals[lag].name << ' ' << i;
            ASSERT_EQ(states[lag].lag.lo, own[lag].lag.lo) << b.config->signals[lag].name;
            at_ends += states[lag].value >= 89.9f && lag == fast;
        }
    }
    EXPECT_GT(at_ends, 1000u);
}

std::unique_ptr<cb_box> reloaded(const lag_rig &rig, const lag_builder &b) {
    auto fresh = std::make_unique<cb_box>();
    std::memset(fresh.get(), 0, sizeof *fresh);
    fresh->config = *b.config;
    cb_box_start(fresh.get());
    EXPECT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    return fresh;
}

TEST(lags, survive_a_reload_by_name) {
    lag_rig rig{lag_builder()};
    rig.step_at(20);
    for (int i = 0; i < 2000; ++i) rig.step_at(50);
    const double before = rig.value();
    rig.box = reloaded(rig, lag_builder(1200));
    rig.step_at(50);
    EXPECT_NEAR(rig.value(), 50 - (50 - before) * std::exp(-0.03 / 1200), 1e-5);
    rig.box = reloaded(rig, lag_builder(600, 2));
    rig.step_at(50);
    EXPECT_NEAR(rig.value(), 2500, 1e-3) << "of another power: it starts anew";
}

TEST(lags, start_anew_with_another_signal) {
    lag_rig rig{lag_builder()};
    for (int i = 0; i < 10; ++i) rig.step_at(20);
    lag_builder other;
    std::strcpy(other.config->signals[1].name, "T9");
    rig.box = reloaded(rig, other);
    rig.step_at(50);
    EXPECT_EQ(rig.value(), 50);
    EXPECT_NEAR(rig.value("slower"), 20, 1e-3) << "it still follows slow";
}

// 50 °C, then a file that allows 30: the lag needs 11 minutes to fall below it.
TEST(lags, stay_inside_a_range_that_a_reload_narrowed) {
    lag_builder wide, narrow;
    for (lag_builder *b : {&wide, &narrow}) b->on_the_plc();
    for (const unsigned signal : {1u, narrow.slow, narrow.slower})
        narrow.config->signals[signal].max = 30;
    lag_rig rig(wide);
    rig.in.registers[10] = 500;
    rig.steps(10);
    rig.box = reloaded(rig, narrow);
    rig.in.registers[10] = 200;
    for (double h = 0.03 / 600; h < 2; h += 0.03 / 600) {
        rig.step();
        ASSERT_NEAR(rig.value(), std::min(30.0, 20 + 30 * std::exp(-h)), 0.01) << h;
    }
}

TEST(lags, the_range_of_a_square) {
    using namespace compbox_test;
    const std::string lag = with(R"({"name": "B", "unit")", R"({"name": "L", "unit": "K2",
        "lag_of": "T2", "tau_s": 20, "power": 2}, {"name": "B", "unit")");
    const struct {
        const char *range;
        float min, max;
    } cases[] = {
        {"-10, \"max\": 90", 0, 8100}, {"-9, \"max\": -2", 4, 81}, {"3, \"max\": 5", 9, 25}};
    for (const auto &[range, min, max] : cases) {
        const auto got = load(
            with("-10, \"max\": 90, \"essential\"", std::string(range) + ", \"essential\"", lag));
        ASSERT_EQ(got.error, CB_OK) << got.text;
        EXPECT_EQ(got.config->signals[3].min, min) << range;
        EXPECT_EQ(got.config->signals[3].max, max) << range;
    }
    EXPECT_EQ(
        load(with("-10, \"max\": 90, \"essential\"", "1e-30, \"max\": 2e-30, \"essential\"", lag))
            .text,
        "signals[3].lag_of: the square of T2 exceeds 1e9 or is constant; see its min and max");
}

TEST(lags, are_ordered_by_the_loader) {
    using namespace compbox_test;
    const auto got = load(with(R"({"name": "B", "unit")", R"({"name": "L3", "unit": "degC",
        "lag_of": "L2", "tau_s": 30}, {"name": "L2", "unit": "K2", "lag_of": "L1", "tau_s": 20,
        "power": 2}, {"name": "L1", "unit": "degC", "lag_of": "T1", "tau_s": 10},
        {"name": "B", "unit")"));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    ASSERT_EQ(c.lags_count, 3);
    EXPECT_STREQ(c.signals[c.lags[0]].name, "L1");
    EXPECT_STREQ(c.signals[c.lags[1]].name, "L2");
    EXPECT_STREQ(c.signals[c.lags[2]].name, "L3");
    EXPECT_EQ(c.signals[3].min, 0) << "-10 … 90, squared";
    EXPECT_EQ(c.signals[3].max, 8100);
    EXPECT_EQ(c.signals[3].max_age_ms, 2500u);
    EXPECT_EQ(c.signals[5].tau_s, 10);
    EXPECT_FALSE(c.signals[3].essential || c.signals[3].leads);
}

}  // namespace
}  // namespace compbox
