// SPDX-License-Identifier: MIT
// What commissioning concludes, without a PLC: signs, scales, times, and the box's configuration.
#include "host-tools/commission/judge.h"

#include <gtest/gtest.h>

extern "C" {
#include "firmware/config/config.h"
}
#include "host-tools/coefficients/machine_file.h"
#include "host-tools/commission/config.h"
#include "host-tools/commission/write.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox {
namespace {

std::string refusal(double measured_um) {
    try {
        commission::is_reversed("X", 20.0, measured_um);
    } catch (const input_error &error) {
        return error.what();
    }
    return "";
}

bool contains(const std::string &text, const std::string &piece) {
    return text.find(piece) != std::string::npos;
}

TEST(commission, a_sign_is_what_an_indicator_shows_with_its_errors) {
    for (const double um : {20.0, 19.8, 15.0, 25.0}) {
        EXPECT_FALSE(commission::is_reversed("X", 20.0, um)) << um;
        EXPECT_TRUE(commission::is_reversed("X", 20.0, -um)) << um;
    }
    EXPECT_TRUE(commission::is_reversed("X", -20.0, 19.0));
}

TEST(commission, refuses_what_is_no_sign) {
    for (const double um : {0.0, 0.5, -0.7})
        EXPECT_TRUE(contains(refusal(um), "the axis did not move")) << um;
    EXPECT_EQ(refusal(203.0),
              "axis X: commanded 20 µm, measured 203 µm: wrong by a factor of 10; the scale of the "
              "channel is too small for what the control takes");
    EXPECT_TRUE(contains(refusal(-1.9), "factor of 10; the scale of the channel is too large"));
    EXPECT_TRUE(contains(refusal(2100.0), "factor of 100; the scale of the channel is too small"));
    for (const double um : {10.0, -35.0, 60.0, 5.0})
        EXPECT_TRUE(contains(refusal(um), "neither the one nor a power of ten")) << um;
    EXPECT_NE(refusal(std::nan("")), "");
}

TEST(commission, percentiles_are_values_that_were_measured) {
    std::vector<std::int64_t> times;
    for (int i = 100; i >= 1; --i) times.push_back(1000 * i);
    const commission::spread all = commission::spread_of(times);
    EXPECT_EQ(all.count, 100u);
    EXPECT_EQ(all.p50_ms, 51.0);
    EXPECT_EQ(all.p99_ms, 100.0);
    EXPECT_EQ(commission::spread_of({7000}).p99_ms, 7.0);
}

TEST(commission, lead_and_period_from_times) {
    commission::loop_times times = {
        {10, 6.0, 12.0}, {10, 2.0, 4.0}, {10, 9.0, 14.0}, 8.0, 30.0, 0.0};
    EXPECT_DOUBLE_EQ(commission::lead_of(times), 4.0 + 4.0 + 9.0 + 15.0);
    times.round_ms = 96.0;
    EXPECT_DOUBLE_EQ(commission::lead_of(times), 4.0 + 4.0 + 9.0 + 15.0 + 48.0);
    EXPECT_DOUBLE_EQ(commission::shortest_period_ms(times), 15.0);
}

json machine(const std::string &profile = "generic") {
    coefficients::machine_options options;
    options.axes = "XYZ";
    options.profile = profile;
    options.host = "127.0.0.1";
    options.travel = {{"X", {0, 500}}};
    return coefficients::new_machine(options);
}

TEST(commission, runs_on_a_machine_file_of_init) {
    for (const char *profile : {"generic", "sinumerik-840d", "fanuc"}) {
        const auto setup = commission::make_box_setup(machine(profile), "m.json", 50.0);
        const cb_config &config = *setup.config;
        ASSERT_EQ(config.channels_count, 3);
        EXPECT_EQ(config.signals_count, 6);
        EXPECT_EQ(setup.axes.size(), 3u);
        EXPECT_EQ(setup.axes[2].name, "Z");
        EXPECT_EQ(config.channels[1].slew_um_per_s, 50.0f);
        EXPECT_EQ(config.ramp_um_per_s, 50.0f);
        EXPECT_EQ(setup.offset_signal[2], 5u);
        ASSERT_EQ(setup.remarks.size(), 1u);
        EXPECT_EQ(setup.remarks[0], "no range of Y, Z in the file: every position is plausible");
    }
}

TEST(commission, the_motors_of_a_pair_move_together) {
    json document = machine();
    document["pairs"] = json::array({{{"channels", {"X", "Z"}}, {"max_difference_um", 5}}});
    const auto setup = commission::make_box_setup(document, "m.json", 50.0);
    ASSERT_EQ(setup.axes.size(), 2u);
    EXPECT_EQ(setup.axes[0].name, "X+Z");
    EXPECT_EQ(setup.axes[0].channels, (std::vector<std::size_t>{0, 2}));
    EXPECT_EQ(setup.axes[0].max_difference_um, 5.0);
    EXPECT_EQ(setup.axes[1].max_difference_um, 0.0);
}

TEST(commission, leaves_models_sensors_and_tangents_out) {
    json document = machine();
    document["signals"].push_back({{"name", "T1"}, {"unit", "degC"}, {"can", "0x181"}});
    document["terms"] = json::array({{{"name", "nonsense"}}});
    document["channels"][0]["sum"] = {"nonsense"};
    document["channels"][0]["tangent"] = json::object();
    document["cycle"]["lead_ms"] = "measured";
    EXPECT_NO_THROW(commission::make_box_setup(document, "m.json", 50.0));
}

TEST(commission, says_what_is_wrong_in_the_words_of_the_loader) {
    json document = machine();
    document["channels"][1]["plc"] = 104;
    try {
        commission::make_box_setup(document, "m.json", 50.0);
        FAIL();
    } catch (const input_error &error) {
        EXPECT_STREQ(error.what(),
                     "m.json: channels[1].plc: register 104 already belongs to channel X");
    }
}

commission::findings result_of() {
    commission::findings result;
    result.signs[0] = {20.0, -19.5, -1};
    result.times =
        commission::loop_times{{10, 6.0, 12.0}, {10, 2.0, 4.0}, {10, 9.2, 14.0}, 8.0, 30.0, 0.0};
    return result;
}

TEST(commission, writes_what_it_found_and_leaves_the_rest) {
    json document = machine();
    document["provenance"]["by"] = "somebody";
    const json changed = commission::with_result(document, "m.json", result_of());
    EXPECT_EQ(changed["channels"][0]["sign"], -1);
    EXPECT_EQ(changed["channels"][1], document["channels"][1]);
    EXPECT_EQ(changed["cycle"]["lead_ms"], 32.0);
    EXPECT_EQ(changed["revision"], document["revision"]) << "a machine file: build counts";
    EXPECT_EQ(changed["provenance"]["by"], "somebody");
    EXPECT_EQ(changed["provenance"]["commissioning"]["signs"]["X"]["measured_um"], -19.5);
    EXPECT_EQ(changed["provenance"]["commissioning"]["times"]["lead_ms"], 32.2);
}

TEST(commission, what_one_run_did_not_repeat_stays) {
    commission::findings first = result_of(), second;
    first.positions = {{"X", {{"plc", 8}}}};
    const json before = commission::with_result(machine(), "m.json", first);
    second.signs[1] = {20.0, 20.0, 1, 19.0};
    second.positions = first.positions;
    const json found =
        commission::with_result(before, "m.json", second)["provenance"]["commissioning"];
    EXPECT_EQ(found["signs"]["X"]["measured_um"], -19.5);
    EXPECT_EQ(found["signs"]["Y"]["measured_alone_um"], 19.0);
    EXPECT_EQ(found["positions"]["X"]["plc"], 8);
    EXPECT_EQ(found["times"]["lead_ms"], 32.2);
}

TEST(commission, a_file_with_terms_gets_its_next_revision_and_keeps_a_measured_lead) {
    json document = machine();
    document["terms"] = json::array({1});
    document["cycle"]["lead_ms"] = "measured";
    const json changed = commission::with_result(document, "m.json", result_of());
    EXPECT_EQ(changed["revision"].get<int>(), document["revision"].get<int>() + 1);
    EXPECT_EQ(changed["cycle"]["lead_ms"], "measured");
    document["revision"] = 4294967294;
    EXPECT_EQ(commission::with_result(document, "m.json", {})["revision"], 4294967295);
    document["revision"] = 4294967295;
    EXPECT_THROW(commission::with_result(document, "m.json", {}), input_error);
}

}  // namespace
}  // namespace compbox
