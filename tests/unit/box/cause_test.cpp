// SPDX-License-Identifier: MIT
// Which signal, term or channel is behind a reason: in the box, in the detail word, in words.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/box_fixture.h"
#include "tests/support/box_from_text.h"
#include "tests/support/config_fixture.h"
#include "tests/support/paths.h"

extern "C" {
#include "hal/linux/files/cause_words.h"
}

namespace compbox {
namespace {

// Two axes, a thermometer, two channels; the detail word in register 15 of the write block.
config_builder two_axes() {
    config_builder b;
    const unsigned x = b.position("X", 8), y = b.position("Y", 10);
    const unsigned t = b.thermometer("T1", 200);
    b.channel("CX", {b.polyline("EXX", x, {0, 1000}, {0, 100})}, 4);
    b.channel("CY", {b.polyline("EYY", y, {0, 1000}, {0, 100}), b.polynomial("warm", t, {0, 1})},
              6);
    b.config->channels[1].limit_um = 80;
    b.config->channels[1].error_um = 90;
    b.config->plc.has_detail = true;
    b.config->plc.detail = 15;
    return b;
}

std::string words_of(const box_rig &rig) {
    char text[CB_CAUSE_TEXT];
    const cb_row_cause cause = cb_name_cause(rig.box.get());
    cb_cause_text(&cause, text);
    return text;
}

struct cause_rig : box_rig {
    cause_rig() : box_rig(two_axes()) {
        position(8, 400);
        position(10, 400);
        warm_steps(10);
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(out.registers[15], 0);
    }
    void warm_steps(unsigned count) {
        for (unsigned i = 0; i < count; ++i) {
            sample(2, 100);
            step();
        }
    }
    std::string words() const { return words_of(*this); }
    unsigned detail() const { return out.registers[15]; }
};

TEST(box_cause, a_zero_has_no_sign) {
    cb_row_cause cause = {};
    cause.cause.kind = CB_CAUSE_UNAPPLIED;
    cause.cause.value = -0.0F;
    cause.cause.bound = 8;
    std::strcpy(cause.name, "CX");
    char text[CB_CAUSE_TEXT];
    cb_cause_text(&cause, text);
    EXPECT_STREQ(text, "channel CX applies 0 um and was sent 8");
    cause.cause.value = 8;
    cause.cause.bound = -0.0F;
    cb_cause_text(&cause, text);
    EXPECT_STREQ(text, "channel CX applies 8 um and was sent 0");
}

TEST(box_cause, an_essential_signal_that_is_implausible) {
    cause_rig rig;
    rig.position(10, 1000.5);
    rig.warm_steps(5);
    EXPECT_EQ(rig.reason(), CB_REASON_SIGNAL);
    EXPECT_EQ(rig.words(), "signal Y reads 1000.5 mm and its max is 1000");
    EXPECT_EQ(rig.detail(), CB_CAUSE_ABOVE * 256u + 2);
    EXPECT_EQ(rig.box->signals[1].implausible, 5u);
    EXPECT_EQ(rig.box->signals[1].stale, 1u);
    EXPECT_EQ(rig.box->signals[0].implausible, 0u);
    rig.position(8, -0.25);
    rig.position(10, 400);
    rig.warm_steps(5);
    EXPECT_EQ(rig.words(), "signal X reads -0.25 mm and its min is 0");
    rig.position(8, 400);
    rig.control(1 | 2 | 8);
    rig.warm_steps(1);
    EXPECT_EQ(rig.words(), "");
    EXPECT_EQ(rig.detail(), 0u);
}

// Two axes, and three sensors that check each other: T1 of a term, T2 and T3.
struct sensors_rig : box_rig {
    explicit sensors_rig(const config_builder &b = with_sensors()) : box_rig(b) {
        position(8, 400);
        position(10, 400);
        steps(200, 100, 100);
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(reason(), CB_REASON_NONE);
    }
    static config_builder with_sensors() {
        config_builder b = two_axes();
        b.thermometer("T2", 201);
        b.thermometer("T3", 202);
        cb_config &c = *b.config;
        c.sensors_count = 3;
        c.sensors.pool = c.pool_count;
        c.sensors.after_us = 3000000;
        c.sensors.threshold_square = 36.0f;
        // 1 K of each alone, and 20 K of all together
        const float matrix[] = {10,      10,     10,      0.667f,  -0.333f, -0.333f,
                                -0.333f, 0.667f, -0.333f, -0.333f, -0.333f, 0.667f};
        for (uint8_t i = 0; i < 3; ++i) c.sensors.signal[i] = static_cast<uint8_t>(i + 2);
        std::copy(matrix, matrix + 12, c.pool + c.pool_count);
        c.pool_count = static_cast<uint16_t>(c.pool_count + 12);
        return b;
    }
    // T3 and each further thermometer read 10 degC.
    void steps(unsigned count, float first, float second) {
        for (unsigned i = 0; i < count; ++i) {
            sample(2, first);
            sample(3, second);
            for (unsigned more = 4; more < box->config.signals_count; ++more) sample(more, 100);
            step();
        }
    }
    std::string words() const { return words_of(*this); }
};

TEST(box_cause, a_sensor_that_the_others_contradict) {
    sensors_rig rig;
    rig.steps(400, 300, 100);  // 20 K more
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_EQ(rig.box->counters.sensors_doubted, 1u);
    EXPECT_EQ(rig.words(), "signal T1 reads 30 and the other sensors predict 10");
    EXPECT_EQ(rig.out.registers[15], CB_CAUSE_DOUBTED * 256u + 3);
    rig.steps(2000, 100, 100);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
}

// T2 is doubted and no term has it, T1 falls silent.
TEST(box_cause, a_faded_term_beside_a_doubted_sensor_of_no_term) {
    sensors_rig rig;
    rig.steps(400, 100, 300);
    EXPECT_EQ(rig.box->counters.sensors_doubted, 1u);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
    for (int i = 0; i < 100; ++i) {
        rig.sample(3, 300);
        rig.sample(4, 100);
        rig.step();
    }
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_EQ(rig.out.registers[15], CB_CAUSE_FADED * 256u + 3);
}

TEST(box_cause, a_signal_that_changes_too_fast_or_was_never_there) {
    config_builder b = two_axes();
    b.config->signals[2].essential = true;
    b.config->signals[2].max_rate_per_s = 0.5f;
    box_rig rig(b);
    rig.position(8, 400);
    rig.position(10, 400);
    rig.steps(5);
    const auto words = [&rig] { return words_of(rig); };
    EXPECT_EQ(words(), "signal T1 has had no plausible value yet");
    rig.sample(2, 200);
    rig.steps(8);
    EXPECT_EQ(words(), "signal T1 is 240 ms old and its max_age_ms is 200");
    rig.sample(2, 600);
    rig.step();
    EXPECT_EQ(words(), "signal T1 reads 60 degC and changed faster than its max_rate_per_s, 0.5");
    EXPECT_EQ(rig.out.registers[15], CB_CAUSE_FAST * 256 + 3);
}

// What clears up later does not change what the fault was about.
TEST(box_cause, a_demand_names_its_channel_until_the_reset) {
    cause_rig rig;
    rig.position(10, 850);
    rig.warm_steps(1);
    EXPECT_EQ(rig.reason(), CB_REASON_DEMAND);
    EXPECT_EQ(rig.words(), "channel CY wants -95 um and its error_um is 90");
    EXPECT_EQ(rig.detail(), CB_CAUSE_DEMAND * 256u + 2);
    EXPECT_EQ(rig.box->channels[1].excessive, 1u);
    EXPECT_EQ(rig.box->channels[0].limited, 0u);
    rig.position(10, 400);
    rig.warm_steps(20);
    EXPECT_EQ(rig.words(), "channel CY wants -95 um and its error_um is 90");
    rig.control(1 | 2 | 4);
    rig.warm_steps(1);
    EXPECT_EQ(rig.words(), "");
}

TEST(box_cause, remarks_while_active) {
    cause_rig rig;
    rig.position(10, 750);
    rig.warm_steps(1);
    EXPECT_EQ(rig.reason(), CB_REASON_LIMITED);
    EXPECT_EQ(rig.words(), "channel CY wants -85 um and its limit_um is 80");
    EXPECT_EQ(rig.box->channels[1].limited, 1u);
    EXPECT_EQ(rig.box->channels[1].excessive, 0u);
    rig.position(10, 400);
    rig.steps(10);  // no thermometer
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_EQ(rig.words(), "term warm is faded out");
    EXPECT_EQ(rig.detail(), CB_CAUSE_FADED * 256u + 3);
    EXPECT_EQ(rig.box->signals[2].stale, 1u);
}

TEST(box_cause, a_channel_that_the_plc_does_not_apply) {
    config_builder b = simple();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    box_rig rig(b);
    rig.position(8, 400);
    rig.steps(60);
    ASSERT_EQ(rig.reason(), CB_REASON_UNAPPLIED);
    EXPECT_EQ(rig.box->cause.kind, CB_CAUSE_UNAPPLIED);
    EXPECT_EQ(rig.box->cause.index, 0);
    EXPECT_EQ(rig.box->cause.value, 0.0f);
    EXPECT_EQ(rig.box->cause.bound, rig.box->channels[0].sent_um);
}

// Of two channels the first is named, whose value is 0 or 500 µm at the PLC.
TEST(box_cause, the_first_channel_that_the_plc_does_not_apply) {
    for (const double applied_um : {0.0, 500.0}) {
        config_builder b = two_axes();
        for (unsigned i = 0; i < 2; ++i) {
            b.config->channels[i].has_applied = true;
            b.config->channels[i].applied_reg = static_cast<uint16_t>(24 + 2 * i);
        }
        box_rig rig(b);
        rig.position(8, 400);
        rig.position(10, 400);
        float sent_um = 0;  // before the step of the cause
        for (int i = 0; i < 60; ++i) {
            if (rig.box->cause.kind == CB_CAUSE_NONE) sent_um = rig.box->channels[0].sent_um;
            put_int32(rig.in.registers + 24, applied_um / 0.01);
            put_int32(rig.in.registers + 26, 2 * applied_um / 0.01);
            rig.sample(2, 100);
            rig.step();
        }
        ASSERT_EQ(rig.reason(), applied_um > 0 ? CB_REASON_FOREIGN : CB_REASON_UNAPPLIED);
        EXPECT_EQ(rig.box->cause.kind, CB_CAUSE_UNAPPLIED);
        EXPECT_EQ(rig.box->cause.index, 0);
        EXPECT_FLOAT_EQ(rig.box->cause.value, static_cast<float>(applied_um));
        const float sent_now_um = applied_um > 0 ? sent_um : rig.box->channels[0].sent_um;
        EXPECT_NEAR(rig.box->cause.bound, sent_now_um, 5);
    }
}

// What the counters of signals and channels add up to is what the box counts.
TEST(box_cause, shares_add_up_also_over_a_clock_jump) {
    cause_rig rig;
    for (int i = 0; i < 300; ++i) {
        rig.position(8, i % 7 == 0 ? 2000 : 400);
        rig.position(10, i % 40 < 20 ? 800 : 300);
        if (i % 50 > 10) rig.sample(2, i % 11 == 0 ? 30000 : 100);
        rig.step(i == 150 ? 10000000 : 30000);
    }
    uint32_t implausible = 0, stale = 0, limited = 0;
    for (const cb_signal_state &s : rig.box->signals)
        implausible += s.implausible, stale += s.stale;
    for (const cb_channel_state &c : rig.box->channels) limited += c.limited;
    EXPECT_EQ(implausible, rig.box->counters.samples_implausible);
    EXPECT_EQ(stale, rig.box->counters.signals_stale);
    EXPECT_EQ(limited, rig.box->counters.outputs_limited);
    EXPECT_GT(implausible, 0u);
    EXPECT_GT(stale, 0u);
    EXPECT_GT(limited, 0u);
}

TEST(box_cause, the_page_on_faults_names_every_cause) {
    std::ifstream in(from_source("docs/faults.md"));
    std::stringstream page;
    page << in.rdbuf();
#define CB_X(name, number, what, first, second)                                      \
    EXPECT_TRUE(number == 0 ||                                                       \
                page.str().find("| " #number " | " what " | ") != std::string::npos) \
        << first;                                                                    \
    EXPECT_STREQ(cb_cause_words_of(number).before, first);
    CB_CAUSES(CB_X)
#undef CB_X
}

// The key plc.detail: a register of the write block of its own.
TEST(box_cause, the_detail_word_in_the_file) {
    const auto with = [](const std::string &address) {
        std::string text = compbox_test::full_example;
        const std::string before = "\"box_heartbeat\": 102,";
        text.replace(text.find(before), before.size(), before + " \"detail\": " + address + ",");
        return compbox_test::load(text);
    };
    const auto good = with("114"), taken = with("101"), outside = with("99");
    EXPECT_EQ(good.error, CB_OK) << good.text;
    EXPECT_TRUE(good.config->plc.has_detail);
    EXPECT_EQ(good.config->plc.detail, 14);
    EXPECT_EQ(taken.text, "plc.detail: register 101 already belongs to the status word (status)");
    EXPECT_EQ(outside.text, "plc.detail: register 99 is outside plc.write, 100 to 115");
}

}  // namespace
}  // namespace compbox
