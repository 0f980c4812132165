// SPDX-License-Identifier: MIT
#include "host-tools/uplink/texts.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace compbox::uplink {
namespace {

json example() {
    return json::parse(
        R"({"snapshot": 1, "unix_s": 1000.5, "machine": "MILL 4", "revision": 7, "crc": "1a2b3c4d",
      "version": "0.1.0", "mode": "HOLD", "reason": "an essential signal is missing or implausible",
      "cause": {"text": "signal X reads 20000 mm and its max is 14300", "value": 20000},
      "signals": [{"name": "T1", "unit": "degC", "value": 21.5}, {"name": "T2", "value": null}],
      "terms": [{"name": "EXX", "value": 20.25}],
      "channels": [{"name": "X", "demand_um": 37.25, "output_um": 37.2, "applied_um": null, "limit_um": 40}]})");
}

TEST(uplink_texts, a_name_is_one_level_of_a_topic) {
    EXPECT_EQ(topic_level("lathe-3"), "lathe-3");
    EXPECT_EQ(topic_level("a/b+c#d\n"), "a_b_c_d_");
    EXPECT_EQ(topic_level(""), "box");
}

TEST(uplink_texts, the_state_has_what_runs_and_why) {
    const json state = json::parse(state_text(example(), ""));
    EXPECT_EQ(
        state,
        json::parse(
            R"({"state": 1, "runs": true, "why_not": "", "machine": "MILL 4", "version": "0.1.0",
      "revision": 7, "crc": "1a2b3c4d", "mode": "HOLD", "reason": "an essential signal is missing or implausible",
      "cause": "signal X reads 20000 mm and its max is 14300"})"));
    EXPECT_EQ(json::parse(state_text(nullptr, "it is gone")),
              json::parse(R"({"state": 1, "runs": false, "why_not": "it is gone"})"));
    EXPECT_EQ(json::parse(with_time("{\"a\":1}", 2.5)), json::parse(R"({"a": 1, "unix_s": 2.5})"));
}

TEST(uplink_texts, the_same_state_is_the_same_text) {
    json later = example();
    later["unix_s"] = 2000;
    later["signals"][0]["value"] = 22;
    EXPECT_EQ(state_text(later, ""), state_text(example(), ""));
    later["mode"] = "RAMP";
    EXPECT_NE(state_text(later, ""), state_text(example(), ""));
}

TEST(uplink_texts, values_have_names) {
    EXPECT_EQ(
        json::parse(values_text(example())),
        json::parse(
            R"({"values": 1, "unix_s": 1000.5, "revision": 7, "mode": "HOLD", "signals": {"T1": 21.5, "T2": null},
      "terms": {"EXX": 20.25},
      "channels": {"X": {"demand_um": 37.25, "output_um": 37.2, "applied_um": null, "limit_um": 40}}})"));
}

// docs/uplink.md states its size.
TEST(uplink_texts, a_large_box_has_values_of_2_kB) {
    json box = example();
    const auto fill = [&](const char *list, int count) {
        const json one = box[list][0];
        box[list] = json::array();
        for (int i = 0; i < count; ++i) {
            box[list].push_back(one);
            box[list].back()["name"] = "thermometer_" + std::to_string(i);
        }
    };
    fill("signals", 32);
    fill("terms", 32);
    fill("channels", 8);
    EXPECT_NEAR(static_cast<double>(values_text(box).size()), 2190.0, 50.0)
        << values_text(box).size();
}

// Members of another program's file: of any type, or no UTF-8.
TEST(uplink_texts, takes_members_of_any_type) {
    const json sound = example();
    const json values = {nullptr, true, 1e300, "\xff\xfe", json::array(), json::object()};
    for (const auto &[key, old] : sound.items()) {
        if (key == "signals" || key == "terms" || key == "channels") continue;
        for (const json &value : values) {
            json hostile = sound;
            hostile[key] = value;
            EXPECT_TRUE(json::accept(state_text(hostile, "")));
            EXPECT_TRUE(json::accept(values_text(hostile)));
        }
    }
}

}  // namespace
}  // namespace compbox::uplink
