// SPDX-License-Identifier: MIT
#include "host-tools/watch/lines.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace compbox::watch {
namespace {

constexpr window large = {200, 400};

json example() {
    return json::parse(
        R"({"snapshot": 1, "unix_s": 1795436764.4, "machine": "MILL 4", "revision": 7,
      "crc": "1a2b3c4d", "version": "0.1.0", "plc": "10.0.0.5:502", "mode": "HOLD",
      "reason": "an essential signal is missing or implausible",
      "cause": {"text": "signal X reads 20000 mm and its max is 14300", "of": "signal", "name": "X"},
      "signals": [{"name": "X", "unit": "mm", "value": 14299.5, "age_ms": 90, "state": "refused",
                   "implausible": 3, "stale": 0},
                  {"name": "T1", "unit": "degC", "value": null, "age_ms": null, "state": "never"}],
      "terms": [{"name": "EXX", "value": 20.25}, {"name": "EXX_thermal", "value": -57.5}],
      "channels": [{"name": "X", "demand_um": 37.25, "output_um": 37.2, "applied_um": null,
                    "limit_um": 40, "limit_used": 0.93, "slewed": true, "limited": 5, "excessive": 0,
                    "terms": ["EXX", "EXX_thermal"]}],
      "counters": {"cycles": 1000, "reads_failed": 2, "reads_torn": 0},
      "jitter_us": {"p50": 5, "p99": 31, "max": 80}, "exchange_us": {"p50": 900, "p99": 1200, "max": 1500}})");
}

std::vector<std::string> texts(const std::vector<line> &lines) {
    std::vector<std::string> all;
    for (const line &one : lines) all.push_back(text_of(one, false));
    return all;
}

std::string all_of(const json &box, const std::string &why_not = "",
                   const std::vector<json> &events = {}) {
    std::string text;
    for (const std::string &one : texts(lines_of(box, why_not, events, large))) text += one + "\n";
    return text;
}

bool has(const std::string &text, const std::string &part) {
    return text.find(part) != std::string::npos;
}

TEST(watch, shows_mode_cause_channels_shares_signals_and_counters) {
    const std::string text = all_of(example());
    EXPECT_TRUE(has(text, "MILL 4   revision 7 (1a2b3c4d)   compboxd 0.1.0   PLC 10.0.0.5:502"));
    EXPECT_TRUE(has(text, "HOLD     an essential signal is missing or implausible\n"));
    EXPECT_TRUE(has(text, "         signal X reads 20000 mm and its max is 14300\n"));
    EXPECT_TRUE(has(text,
                    "X                     37.25        37.20            –        40.00 "
                    "[          |######### ] moves to its demand 5 cycles limited\n"))
        << text;
    EXPECT_TRUE(has(text, "X                     37.25 = -( EXX_thermal -57.50  EXX +20.25  )\n"))
        << text;
    EXPECT_TRUE(has(text, "X                   14299.5 mm        90 ms refused  3 implausible\n"))
        << text;
    EXPECT_TRUE(has(text, "T1                        – degC          – never\n")) << text;
    EXPECT_TRUE(has(text, "cycles 1000   reads_failed 2\n")) << text;
    EXPECT_FALSE(has(text, "reads_torn"));
}

TEST(watch, has_the_newest_event_first) {
    const std::string text = all_of(
        example(), "", {{{"unix_s", 0}, {"text", "first"}}, {{"unix_s", 60}, {"text", "second"}}});
    EXPECT_TRUE(has(text, "1970-01-01 00:01:00 UTC  second\n1970-01-01 00:00:00 UTC  first\n"))
        << text;
}

TEST(watch, says_why_no_box_runs) {
    EXPECT_EQ(all_of(nullptr, "the snapshot is missing"), "the snapshot is missing\n");
    const std::string text = all_of(example(), "the snapshot is 12 s old");
    EXPECT_EQ(text.find("the snapshot is 12 s old\n"), 0u);
    EXPECT_TRUE(has(text, "HOLD "));
}

TEST(watch, fits_into_the_terminal_and_says_what_is_left_out) {
    for (const std::size_t rows : {2u, 5u, 9u, 14u}) {
        for (const std::size_t columns : {1u, 20u, 79u}) {
            const auto lines = texts(lines_of(example(), "", {}, {rows, columns}));
            EXPECT_LE(lines.size(), rows);
            for (const std::string &one : lines) {
                const auto wide = std::count_if(one.begin(), one.end(),
                                                [](char byte) { return (byte & 0xC0) != 0x80; });
                EXPECT_LE(static_cast<std::size_t>(wide), columns);
            }
        }
    }
    const auto low = texts(lines_of(example(), "", {}, {5, 79}));
    EXPECT_EQ(low.front().find("MILL 4"), 0u);
    EXPECT_EQ(low.back(), fmt::format("and {} more lines: enlarge the terminal",
                                      lines_of(example(), "", {}, large).size() - 4));
}

// Whatever another program writes: no control character reaches the terminal, nothing throws.
TEST(watch, takes_members_of_any_type) {
    const json sound = example();
    json hostile = sound;
    hostile["machine"] = "\033[2J\033]0;owned\007";
    EXPECT_FALSE(has(all_of(hostile), "\033"));
    const json values = {nullptr, true, -1, 1e300, "x", json::array(), json::object()};
    for (const auto &[key, old] : sound.items()) {
        for (const json &value : values) {
            if (key == "signals" || key == "terms" || key == "channels") continue;
            hostile = sound;
            hostile[key] = value;
            EXPECT_TRUE(has(all_of(hostile), "channel"));
        }
    }
    for (const char *list : {"signals", "terms", "channels"}) {
        for (const auto &[key, old] : sound[list][0].items()) {
            if (key == "name") continue;
            for (const json &value : values) {
                hostile = sound;
                hostile[list][0][key] = value;
                EXPECT_TRUE(has(all_of(hostile), "channel"));
            }
        }
    }
}

TEST(watch, colours_do_not_change_the_text) {
    for (const line &one : lines_of(example(), "", {}, large)) {
        const std::string plain = text_of(one, false), coloured = text_of(one, true);
        std::string without;
        for (std::size_t i = 0; i < coloured.size(); ++i) {
            if (coloured[i] == '\033')
                i = coloured.find('m', i);
            else
                without += coloured[i];
        }
        EXPECT_EQ(without.substr(0, plain.size()), plain);
    }
    EXPECT_EQ(text_of({{"ACTIVE", tone::good}}, true), "\033[1;32mACTIVE\033[0m");
}

}  // namespace
}  // namespace compbox::watch
