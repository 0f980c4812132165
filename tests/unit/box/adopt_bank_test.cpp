// SPDX-License-Identifier: MIT
// Lags of banks across a reload, and across a restart in memory.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bank_rig.h"

extern "C" {
#include "firmware/box/state.h"
}

namespace compbox {
namespace {

std::string bank_term(const std::string &inputs, const std::string &powers,
                      const std::string &tau_s, const std::string &weights) {
    return R"({"name": "banked", "type": "linear", "bank": {"inputs": [)" + inputs +
           R"(], "powers": {)" + powers + R"(}, "tau_s": [)" + tau_s + R"(], "weights": [[)" +
           weights + "]]}}";
}
const std::string before =
    bank_term(R"("T2", "rpm")", R"("rpm": [1, 2])", "60, 3600", "1, 2, 3, 4, 5, 6");

// Two minutes after T2 went from 20 to 30 °C, and the spindle to 400 rpm.
bank_rig warm(const std::string &term = before) {
    bank_rig rig(term);
    rig.t2 = 20;
    for (int i = 0; i < 10; ++i) rig.go();
    rig.t2 = 30;
    rig.rpm = 400;
    for (int i = 0; i < 4000; ++i) rig.go();
    return rig;
}

// out: the box that took over
std::unique_ptr<cb_box> reloaded(const bank_rig &rig, const std::string &file) {
    auto fresh = std::make_unique<cb_box>();
    fresh->config = *from_text(file).config;
    cb_box_start(fresh.get());
    EXPECT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    return fresh;
}

float lag_of(const cb_box &box, const char *signal, uint8_t power, float tau_s) {
    for (uint8_t i = 0; i < box.config.signals_count; ++i) {
        if (std::string(box.config.signals[i].name) != signal) continue;
        const unsigned lag = cb_bank_find(&box.config, {i, power, tau_s, -1e30F, 1e30F});
        if (lag < CB_MAX_BANK_LAGS && cb_bank_is_settled(&box.bank, lag))
            return box.bank.lags[lag].hi;
    }
    return NAN;
}

TEST(adopt_bank, keeps_each_lag_of_the_same_input_power_and_time_constant) {
    bank_rig rig = warm();
    const std::string after = bank_term(R"("X", "rpm", "T2")", R"("rpm": [2, 3], "T2": [1, 2])",
                                        "0, 60, 600", "0,0,0, 0,0,0, 0,0,0, 0,0,1, 0,0,0");
    const auto fresh = reloaded(rig, bank_file(after));
    EXPECT_EQ(lag_of(*fresh, "T2", 1, 60), lag_of(*rig.box, "T2", 1, 60));
    EXPECT_NEAR(lag_of(*fresh, "T2", 1, 60), 30 - 10 * std::exp(-2), 0.01);
    EXPECT_EQ(lag_of(*fresh, "rpm", 2, 60), lag_of(*rig.box, "rpm", 2, 60));
    EXPECT_TRUE(std::isnan(lag_of(*fresh, "T2", 1, 600))) << "another time constant";
    EXPECT_TRUE(std::isnan(lag_of(*fresh, "T2", 2, 60))) << "another power";
    EXPECT_TRUE(std::isnan(lag_of(*fresh, "rpm", 3, 60)));
    EXPECT_TRUE(std::isnan(lag_of(*fresh, "X", 1, 60))) << "another input";
    rig.box = std::make_unique<cb_box>(*fresh);
    rig.go();
    EXPECT_EQ(lag_of(*rig.box, "T2", 1, 600), 30) << "starts steady";
    EXPECT_NEAR(lag_of(*rig.box, "T2", 1, 60), 30 - 10 * std::exp(-2), 0.01);
}

TEST(adopt_bank, the_output_goes_on_without_a_step) {
    bank_rig rig = warm(), still = warm();
    auto fresh = reloaded(
        rig, bank_file(before + R"(, {"name": "first", "type": "linear", "bank": {"inputs": ["T1"],
        "tau_s": [1], "weights": [[1]]}})"));
    rig.box = std::move(fresh);
    for (int i = 0; i < 5; ++i) {
        rig.go();
        still.go();
        EXPECT_EQ(cb_bits_of(rig.term("banked")), cb_bits_of(still.term("banked")));
        EXPECT_EQ(rig.written(4), still.written(4));
    }
}

// Two banks of one input. The first was trained up to 24 degC, so its lag stays below the other's.
std::string two_banks(double most) {
    const auto bank = [](const std::string &name, const std::string &range) {
        return R"({"name": ")" + name + R"(", "type": "linear", "bank": {"inputs": ["T2"],)" +
               range + R"( "tau_s": [60], "weights": [[1]]}})";
    };
    return bank("held", R"("input_min": [10], "input_max": [)" + std::to_string(most) + "],") +
           "," + bank("banked", "");
}

TEST(adopt_bank, lags_of_two_ranges_stay_apart) {
    const bank_rig rig = warm(two_banks(24));
    const auto lag_in = [](const cb_box &box, unsigned lag) { return box.bank.lags[lag].hi; };
    EXPECT_NEAR(lag_in(*rig.box, 0), 25.4, 0.9);
    EXPECT_NEAR(lag_in(*rig.box, 1), 30 - 10 * std::exp(-2), 0.01);
    for (const double most : {24.0, 25.0}) {  // the same file, and one of another training
        const auto fresh = reloaded(rig, bank_file(two_banks(most)));
        EXPECT_EQ(lag_in(*fresh, 0), lag_in(*rig.box, 0));
        EXPECT_EQ(lag_in(*fresh, 1), lag_in(*rig.box, 1));
    }
    const auto alone = reloaded(rig, bank_file(bank_term(R"("T2")", "", "60", "1")));
    EXPECT_EQ(lag_in(*alone, 0), lag_in(*rig.box, 1)) << "that of the bank without a range";
}

// The value of a signal in another unit, or of another signal with its name, says nothing.
TEST(adopt_bank, does_not_keep_the_lag_of_another_kind_of_signal) {
    const bank_rig rig = warm();
    const std::string same = bank_file(before);
    EXPECT_FALSE(std::isnan(lag_of(*reloaded(rig, same), "T2", 1, 60)));
    const std::string unit = R"("name": "T2", "unit": "degC")";
    std::string kelvin = same;
    kelvin.replace(kelvin.find(unit), unit.size(), R"("name": "T2", "unit": "degF")");
    EXPECT_TRUE(std::isnan(lag_of(*reloaded(rig, kelvin), "T2", 1, 60)));
    EXPECT_FALSE(std::isnan(lag_of(*reloaded(rig, kelvin), "rpm", 1, 60)));
}

TEST(adopt_bank, a_lag_that_never_started_starts_steady) {
    bank_rig rig(before);
    rig.heard[AT_T2] = false;
    for (int i = 0; i < 5; ++i) rig.go();
    rig.box = reloaded(rig, bank_file(before));
    rig.heard[AT_T2] = true;
    rig.t2 = 35;
    rig.go();
    EXPECT_EQ(lag_of(*rig.box, "T2", 1, 3600), 35);
}

TEST(adopt_bank, a_state_of_memory_goes_on) {
    bank_rig rig = warm();
    const auto state = std::make_unique<cb_state>();
    cb_state_take(state.get(), rig.box.get());
    bank_rig again(before);
    again.now_us = rig.now_us;
    cb_state_give(state.get(), again.box.get());
    again.t2 = rig.t2;
    again.rpm = rig.rpm;
    again.go(10 * 1000000);
    rig.go(10 * 1000000);
    EXPECT_EQ(lag_of(*again.box, "T2", 1, 60), lag_of(*rig.box, "T2", 1, 60));
    EXPECT_NEAR(lag_of(*again.box, "T2", 1, 60), 30 - 10 * std::exp(-130 / 60.0), 0.01);
}

}  // namespace
}  // namespace compbox
