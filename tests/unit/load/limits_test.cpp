// SPDX-License-Identifier: MIT
// Every maximum of limits.h: reached, and exceeded by one.
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"

extern "C" {
#include "firmware/box/channels.h"
#include "firmware/config/grid.h"
#include "models/bpnet.h"
}

using namespace compbox_test;
using json = nlohmann::ordered_json;

namespace {

json example() {
    return json::parse(full_example);
}

// Loads and looks at the invariants too; the message, or "" when it is good.
std::string message(const json &value) {
    const auto got = load(value.dump());
    if (got.error == CB_OK) {
        EXPECT_EQ(invariants(*got.config).broken, "");
    }
    return got.text;
}

std::string numbered(const char *letter, size_t i) {
    return letter + std::to_string(i);
}

json polynomial(const std::string &name, size_t count) {
    json term = {{"name", name}, {"type", "polynomial"}, {"signal", "X"}, {"half_range", 14300}};
    term["coefficients"] = std::vector<double>(count, 0.5);
    return term;
}

json polyline(const std::string &name, size_t count) {
    json term = {{"name", name}, {"type", "polyline"}, {"signal", "X"}};
    for (size_t i = 0; i < count; ++i) {
        term["positions"].push_back(i);
        term["values"].push_back(0.25 * static_cast<double>(i % 7));
    }
    return term;
}

json bspline(const std::string &name, size_t points, int degree) {
    json term = {{"name", name}, {"type", "bspline"}, {"signal", "X"}, {"degree", degree}};
    for (size_t i = 0; i < points; ++i) term["control_points"].push_back(i % 5);
    for (size_t i = 0; i < points + static_cast<size_t>(degree) + 1; ++i)
        term["knots"].push_back(i);
    return term;
}

TEST(config_limits, signals) {
    json file = example();
    while (file["signals"].size() < CB_MAX_SIGNALS)
        file["signals"].push_back({{"name", numbered("s", file["signals"].size())},
                                   {"unit", "degC"},
                                   {"can", "0x200"},
                                   {"min", 0},
                                   {"max", 1}});
    EXPECT_EQ(message(file), "");
    file["signals"].push_back(file["signals"].back());
    EXPECT_EQ(message(file), "signals[64]: the box has room for 64 signals, and this is one more");
}

// 327.67 / 0.01 is 32767.002 in float32.
TEST(config_limits, a_limit_that_takes_the_whole_register) {
    json file = example();
    json &channel = file["channels"][2];
    channel["scale"] = 0.01;
    channel["limit_um"] = channel["error_um"] = 327.67;
    EXPECT_EQ(message(file), "");
    cb_channel_state states[CB_MAX_CHANNELS] = {};
    std::uint16_t registers[CB_MAX_WRITE_REGISTERS] = {};
    const auto got = load(file.dump());
    const cb_channel_config &loaded = got.config->channels[2];
    states[2].output_um = cb_channel_nearest(&loaded, 1000.0f);
    cb_channels_encode(got.config.get(), states, registers);
    EXPECT_EQ(registers[loaded.reg], 32767);
    channel["limit_um"] = channel["error_um"] = 327.68;
    EXPECT_EQ(message(file),
              "channels[2].limit_um: 327.68 µm in units of 0.01 µm (scale) does not fit into "
              "\"int16\"");
}

TEST(config_limits, a_slope_and_positions_that_take_the_whole_register) {
    json file = example();
    file["signals"][0]["max"] = 327.67;
    json &tangent = file["channels"][0]["tangent"];
    tangent = {{"signal", "X"},        {"slope_plc", 108},          {"slope_type", "int16"},
               {"slope_scale", 1e-6},  {"slope_limit", 0.032767},   {"slope_slew_per_s", 0.05},
               {"reference_plc", 110}, {"reference_type", "int16"}, {"reference_scale", 0.01}};
    EXPECT_EQ(message(file), "");
    tangent["slope_limit"] = 0.032768;
    EXPECT_EQ(message(file),
              "channels[0].tangent.slope_limit: 0.032768 in units of 1e-06 (slope_scale) does not "
              "fit into \"int16\"");
    tangent["slope_limit"] = 0.03;
    file["signals"][0]["max"] = 327.68;
    EXPECT_EQ(message(file),
              "channels[0].tangent.reference_type: positions of X in units of 0.01 "
              "(reference_scale) do not fit into \"int16\"");
}

TEST(config_limits, terms) {
    json file = example();
    while (file["terms"].size() < CB_MAX_TERMS)
        file["terms"].push_back(polynomial(numbered("t", file["terms"].size()), 1));
    EXPECT_EQ(message(file), "");
    file["terms"].push_back(polynomial("one_more", 1));
    EXPECT_EQ(message(file), "terms[64]: the box has room for 64 terms, and this is one more");
}

TEST(config_limits, branches) {
    json file = example();
    for (size_t i = 0; i < CB_MAX_BRANCHES; ++i) {
        json term = polyline(numbered("d", i), 2);
        term["backward"] = {{"positions", {0, 1}}, {"values", {0, 1}}};
        term["reversal_mm"] = 1;
        file["terms"].push_back(term);
    }
    EXPECT_EQ(message(file), "");
    json term = file["terms"].back();
    term["name"] = "one_more";
    file["terms"].push_back(term);
    EXPECT_EQ(message(file),
              "terms[36].backward: the box has room for 32 curves with a branch backward");
}

TEST(config_limits, channels_and_the_write_block) {
    json file = example();
    file["plc"]["write"]["count"] = CB_MAX_WRITE_REGISTERS;
    while (file["channels"].size() < CB_MAX_CHANNELS) {
        json channel = file["channels"][0];
        channel.erase("applied");
        channel["name"] = numbered("c", file["channels"].size());
        channel["plc"] =
            100 + CB_MAX_WRITE_REGISTERS - 1 - 2 * (CB_MAX_CHANNELS - file["channels"].size());
        file["channels"].push_back(channel);
    }
    EXPECT_EQ(message(file), "");
    file["channels"].push_back(file["channels"].back());
    EXPECT_EQ(message(file),
              "channels[16]: the box has room for 16 channels, and this is one more");
    file["plc"]["write"]["count"] = CB_MAX_WRITE_REGISTERS + 1;
    EXPECT_EQ(message(file), "plc.write.count: 122 is outside the range of 2 to 121");
}

TEST(config_limits, sums) {
    json file = example();
    json &sum = file["channels"][0]["sum"];
    sum = json::array();
    while (sum.size() < CB_MAX_SUM) {
        file["terms"].push_back(polynomial(numbered("t", sum.size()), 1));
        sum.push_back(numbered("t", sum.size()));
    }
    EXPECT_EQ(message(file), "");
    sum.push_back("EZX");
    EXPECT_EQ(
        message(file),
        "channels[0].sum[32]: the box has room for 32 terms in one sum, and this is one more");
}

TEST(config_limits, pairs) {
    json file = example();
    file["plc"]["write"]["count"] = CB_MAX_WRITE_REGISTERS;
    for (json &channel : file["channels"]) channel.erase("applied");
    file["channels"] = json::array({file["channels"][1]});
    for (int i = 1; i < CB_MAX_CHANNELS; ++i) {
        json channel = file["channels"][0];
        channel["name"] = numbered("c", static_cast<size_t>(i));
        channel["plc"] = 110 + i;
        file["channels"].push_back(channel);
    }
    file["pairs"] = json::array();
    for (size_t i = 0; i < CB_MAX_CHANNELS; i += 2)
        file["pairs"].push_back(
            {{"channels", {file["channels"][i]["name"], file["channels"][i + 1]["name"]}},
             {"max_difference_um", 2}});
    ASSERT_EQ(file["pairs"].size(), static_cast<size_t>(CB_MAX_PAIRS));
    EXPECT_EQ(message(file), "");
    file["pairs"].push_back(file["pairs"][0]);
    EXPECT_EQ(message(file), "pairs[8]: the box has room for 8 pairs, and this is one more");
}

TEST(config_limits, the_read_block) {
    json file = example();
    file["plc"]["read"] = {{"start", 65536 - CB_MAX_READ_REGISTERS},
                           {"count", CB_MAX_READ_REGISTERS}};
    file["plc"]["control"] = 65534;
    file["plc"]["plc_heartbeat"] = 65535;
    file["channels"][0].erase("applied");
    file["signals"][0]["plc"] = 65532;
    file["signals"][3]["plc"] = 65536 - CB_MAX_READ_REGISTERS;
    EXPECT_EQ(message(file), "");
    file["plc"]["read"]["start"] = 65536 - CB_MAX_READ_REGISTERS + 1;
    EXPECT_EQ(message(file), "plc.read.count: 125 registers from 65412 on end above 65535");
}

TEST(config_limits, points_of_a_curve) {
    for (const int degree : {1, 3, 5}) {
        json file = example();
        file["terms"][0] = bspline("EZX", CB_MAX_CURVE_POINTS, degree);
        EXPECT_EQ(message(file), "");
        file["terms"][0] = bspline("EZX", CB_MAX_CURVE_POINTS + 1, degree);
        EXPECT_EQ(message(file),
                  "terms[0].control_points[1024]: a list of numbers here holds at most 1024");
        file["terms"][0] = bspline("EZX", CB_MAX_CURVE_POINTS, degree);
        for (int i = degree; i <= 6; ++i) file["terms"][0]["knots"].push_back(99999);
        EXPECT_EQ(message(file), "terms[0].knots[1030]: a list of numbers here holds at most 1030");
    }
    json file = example();
    file["terms"][1] = polyline("EYX", CB_MAX_CURVE_POINTS);
    EXPECT_EQ(message(file), "");
    file["terms"][1] = polyline("EYX", CB_MAX_CURVE_POINTS + 1);
    EXPECT_EQ(message(file), "terms[1].positions[1024]: a list of numbers here holds at most 1024");
    file["terms"][1] = polynomial("EYX", 16);
    EXPECT_EQ(message(file), "");
    file["terms"][1] = polynomial("EYX", 17);
    EXPECT_EQ(message(file), "terms[1].coefficients[16]: a list of numbers here holds at most 16");
}

// 8192 floats: two polylines of 1022 points take 3064 each, one of 688 takes 2062, and 2 are left.
TEST(config_limits, the_pool) {
    json file = example();
    file["terms"] = {polyline("EZX", 1022), polyline("EYX", 1022), polyline("KB", 688),
                     polynomial("KT", 2)};
    EXPECT_EQ(message(file), "");
    EXPECT_EQ(load(file.dump()).config->pool_count, CB_POOL_FLOATS);
    file["terms"].push_back(polynomial("last", 1));
    EXPECT_EQ(message(file),
              "terms[4]: this needs 1 floats, and of the box's 8192 only 0 are left");
    file["terms"].erase(3);
    file["terms"][3] = bspline("KT", 5, 3);
    EXPECT_EQ(message(file),
              "terms[3]: this needs 11 floats, and of the box's 8192 only 2 are left");
}

// The weights of a network fit, and the ranges of its inputs no longer: 4 floats each.
TEST(config_limits, the_pool_for_a_network) {
    const json net = json::parse(R"({"name": "net", "type": "bpnet", "outputs": ["n"],
        "activation": "tansig", "inputs": ["T1"], "hidden_weights": [[1]], "hidden_bias": [0],
        "output_weights": [[1]], "output_bias": [0], "input_min": [0], "input_max": [50]})");
    const size_t weights = cb_bpnet_floats(1, 1, 1, false);
    json file = example();
    file["terms"] = {polyline("EZX", 1022), polyline("EYX", 1022), polyline("KB", 680),
                     polynomial("KT", 26 - weights - 4), net};
    EXPECT_EQ(message(file), "");
    file["terms"][3] = polynomial("KT", 26 - weights - 3);
    EXPECT_EQ(message(file),
              "terms[4]: this needs 4 floats, and of the box's 8192 only 3 are left");
}

TEST(config_limits, a_cubic_of_twenty_points_takes_86_floats) {
    json file = example();
    json spline = bspline("EZX", 20, 3);
    spline["knots"] = {0, 0, 0, 0};
    for (int i = 1; i <= 16; ++i) spline["knots"].push_back(i);
    for (int i = 0; i < 4; ++i) spline["knots"].push_back(17);
    file["terms"] = {spline, polynomial("EYX", 1), polynomial("KT", 1), polynomial("KB", 1)};
    ASSERT_EQ(message(file), "");
    EXPECT_EQ(load(file.dump()).config->terms[1].as.curve.pool, 86);
}

TEST(config_limits, names_and_texts) {
    json file = example();
    file["signals"][1]["name"] = std::string(CB_NAME_SIZE - 1, 'n');
    file["terms"][2]["signal"] = std::string(CB_NAME_SIZE - 1, 'n');
    file["machine"]["name"] = std::string(39, 'm');
    file["signals"][1]["unit"] = "1234567";
    EXPECT_EQ(message(file), "");
    file["machine"]["name"] = std::string(40, 'm');
    EXPECT_EQ(message(file),
              "machine.name: \"" + std::string(40, 'm') + "\" is longer than 39 bytes");
}

TEST(config_limits, size_of_the_file) {
    std::string text = full_example;
    text.resize(CB_MAX_TEXT_BYTES, ' ');
    EXPECT_EQ(load(text).error, CB_OK);
    text += ' ';
    const auto got = load(text);
    EXPECT_EQ(got.error, CB_ERROR_TOO_LARGE);
    EXPECT_EQ(got.text, "the file has 131041 bytes, more than the 131040 that the box holds");
    EXPECT_EQ(got.line, 0u);
}

// Processor time of this thread; the shortest of three. A machine that stands still adds nothing.
double seconds_of_loading(const std::string &text) {
    const auto now_s = [] {
        timespec now{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    };
    double shortest_s = 1e9;
    for (int i = 0; i < 3; ++i) {
        const double begin_s = now_s();
        load(text);
        shortest_s = std::min(shortest_s, now_s() - begin_s);
    }
    return shortest_s;
}

// Whatever fills a file, and wherever the mistake is: eight times the length takes about eight
// times as long, where a quadratic step would take 64 times.
TEST(config_limits, large_files_are_read_in_linear_time) {
    const auto check = [](const auto &text_of) {
        const size_t room = CB_MAX_TEXT_BYTES - full_example.size() - 10;
        const double short_s = seconds_of_loading(text_of(room / 8));
        EXPECT_LT(seconds_of_loading(text_of(room)), 24 * short_s);
    };
    const auto many = [](size_t room) {
        std::string text = "[1";
        while (text.size() + 3 < room) text += ",1";
        return text;
    };
    const auto keys = [](size_t room) {
        std::string text = "{\"a0\": 0";
        for (int i = 0; text.size() < room - 20; ++i) text += ", \"a" + std::to_string(i) + "\": 1";
        return text + "}";
    };
    const auto digits = [](size_t room) { return "\"revision\": " + std::string(room, '1'); };
    const auto letters = [](size_t room) { return "\"" + std::string(room - 2, 'x') + "\""; };
    check([&](size_t room) { return with("\"nobody\"", many(room) + "]"); });
    check([&](size_t room) { return with("[0, 240, 500]", many(room) + "]"); });
    check([&](size_t room) { return with("\"nobody\"", many(room) + ",]"); });
    check([&](size_t room) { return with("\"nobody\"", letters(room)); });
    check([&](size_t room) { return with("\"revision\": 7", digits(room)); });
    check([](size_t room) { return std::string(room, '\n'); });
    check([&](size_t room) { return with("\"nobody\"", keys(room)); });
    check(keys);
}

}  // namespace
