// SPDX-License-Identifier: MIT
// What a control can do is a table; the loader refuses what does not fit, with the reason.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/config_fixture.h"

extern "C" {
#include "firmware/config/profile.h"
}

using namespace compbox_test;

namespace {

const std::string sinumerik = full_example;
const std::string fanuc =
    with("sinumerik-840d", "fanuc", with("\"scale\": 0.01", "\"scale\": 0.1"));
const std::string generic = with("sinumerik-840d", "generic");

std::string plc_key(const std::string &text, const std::string &keys) {
    return with("\"control\": 0,", "\"control\": 0, " + keys + ",", text);
}

void accepted(const std::string &text) {
    const auto got = load(text);
    EXPECT_EQ(got.error, CB_OK) << got.text;
}

void refused(const std::string &text, const std::string &sentence) {
    const auto got = load(text);
    EXPECT_EQ(got.error, CB_ERROR_PROFILE) << sentence;
    EXPECT_EQ(got.text, sentence);
    EXPECT_GT(got.line, 0u);
}

TEST(profile, table_knows_every_profile_by_its_name) {
    EXPECT_STREQ(cb_profile_of(CB_PROFILE_GENERIC)->name, "generic");
    EXPECT_STREQ(cb_profile_of(CB_PROFILE_SINUMERIK_840D)->name, "sinumerik-840d");
    EXPECT_STREQ(cb_profile_of(CB_PROFILE_FANUC)->name, "fanuc");
    EXPECT_STREQ(cb_profile_of(200)->name, "generic") << "a value that is none";
}

TEST(profile, an_exchange_needs_all_its_function_codes) {
    cb_profile_facts facts = *cb_profile_of(CB_PROFILE_FANUC);
    EXPECT_TRUE(cb_profile_answers(&facts, CB_EXCHANGE_FC23));
    facts.functions &= ~(1u << 3);
    EXPECT_FALSE(cb_profile_answers(&facts, CB_EXCHANGE_FC23));
    EXPECT_FALSE(cb_profile_answers(&facts, CB_EXCHANGE_FC3_FC16));
    facts.functions = 1u << 3 | 1u << 6;
    EXPECT_FALSE(cb_profile_answers(&facts, CB_EXCHANGE_FC3_FC16)) << "FC6 is no substitute";
}

TEST(profile, registers_in_a_request_are_those_of_its_function_codes) {
    cb_profile_facts facts = *cb_profile_of(CB_PROFILE_GENERIC);
    facts.read_registers = 100;
    facts.both_read = 60;
    EXPECT_EQ(cb_profile_read_most(&facts, CB_EXCHANGE_FC3_FC16), 100u);
    EXPECT_EQ(cb_profile_read_most(&facts, CB_EXCHANGE_FC23), 60u);
    facts.read_registers = 40;
    EXPECT_EQ(cb_profile_read_most(&facts, CB_EXCHANGE_FC23), 40u) << "it is also read by FC3";
    EXPECT_EQ(cb_profile_write_most(&facts, CB_EXCHANGE_FC3_FC16), 123u);
    EXPECT_EQ(cb_profile_write_most(&facts, CB_EXCHANGE_FC23), 121u);
}

TEST(profile, refuses_an_exchange_that_the_control_does_not_answer) {
    refused(with("fc3+fc16", "fc23", sinumerik),
            "plc.exchange: \"fc23\" is not supported by \"sinumerik-840d\"; use \"fc3+fc16\"");
    accepted(with("fc3+fc16", "fc23", fanuc));
    accepted(with("fc3+fc16", "fc23", generic));
    EXPECT_EQ(load(with("fc3+fc16", "fc6", fanuc)).text,
              "plc.exchange: \"fc6\" is not known; use fc3+fc16 or fc23");
}

TEST(profile, refuses_word_orders_of_a_control_that_keeps_abcd) {
    const std::string remedy =
        ": an S7 as Modbus server keeps the order ABCD; use uint16, int16, uint32, int32 or "
        "float32";
    for (const char *type : {"uint32cdab", "int32cdab", "float32cdab", "int16le", "float32le"}) {
        const std::string quoted = "\"" + std::string(type) + "\"";
        const auto changed = [&](const std::string &text) {
            return with("\"float32\"", quoted, text);
        };
        refused(changed(sinumerik),
                "signals[3].type: profile sinumerik-840d has no " + quoted + remedy);
        accepted(changed(generic));
        accepted(changed(fanuc));
    }
    refused(with("\"plc\": 104, \"type\": \"int32\"", "\"plc\": 104, \"type\": \"int32cdab\""),
            "channels[0].type: profile sinumerik-840d has no \"int32cdab\": an S7 as Modbus server "
            "keeps the order ABCD; use int16, int32 or float32");
}

// Sensors of the box's own buses are no business of the control.
TEST(profile, leaves_other_sources_their_order) {
    accepted(with("\"int16le\"", "\"float32le\"", sinumerik));
}

TEST(profile, refuses_what_a_fanuc_control_cannot_take) {
    const std::string z = "\"plc\": 104, \"type\": \"int32\", \"scale\": 0.1";
    refused(with(z, "\"plc\": 104, \"type\": \"float32\", \"scale\": 0.1", fanuc),
            "channels[0].type: profile fanuc has no \"float32\": its external data input takes "
            "whole numbers; use int16");
    refused(with(z, "\"plc\": 104, \"type\": \"int32\", \"scale\": 0.01", fanuc),
            "channels[0].limit_um: 300 µm in increments of 0.01 µm (scale) exceeds the 9999 that "
            "profile fanuc accepts; lower it or use a coarser increment");
    refused(with(z, "\"plc\": 104, \"type\": \"int32\", \"scale\": 0.5", fanuc),
            "channels[0].scale: 0.5 µm is not a least increment of profile fanuc; use 10, 1, 0.1, "
            "0.01 or 0.001");
    accepted(with(z, "\"plc\": 104, \"type\": \"int32cdab\", \"scale\": 1", fanuc));
}

TEST(profile, takes_the_last_increment_of_fanuc_and_not_one_more) {
    const auto limit = [](const std::string &um) {
        return with("\"limit_um\": 300, \"error_um\": 400",
                    "\"limit_um\": " + um + ", \"error_um\": 1100", fanuc);
    };
    accepted(limit("999.9"));
    refused(limit("1000"),
            "channels[0].limit_um: 1000 µm in increments of 0.1 µm (scale) exceeds the 9999 that "
            "profile fanuc accepts; lower it or use a coarser increment");
}

TEST(profile, refuses_a_tangent_where_the_nc_follows_no_slope) {
    const std::string tangent =
        "\"applied\": 24, \"tangent\": {\"signal\": \"X\", \"slope_plc\": 108, \"slope_type\": "
        "\"int32\", \"slope_scale\": 1e-8, \"slope_limit\": 0.01, \"slope_slew_per_s\": 0.05, "
        "\"reference_plc\": 110, \"reference_type\": \"int32\", \"reference_scale\": 0.001}";
    refused(with("\"applied\": 24", tangent, fanuc),
            "channels[0].tangent: profile fanuc has no slope; omit it");
    accepted(with("\"applied\": 24", tangent, sinumerik));
    accepted(with("\"applied\": 24", tangent, generic));
}

TEST(profile, keys_of_a_handshake_belong_to_a_control_that_has_one) {
    for (const char *key : {"handshake\": 2", "scan_ms\": 8", "axes_at_once\": true"}) {
        const std::string name = std::string(key).substr(0, std::string(key).find('"'));
        refused(plc_key(sinumerik, "\"" + std::string(key)),
                "plc." + name + ": profile sinumerik-840d has no handshake with its NC; omit it");
        accepted(plc_key(fanuc, "\"" + std::string(key)));
    }
    refused(plc_key(generic, "\"max_step_units\": 100"),
            "plc.max_step_units: profile generic has no largest step; omit it");
    EXPECT_EQ(load(plc_key(fanuc, "\"max_step_units\": 9999")).text,
              "plc.max_step_units: 9999 is outside the range of 2 to 9998");
    EXPECT_EQ(load(plc_key(fanuc, "\"handshake\": 8")).text,
              "signals[0].plc: register 8 already belongs to handshake");
}

TEST(profile, a_line_between_values_is_for_an_nc_that_takes_points_of_it) {
    for (const std::string &text : {generic, sinumerik}) {
        const auto got = load(plc_key(text, "\"interpolate_ms\": 30"));
        EXPECT_EQ(got.error, CB_OK) << got.text;
        EXPECT_EQ(got.config->plc.interpolate_us, 30000u);
        EXPECT_EQ(load(text).config->plc.interpolate_us, 0u);
    }
    accepted(plc_key(fanuc, "\"interpolate_ms\": 0"));
    refused(plc_key(fanuc, "\"interpolate_ms\": 30"),
            "plc.interpolate_ms: profile fanuc hands values to its NC by handshake, too slowly to "
            "interpolate between them; omit it");
    const auto message = [](const char *key) { return load(plc_key(generic, key)).text; };
    EXPECT_EQ(message("\"interpolate_ms\": 31"),
              "plc.interpolate_ms: 31 is longer than one period: the next value comes before this "
              "one is reached");
    EXPECT_EQ(message("\"interpolate_ms\": -1"),
              "plc.interpolate_ms: -1 is outside the range of 0 to 1000");
    EXPECT_EQ(message("\"interpolate_ms\": true"),
              "plc.interpolate_ms: must be a number, not true");
}

TEST(profile, fills_in_what_the_file_leaves_open) {
    const auto plc_of = [](const std::string &text) { return load(text).config->plc; };
    EXPECT_EQ(plc_of(fanuc).scan_us, 8000u);
    EXPECT_EQ(plc_of(fanuc).step_units, 9998);
    EXPECT_FALSE(plc_of(fanuc).has_handshake);
    EXPECT_FALSE(plc_of(fanuc).axes_at_once);
    EXPECT_EQ(plc_of(sinumerik).deadband_um, 0.1f);
    EXPECT_EQ(plc_of(sinumerik).scan_us, 0u);
    EXPECT_EQ(plc_of(generic).deadband_um, 0.0f);
    EXPECT_EQ(plc_of(generic).step_units, 0);
    const auto own = plc_of(plc_key(fanuc,
                                    "\"scan_ms\": 4.5, \"axes_at_once\": true, \"handshake\":"
                                    " 2, \"max_step_units\": 500, \"deadband_um\": 0.2"));
    EXPECT_EQ(own.scan_us, 4500u);
    EXPECT_TRUE(own.axes_at_once && own.has_handshake);
    EXPECT_EQ(own.handshake, 2);
    EXPECT_EQ(own.step_units, 500);
    EXPECT_EQ(own.deadband_um, 0.2f);
}

// Four scans an axis; three axes take about 100 ms.
TEST(profile, an_update_takes_four_scans_an_axis) {
    const auto config = load(fanuc).config;
    EXPECT_EQ(cb_profile_handshake_us(config.get()), 32000u);
    EXPECT_EQ(cb_profile_update_us(config.get()), 96000u);
    EXPECT_EQ(cb_profile_lead_us(config.get()), 64000u);
    const auto at_once = load(plc_key(fanuc, "\"axes_at_once\": true")).config;
    EXPECT_EQ(cb_profile_update_us(at_once.get()), 32000u);
    const auto direct = load(sinumerik).config;
    EXPECT_EQ(cb_profile_update_us(direct.get()), 0u);
    EXPECT_EQ(cb_profile_lead_us(direct.get()), 0u);
}

TEST(profile, no_channel_moves_further_than_a_step_in_its_window) {
    const auto slew_of = [](const std::string &text) {
        return load(with("\"slew_um_per_s\": 500", "\"slew_um_per_s\": 1000000", text))
            .config->channels[0]
            .slew_um_per_s;
    };
    EXPECT_EQ(slew_of(generic), 1e6f);
    EXPECT_EQ(slew_of(sinumerik), 1e6f);
    EXPECT_NEAR(slew_of(fanuc), 999.7, 0.01) << "9997 increments of 0.1 µm in a second";
    EXPECT_NEAR(slew_of(plc_key(fanuc, "\"max_step_units\": 101")), 10.0, 0.001);
    EXPECT_NEAR(slew_of(plc_key(fanuc, "\"scan_ms\": 80")), 999.7 / 9.6, 0.01)
        << "ten updates of 960 ms";
    EXPECT_EQ(load(fanuc).config->channels[0].slew_um_per_s, 500.0f) << "slow enough as it is";
}

}  // namespace
