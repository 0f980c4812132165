// SPDX-License-Identifier: MIT
// Probes of the control: what a box compares with its model, when a count is a measurement, and the
// bounds and ramps of an adapted term in a running box.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/cases.h"
#include "tests/support/probe_rig.h"

namespace compbox {
namespace {

TEST(probes, move_the_adapted_term_and_the_output_by_the_residual) {
    probe_rig rig;
    EXPECT_EQ(rig.y(), 20.0f);
    rig.touch(43);  // EXX explains 20, the model 20, so 3 are left
    EXPECT_EQ(rig.state().taken, 1u);
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
    EXPECT_NEAR(rig.y(), 23, 0.2);
    EXPECT_NEAR(rig.output(), -43, 0.2);
    rig.touch(43);
    EXPECT_NEAR(rig.state().filter.innovation_um, 0, 0.2);
    EXPECT_EQ(rig.box->counters.probes_taken, 2u);
}

TEST(probes, see_the_same_error_in_standby_in_a_ramp_and_at_a_limit) {
    probe_rig rig;
    rig.control(2);
    rig.run_s(0.2);
    const double half_way = rig.output();
    EXPECT_LT(half_way, -1);
    rig.probe(43 + rig.output());
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
    rig.run_s(3);
    EXPECT_EQ(rig.output(), 0);
    rig.touch(43);
    EXPECT_NEAR(rig.state().filter.innovation_um, 0, 0.2);
    probe_rig limited(adapted_file({{"\"limit_um\": 200", "\"limit_um\": 40"}}));
    limited.touch(43);
    EXPECT_NEAR(limited.output(), -40, 0.011);
    EXPECT_NEAR(limited.y(), 23, 0.2);
    limited.touch(43);
    EXPECT_NEAR(limited.state().filter.innovation_um, 0, 0.2);
}

TEST(probes, use_the_value_that_the_plc_applies) {
    probe_rig rig(adapted_file(
        {{"\"scale\": 0.01}],\n\"safety\"", "\"scale\": 0.01, \"applied\": 16}],\n\"safety\""}}));
    put_int32(rig.in.registers + 16, -1000);  // it applies -10, not -40
    rig.probe(43 - 10);
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
}

TEST(probes, of_a_whole_error_leave_the_output_out) {
    probe_rig rig(adapted_file({{"\"probe_n\"},\n", "\"probe_n\"}, \"measures\": \"whole\",\n"}}));
    rig.probe(43);
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
}

TEST(probes, are_one_measurement_for_each_new_count_and_wrap) {
    probe_rig rig;
    EXPECT_EQ(rig.state().taken + rig.state().refused, 0u);  // the first count is a reference
    rig.touch(43);
    rig.touch(43);  // 65535 -> 0
    EXPECT_EQ(rig.count, 0);
    EXPECT_EQ(rig.state().taken, 2u);
    EXPECT_EQ(rig.state().skipped, 0u);
    rig.probe(43 + rig.output(), 7);
    EXPECT_EQ(rig.state().taken, 3u);
    EXPECT_EQ(rig.state().skipped, 6u);
    rig.probe(43 + rig.output());  // 30 ms later
    EXPECT_EQ(rig.state().refused, 1u);
    EXPECT_EQ(rig.box->counters.probes_refused, 1u);
}

// Its first value, mostly zero, is no measurement.
TEST(probes, count_anew_where_the_plc_counts_anew) {
    probe_rig rig;
    for (int i = 0; i < 9; ++i) rig.touch(43);
    EXPECT_EQ(rig.state().taken, 9u);
    rig.count = 0xFFFF;
    rig.probe(0);
    EXPECT_EQ(rig.count, 0);
    EXPECT_EQ(rig.state().taken + rig.state().refused, 9u);
    EXPECT_EQ(rig.state().skipped, 0u);
    rig.touch(43);
    EXPECT_EQ(rig.state().taken, 10u);
}

TEST(probes, count_anew_after_the_plc_was_silent) {
    probe_rig rig;
    rig.lose_plc();
    rig.run_s(1);
    rig.in.registers[14] = 7;
    rig.find_plc();
    rig.in.held = CB_TRANSFER_OK;
    rig.run_s(1);
    EXPECT_EQ(rig.state().count, 7);
    EXPECT_EQ(rig.state().taken + rig.state().refused + rig.state().skipped, 0u);
}

TEST(probes, ask_the_plc_for_a_repetition) {
    probe_rig rig;
    rig.touch(40);
    EXPECT_FALSE(rig.asks());
    const float before = rig.y();
    rig.touch(140);
    EXPECT_TRUE(rig.asks());
    EXPECT_EQ(rig.y(), before);
    EXPECT_EQ(rig.box->counters.probes_asked, 1u);
    rig.probe(40.5 + rig.output());
    EXPECT_FALSE(rig.asks());
    EXPECT_EQ(rig.state().taken, 2u);
}

TEST(probes, without_a_good_value_are_refused) {
    probe_rig rig;
    rig.probe(1001);  // beyond max
    EXPECT_EQ(rig.state().refused, 1u);
    EXPECT_EQ(rig.y(), 20.0f);
    rig.probe(3);
    EXPECT_EQ(rig.state().taken, 1u);
}

TEST(probes, while_another_term_of_the_sum_is_missing_are_refused) {
    for (const char *sum :
         {R"(["adapted", "EXX", "other"])", R"(["adapted", "other", "EXX"])"}) {  // last or not
        probe_rig rig(adapted_file(
            {{R"({"name": "thermal", "type": "linear", "inputs": ["T1"], "weights": [1]})",
              R"({"name": "thermal", "type": "linear", "inputs": ["probe"], "weights": [0],
 "constant": 20}, {"name": "other", "type": "linear", "inputs": ["T1"], "weights": [0]})"},
             {R"(["adapted", "EXX"])", sum}}));
        rig.temperature(1000);
        rig.run_s(1);
        rig.probe(3);
        EXPECT_EQ(rig.state().refused, 1u) << sum;
        rig.temperature(20);
        rig.run_s(1);
        rig.probe(3);
        EXPECT_EQ(rig.state().taken, 1u) << sum;
    }
}

// In a ramp each write without a reply leaves 1.5 um more that the PLC may apply.
TEST(probes, while_writes_without_a_reply_differ_by_more_than_sigma_are_refused) {
    probe_rig rig;
    rig.control(2);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(2);
    rig.probe(43 + rig.output());
    ASSERT_EQ(rig.box->plc.contact, CB_CONTACT_KNOWN);
    EXPECT_EQ(rig.state().refused, 1u);
    rig.write = CB_TRANSFER_OK;
    rig.run_s(5);
    rig.probe(43 + rig.output());
    EXPECT_EQ(rig.state().taken, 1u);
}

// A count of another type may be implausible: what was counted meanwhile is not compared.
// The PLC holds the output of before.
TEST(probes, behind_writes_that_were_not_sent_are_refused) {
    probe_rig rig;
    rig.control(2);
    rig.write = CB_TRANSFER_FAILED;
    rig.steps(2);
    rig.probe(43 + rig.output());
    ASSERT_EQ(rig.box->plc.contact, CB_CONTACT_KNOWN);
    EXPECT_EQ(rig.state().refused, 1u);
    rig.write = CB_TRANSFER_OK;
    rig.step();
    rig.probe(43 + rig.output());
    EXPECT_EQ(rig.state().taken, 1u);
}

// Model and probe come by CAN. The PLC takes its offset away, and the box cannot read that.
TEST(probes, while_the_applied_value_is_not_known_are_refused) {
    box_rig rig(from_text(adapted_file(
        {{R"(["adapted", "EXX"])", R"(["adapted"])"},
         {R"("plc": 10, "type": "int16")", R"("can": "0x181", "type": "int16le")"},
         {R"("plc": 12, "type": "int32")", R"("can": "0x182", "type": "int32le")"},
         {R"("plc": 14, "type": "uint16")", R"("can": "0x183", "type": "uint16le")"},
         {"\"scale\": 0.01}],\n\"safety\"", "\"scale\": 0.01, \"applied\": 16}],\n\"safety\""}})));
    const cb_probe_state &state = rig.box->probes[0];
    const auto steps = [&rig](unsigned number, double um, float count) {
        for (unsigned i = 0; i < number; ++i) {
            rig.sample(1, 200);
            rig.sample(2, static_cast<float>(um * 100));
            rig.sample(3, count);
            rig.step();
        }
    };
    rig.position(8, 200);
    put_int32(rig.in.registers + 16, -2000);
    steps(100, 0, 7);
    ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE);
    rig.lose_plc();
    steps(300, 0, 7);
    steps(1, 20, 8);
    EXPECT_EQ(state.refused, 1u);
    rig.find_plc();
    put_int32(rig.in.registers + 16, 0);
    steps(40, 20, 8);
    steps(1, 20, 9);
    EXPECT_EQ(state.taken, 1u);
    EXPECT_NEAR(state.filter.innovation_um, 0, 0.02);
    put_int32(rig.in.registers + 16, 900000);  // beyond error_um
    steps(40, 20, 9);
    steps(1, 20, 10);
    EXPECT_EQ(state.refused, 2u);
}

TEST(probes, count_anew_after_an_implausible_count) {
    probe_rig rig(
        adapted_file({{R"("plc": 14, "type": "uint16")", R"("plc": 14, "type": "int32")"}}));
    const auto count = [&](double now) {
        put_int32(rig.in.registers + 14, now);
        put_int32(rig.in.registers + 12, 300);
        rig.step();
    };
    for (const double now : {5.0, 70000.0, 6.0}) count(now);
    EXPECT_TRUE(rig.box->signals[3].fresh);
    EXPECT_EQ(rig.state().taken + rig.state().refused, 0u);
    count(7);
    EXPECT_EQ(rig.state().taken, 1u);
}

// The term watches a machine whose channels do not use it.
TEST(probes, of_a_whole_error_need_no_channel) {
    probe_rig rig(adapted_file({{R"("probe_n"},)", R"("probe_n"}, "measures": "whole",)"},
                                {R"(["adapted", "EXX"])", R"(["thermal", "EXX"])"}}));
    rig.probe(23);
    EXPECT_EQ(rig.state().taken, 1u);
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
    rig.run_s(3);
    EXPECT_NEAR(rig.y(), 23, 0.2);
    EXPECT_NEAR(rig.output(), -40, 0.011);
}

// What it reports as applied may have the part of the slope, which belongs to no register.
TEST(probes, of_a_channel_with_a_tangent_use_the_value_that_was_sent) {
    probe_rig rig(adapted_file(
        {{R"("count": 16},)", R"("count": 16, "counters": true},)"},
         {R"("status": 100, "box_heartbeat": 101)", R"("status": 101, "box_heartbeat": 102)"},
         {R"("int32", "scale": 0.01}],
"safety")",
          R"("int32", "scale": 0.01, "applied": 16,
 "tangent": {"signal": "X", "slope_plc": 106, "slope_type": "int32", "slope_scale": 1e-8, "slope_limit": 0.01,
  "slope_slew_per_s": 0.05, "reference_plc": 108, "reference_type": "int32", "reference_scale": 0.001}}],
"safety")"}}));
    put_int32(rig.in.registers + 16, -1000);
    rig.probe(43 - 40);
    EXPECT_NEAR(rig.state().filter.innovation_um, 3, 0.02);
}

// A machine that has moved beyond the bound: every probe differs to one side, and the reason names
// the term.
TEST(probes, that_differ_to_one_side_give_the_reason_and_its_end) {
    probe_rig rig(adapted_file(
        {{"\"bias_max_um\": 30", "\"bias_max_um\": 1"}, {"\"gain_max\": 0.5", "\"gain_max\": 0"}}));
    int probes = 0;
    while (rig.reason() != CB_REASON_MODEL_DRIFTED && probes < 30) {
        rig.touch(40 + 4);
        ++probes;
    }
    EXPECT_EQ(rig.reason(), CB_REASON_MODEL_DRIFTED);
    EXPECT_GT(probes, 4);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.box->cause.kind, CB_CAUSE_DRIFTED);
    EXPECT_EQ(rig.box->cause.index, 2);
    EXPECT_GT(rig.box->cause.value, 10);
    EXPECT_EQ(rig.state().asked, 0u);
    for (int i = 0; i < 30 && rig.reason() == CB_REASON_MODEL_DRIFTED; ++i) rig.touch(41);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
}

TEST(probes, move_the_term_at_the_ramp) {
    probe_rig rig(adapted_file({{"\"ramp_um_per_s\": 50", "\"ramp_um_per_s\": 2"}}));
    rig.probe(3);
    float before = rig.y();
    for (int i = 0; i < 40; ++i) {
        rig.step();
        EXPECT_LE(rig.y() - before, 2 * 0.03 + 1e-5);
        before = rig.y();
    }
    EXPECT_NEAR(rig.y(), 20 + 40 * 2 * 0.03, 1e-3);
    rig.run_s(1);
    EXPECT_NEAR(rig.y(), 23, 0.2);
}

// |y - m| stays inside of the bound while the model fades from 20 µm to 0, and back.
TEST(probes, keep_the_bound_while_the_model_fades) {
    probe_rig rig(adapted_file({{"\"bias_max_um\": 30", "\"bias_max_um\": 2"}}));
    for (int i = 0; i < 30; ++i) {
        const double hour_us = 3600e6;
        rig.now_us += static_cast<int64_t>(hour_us);
        rig.stand_by();
        rig.run_s(5);
        rig.probe(20 + rig.y() + 8 + rig.output());
    }
    rig.run_s(5);
    ASSERT_GT(rig.y(), 28);
    rig.temperature(1000);  // implausible
    bool faded = false;
    for (int i = 0; i < 100; ++i) {
        rig.step();
        const double bound = 2 + 0.5 * std::fabs(double(rig.m()));
        ASSERT_LE(std::fabs(double(rig.y()) - rig.m()), bound) << i;
        faded = faded || rig.m() == 0;
    }
    EXPECT_TRUE(faded);
    EXPECT_EQ(rig.y(), 0);
    rig.temperature(20);
    rig.run_s(5);
    EXPECT_GT(rig.y(), 28);
}

TEST(probes, grow_uncertain_with_time) {
    probe_rig rig;
    rig.touch(43);
    const float sigma = cb_adapt_sigma(&rig.state().filter, 20, nullptr);
    rig.now_us += 3600000000;
    rig.run_s(3);
    rig.touch(43);
    EXPECT_GT(rig.state().filter.expected_um, 9);  // 6 µm and 0.5 x 20 µm in an hour
    EXPECT_LT(sigma, 2);
}

// Any stream of values, counts, temperatures, modes and losses: the bound, the output's limit and
// its slew.
void send_any_stream(const std::string &text) {
    std::mt19937 random(7);
    probe_rig rig(text);
    const int cycles = compbox_test::long_tests() ? 10000000 : 200000;
    float before = rig.y();
    double out_before = rig.output();
    for (int i = 0; i < cycles; ++i) {
        const unsigned dice = random() % 64;
        if (dice < 30)
            rig.in.registers[14] =
                static_cast<uint16_t>(random() % 3 ? rig.in.registers[14] + 1 : random());
        if (dice < 20)
            put_int32(rig.in.registers + 12, double(int32_t(random())) * (dice < 2 ? 1 : 4e-6));
        if (dice == 40) rig.temperature(double(random() % 240) - 120);
        if (dice == 41) rig.control(random() % 16);
        if (dice > 41) rig.control(1 | 2 | 8);
        if (dice == 42) rig.reading = random() % 2;
        if (dice == 43) rig.reading = true;
        rig.stand_by();
        rig.step(dice == 44 ? 3600000000 : 30000);
        ASSERT_LE(std::fabs(double(rig.y()) - rig.m()), 30 + 0.5 * std::fabs(double(rig.m()))) << i;
        ASSERT_LE(std::fabs(rig.output()), 200) << i;
        ASSERT_LE(std::fabs(rig.output() - out_before), 500 * 0.06 + 0.011) << i;
        ASSERT_TRUE(std::isfinite(rig.state().filter.bias_d + rig.state().filter.gain_d)) << i;
        const float sigma = cb_probe_sigma(&rig.box->config, 0, &rig.state(), &rig.box->sigma,
                                           rig.box->outputs, rig.now_us);
        ASSERT_TRUE(sigma >= 0 && std::isfinite(sigma)) << i;
        out_before = rig.output();
        before = rig.y();
    }
    EXPECT_TRUE(std::isfinite(before));
    EXPECT_GT(rig.state().taken, 20u);
    EXPECT_GT(rig.state().asked, 20u);
    EXPECT_GT(rig.state().refused, 100u);
}

TEST(probes, no_stream_breaks_a_bound_of_the_box) {
    send_any_stream(adapted_file());
}

TEST(probes, no_stream_breaks_a_bound_of_a_model_with_its_own_sigma) {
    send_any_stream(adapted_file({with_sigma}));
}

TEST(probes, go_on_after_a_reload_without_a_step) {
    probe_rig rig(adapted_file({{"\"ramp_um_per_s\": 50", "\"ramp_um_per_s\": 2"}}));
    rig.probe(3);
    rig.run_s(0.6);
    const cb_probe_state before = rig.state();
    const float y = rig.y();
    ASSERT_GT(y, 20.5);  // on its way to 23
    ASSERT_LT(y, 22);
    const auto fresh = std::make_unique<cb_box>();
    fresh->config =
        *from_text(
             adapted_file({{"\"ramp_um_per_s\": 50", "\"ramp_um_per_s\": 2"},
                           {"\"terms\": [",
                            "\"terms\": [{\"name\": \"first\", \"type\": \"polyline\", \"signal\": "
                            "\"X\", \"positions\": [0, 1], \"values\": [0, 0]}, "}}))
             .config;
    cb_box_start(fresh.get());
    ASSERT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    const auto old = std::move(rig.box);
    rig.box = std::make_unique<cb_box>(*fresh);
    rig.step();
    EXPECT_EQ(rig.state().filter.bias_um, before.filter.bias_um);
    EXPECT_EQ(rig.state().filter.u, before.filter.u);
    EXPECT_EQ(rig.state().taken, 1u);
    EXPECT_NEAR(rig.box->outputs[3], y + 2 * 0.03, 1e-4);
    rig.run_s(2);
    EXPECT_NEAR(rig.box->outputs[3], 23, 0.2);
    // the next count is a measurement
    rig.probe(0);
    EXPECT_EQ(rig.state().taken, 2u);
}

// out: the box of another file, which goes on where that of `rig` is
std::unique_ptr<cb_box> reloaded(const probe_rig &rig, const std::string &text) {
    auto fresh = std::make_unique<cb_box>();
    fresh->config = *from_text(text).config;
    cb_box_start(fresh.get());
    EXPECT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    return fresh;
}

TEST(probes, begin_anew_after_a_reload_with_another_model) {
    probe_rig rig;
    rig.touch(43);
    const auto fresh = reloaded(rig, adapted_file({{"\"name\": \"thermal\"", "\"name\": \"other\""},
                                                   {"\"of\": \"thermal\"", "\"of\": \"other\""}}));
    EXPECT_EQ(fresh->probes[0].filter.bias_um, 0);
    EXPECT_FALSE(fresh->probes[0].timed);
}

TEST(probes, begin_anew_where_the_name_was_that_of_another_kind) {
    probe_rig rig(adapted_file({{R"("of": "thermal")", R"("of": "EXX")"},
                                {R"("name": "adapted")", R"("name": "new")"},
                                {R"("name": "thermal")", R"("name": "adapted")"},
                                {R"(["adapted", "EXX"])", R"(["adapted", "new"])"}}));
    rig.touch(43);
    ASSERT_EQ(rig.state().taken, 1u);
    const auto fresh =
        reloaded(rig, adapted_file({{R"("of": "thermal")", R"("of": "EXX")"},
                                    {R"(["adapted", "EXX"])", R"(["adapted", "thermal"])"}}));
    EXPECT_EQ(fresh->probes[0].filter.bias_um, 0);
    EXPECT_FALSE(fresh->probes[0].timed);
    EXPECT_EQ(fresh->outputs[2], rig.box->outputs[1]) << "but the output itself goes on";
}

// What it counted then says nothing of this one.
TEST(probes, count_anew_after_a_reload_with_another_count) {
    probe_rig rig;
    rig.touch(43);
    std::string text = adapted_file();
    for (size_t at; (at = text.find("\"probe_n\"")) != std::string::npos;)
        text.replace(at, 9, "\"touched\"");
    rig.box = reloaded(rig, text);
    rig.probe(3, 5);
    EXPECT_EQ(rig.state().taken, 1u);
    EXPECT_EQ(rig.state().refused + rig.state().skipped, 0u);
    rig.run_s(2);
    rig.touch(43);
    EXPECT_EQ(rig.state().taken, 2u);
}

TEST(probes, count_anew_after_a_reload_while_the_plc_is_silent) {
    probe_rig rig;
    rig.touch(43);
    rig.lose_plc();
    rig.run_s(1);
    rig.box = reloaded(rig, adapted_file());
    rig.find_plc();
    rig.in.held = CB_TRANSFER_OK;
    rig.in.registers[14] = 99;
    rig.run_s(1);
    EXPECT_EQ(rig.state().count, 99);
    EXPECT_EQ(rig.state().taken, 1u);
    EXPECT_EQ(rig.state().refused + rig.state().skipped, 0u);
}

std::string refusal(std::initializer_list<std::pair<std::string, std::string>> changed) {
    return compbox_test::load(adapted_file(changed)).text;
}

TEST(probes, need_a_file_in_which_one_channel_adds_the_term_alone) {
    EXPECT_EQ(refusal({{"[\"adapted\", \"EXX\"]", "[\"adapted\", \"thermal\"]"}}),
              "channels[0].sum[1]: \"thermal\" is already in this sum as adapted, which is "
              "\"thermal\" adapted; omit one "
              "of them");
    EXPECT_EQ(refusal({{R"("min_interval_s": 1}],)", R"("min_interval_s": 1},
 {"name": "again", "type": "adapt", "of": "thermal", "probe": {"value": "probe", "count": "probe_n"},
  "bias_max_um": 30, "gain_max": 0.5, "step_max_um": 5, "drift_um_per_sqrt_h": 6,
  "gain_drift_per_sqrt_h": 0.5, "sigma_um": 1.5}],)"},
                       {"[\"adapted\", \"EXX\"]", "[\"adapted\", \"again\"]"}}),
              "channels[0].sum[1]: \"again\" is already in this sum as adapted, which is "
              "\"thermal\" adapted; omit one of them");
    EXPECT_EQ(refusal({{"[\"adapted\", \"EXX\"]", "[\"EXX\"]"}}),
              "terms[2].probe: no channel adds this term, so the box does not know what its probe "
              "still sees; name it in a "
              "sum, or set measures to \"whole\"");
    EXPECT_EQ(refusal({{"[\"adapted\", \"EXX\"]", "[\"EXX\"]"},
                       {"\"probe_n\"},\n", "\"probe_n\"}, \"measures\": \"whole\",\n"}}),
              "");
    EXPECT_EQ(
        refusal({{"\"channels\": [",
                  "\"channels\": [{\"name\": \"X2\", \"sum\": [\"adapted\"], \"limit_um\": 200, "
                  "\"error_um\": 400, \"slew_um_per_s\": 500, \"plc\": 106, \"type\": \"int32\", "
                  "\"scale\": 0.01}, "}}),
        "terms[2].probe: the channels X2 and X both add this term, and a probe measures one; give "
        "each channel an "
        "adapt term of its own");
    EXPECT_EQ(refusal({{"\"request\": 112", "\"request\": 104"}}),
              "channels[0].plc: register 104 already belongs to request");
    EXPECT_EQ(refusal({{"\"of\": \"thermal\"", "\"of\": \"adapted\""}}),
              "terms[2].of: this term depends on its own output");
}

TEST(probes, need_a_signal_that_counts) {
    const std::pair<const char *, const char *> wrong[] = {
        {R"("max": 65535)", R"("max": 65534)"},
        {R"("uint16", "min": 0)", R"("int32", "min": 1)"},
        {R"("uint16")", R"("int16")"},
        {R"("type": "uint16", )", ""},
        {R"("uint16")", R"("uint16", "scale": 2)"},
        {R"("uint16")", R"("int32", "zero": 1)"},
        {R"("max": 65535)", R"("max": 65535, "max_rate_per_s": 100)"},
        {R"("probe_n", "unit": "1", "plc": 14, "type": "uint16", "min": 0, "max": 65535})",
         R"("n", "unit": "1", "plc": 14, "type": "uint16", "min": 0, "max": 65535},
 {"name": "probe_n", "unit": "1", "lag_of": "n", "tau_s": 60})"}};
    for (const auto &[piece, other] : wrong)
        EXPECT_EQ(
            refusal({{piece, other}}),
            "terms[2].probe.count: the signal \"probe_n\" does not count: it needs type uint16, "
            "scale 1, min 0, max 65535 and no max_rate_per_s")
            << other;
}

// A term of several outputs has a name of its own, which names none of them.
TEST(probes, are_those_of_the_term_itself_whatever_a_term_of_several_outputs_is_called) {
    const std::string net =
        R"({"name": "adapted", "type": "bpnet", "inputs": ["X"], "outputs": ["net_x", "net_y"], "activation": "tansig",
 "hidden_weights": [[1]], "hidden_bias": [0], "output_weights": [[1], [1]], "output_bias": [0, 0], "input_min": [0],
 "input_max": [1000]},)";
    const std::pair<std::string, std::string> first = {R"("terms": [)", R"("terms": [)" + net};
    EXPECT_EQ(refusal({first}), "");
    EXPECT_EQ(refusal({first, {R"(["adapted", "EXX"])", R"(["EXX"])"}}),
              "terms[3].probe: no channel adds this term, so the box does not know what its probe "
              "still sees; name it in a sum, or set measures to \"whole\"");
}

}  // namespace
}  // namespace compbox
