// SPDX-License-Identifier: MIT
// What is plausible at the very ends of a signal's range.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

extern "C" {
#include "firmware/config/config.h"
#include "firmware/config/derive.h"
#include "firmware/signals/signals.h"
#include "firmware/wire/number.h"
}

namespace {

// One PLC signal in registers 0 and 1.
struct signal_under_test {
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    std::unique_ptr<cb_inputs> in = std::make_unique<cb_inputs>();
    cb_signal_state state{};
    cb_counters counters{};

    signal_under_test(cb_number_type type, float scale, float min, float max) {
        config->signals_count = 1;
        config->period_us = 30000;
        cb_signal_config &s = config->signals[0];
        s.source = CB_SOURCE_PLC;
        s.type = static_cast<uint8_t>(type);
        s.scale = scale;
        s.min = min;
        s.max = max;
    }
    void give(uint32_t bits) {
        in->registers[0] = static_cast<uint16_t>(bits >> 16);
        in->registers[1] = static_cast<uint16_t>(bits & 0xFFFF);
        in->read_us += 30000;
        cb_config_derive(config.get());
        cb_signals_accept(config.get(), &state, &counters, in.get(), true, {}, in->read_us);
    }
    bool accepts(int32_t raw) {
        state = {};
        give(static_cast<uint32_t>(raw));
        return state.known;
    }
    bool accepts_float(float raw) {
        uint32_t bits;
        std::memcpy(&bits, &raw, sizeof bits);
        state = {};
        give(bits);
        return state.known;
    }
};

// 1 500 000 * 0.001f is 1500.0001f: the roundings must not make a resting axis implausible.
TEST(signals, an_axis_at_the_end_of_its_travel_is_plausible) {
    const struct {
        float scale, min, max;
    } axes[] = {{0.001f, -1500, 1500}, {0.0001f, 0, 14300}, {0.0001f, 0, 3000},
                {0.001f, 0, 2500},     {0.1f, -10, 90},     {0.01f, 0, 360},
                {0.0003f, 0, 7},       {0.00001f, 0, 1200}};
    for (const auto &axis : axes) {
        signal_under_test s(CB_NUMBER_INT32, axis.scale, axis.min, axis.max);
        for (double end : {static_cast<double>(axis.min), static_cast<double>(axis.max)}) {
            const auto raw = static_cast<int32_t>(std::lround(end / axis.scale));
            EXPECT_TRUE(s.accepts(raw)) << end << " at scale " << axis.scale;
            EXPECT_GE(s.state.value, axis.min);
            EXPECT_LE(s.state.value, axis.max);
        }
    }
}

TEST(signals, one_unit_beyond_is_not_plausible) {
    signal_under_test s(CB_NUMBER_INT32, 0.01f, 0, 1000);
    EXPECT_TRUE(s.accepts(0));
    EXPECT_TRUE(s.accepts(100000));
    EXPECT_FALSE(s.accepts(-1));
    EXPECT_FALSE(s.accepts(100001));
    EXPECT_FALSE(s.accepts(INT32_MAX));
    EXPECT_FALSE(s.accepts(INT32_MIN));
}

TEST(signals, what_is_no_number_is_never_plausible) {
    signal_under_test s(CB_NUMBER_FLOAT32, 1, 0, 2500);
    EXPECT_TRUE(s.accepts_float(2500));
    EXPECT_TRUE(s.accepts_float(0));
    EXPECT_FALSE(s.accepts_float(2500.1f));
    EXPECT_FALSE(s.accepts_float(-0.1f));
    EXPECT_FALSE(s.accepts_float(std::numeric_limits<float>::infinity()));
    EXPECT_FALSE(s.accepts_float(-std::numeric_limits<float>::infinity()));
    EXPECT_FALSE(s.accepts_float(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_EQ(s.counters.samples_implausible, 5u);
}

// A thermometer with a slow max_rate_per_s that was silent for long: what it may have changed by
// grows with the silence, without end.
TEST(signals, a_rate_limited_signal_is_heard_again_after_any_silence) {
    for (int64_t silent_s : {60, 2147, 2148, 7200, 90 * 86400, 3 * 365 * 86400}) {
        for (double part : {0.98, 1.02}) {
            signal_under_test t(CB_NUMBER_FLOAT32, 1, -1e9f, 1e9f);
            t.config->signals[0].max_rate_per_s = 0.01f;
            t.give(0);
            ASSERT_TRUE(t.state.known);
            const float value = static_cast<float>(part * 0.01 * static_cast<double>(silent_s));
            uint32_t bits;
            std::memcpy(&bits, &value, sizeof bits);
            t.in->read_us += silent_s * 1000000 - 30000;
            t.give(bits);
            EXPECT_EQ(t.counters.samples_implausible, part < 1 ? 0u : 1u) << silent_s;
            EXPECT_EQ(t.state.value == value, part < 1) << silent_s;
        }
    }
}

}  // namespace
