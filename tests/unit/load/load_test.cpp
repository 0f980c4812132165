// SPDX-License-Identifier: MIT
// A good file arrives in struct cb_config as it is written. What is refused: refuse_test.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/support/config_fixture.h"

extern "C" {
#include "firmware/terms/kinds.h"
#include "firmware/wire/number.h"
#include "tests/support/ppoly_search.h"
}

using namespace compbox_test;
using json = nlohmann::ordered_json;

namespace {

cb_config loaded_config(const std::string &text) {
    const auto got = load(text);
    EXPECT_EQ(got.error, CB_OK) << got.text << ", line " << got.line;
    EXPECT_EQ(got.text, "");
    return *got.config;
}

TEST(config_load, small_sections_of_the_example) {
    const cb_config c = loaded_config(full_example);
    EXPECT_EQ(c.revision, 7u);
    EXPECT_STREQ(c.machine, "gantry 14 m");
    EXPECT_EQ(c.period_us, 30000u);
    EXPECT_EQ(c.lead_us, 45000u);
    EXPECT_EQ(c.hold_us, 500000u);
    EXPECT_EQ(c.ramp_um_per_s, 50.0f);
    EXPECT_EQ(c.signals_count, 4);
    EXPECT_EQ(c.terms_count, 4);
    EXPECT_EQ(c.outputs_count, 4);
    EXPECT_EQ(c.channels_count, 3);
    EXPECT_EQ(c.pairs_count, 1);
}

TEST(config_load, plc_of_the_example) {
    const cb_plc_config plc = loaded_config(full_example).plc;
    EXPECT_EQ(plc.profile, CB_PROFILE_SINUMERIK_840D);
    EXPECT_EQ(plc.exchange, CB_EXCHANGE_FC3_FC16);
    EXPECT_EQ(plc.transport, CB_TRANSPORT_TCP);
    EXPECT_STREQ(plc.host, "127.0.0.1");
    EXPECT_EQ(plc.port, 1502);
    EXPECT_EQ(plc.unit, 1);
    EXPECT_EQ(plc.read.start, 0);
    EXPECT_EQ(plc.read.count, 32);
    EXPECT_FALSE(plc.read.counters);
    EXPECT_EQ(plc.write.start, 100);
    EXPECT_EQ(plc.write.count, 16);
    EXPECT_TRUE(plc.write.counters);
    EXPECT_EQ(plc.control, 0);
    EXPECT_EQ(plc.plc_heartbeat, 1);
    EXPECT_EQ(plc.status, 1) << "an index in the block, not an address";
    EXPECT_EQ(plc.box_heartbeat, 2);
    EXPECT_EQ(plc.heartbeat_timeout_ms, 200u);
    EXPECT_EQ(plc.referenced_mask, 0x8012);
}

TEST(config_load, signals_of_the_example) {
    const cb_config c = loaded_config(full_example);
    const cb_signal_config &x = c.signals[0], &t1 = c.signals[1], &t2 = c.signals[2],
                           &b = c.signals[3];
    EXPECT_STREQ(x.name, "X");
    EXPECT_STREQ(x.unit, "mm");
    EXPECT_EQ(x.source, CB_SOURCE_PLC);
    EXPECT_EQ(x.type, CB_NUMBER_INT32);
    EXPECT_EQ(x.reg, 8);
    EXPECT_EQ(x.scale, 0.0001f);
    EXPECT_EQ(x.zero, 0.0f);
    EXPECT_EQ(x.min, 0.0f);
    EXPECT_EQ(x.max, 14300.0f);
    EXPECT_EQ(x.max_rate_per_s, 0.0f) << "unlimited";
    EXPECT_EQ(x.max_age_ms, 90u) << "three periods";
    EXPECT_TRUE(x.essential);
    EXPECT_TRUE(x.leads);

    EXPECT_EQ(t1.source, CB_SOURCE_CAN);
    EXPECT_EQ(t1.can_id, 0x181u);
    EXPECT_EQ(t1.reg, 2);
    EXPECT_EQ(t1.type, CB_NUMBER_INT16_LE);
    EXPECT_EQ(t1.max_rate_per_s, 2.0f);
    EXPECT_EQ(t1.max_age_ms, 2500u);
    EXPECT_FALSE(t1.essential);
    EXPECT_FALSE(t1.leads);

    EXPECT_STREQ(t2.unit, "°C");
    EXPECT_EQ(t2.source, CB_SOURCE_BUS);
    EXPECT_EQ(t2.bus_unit, 5);
    EXPECT_EQ(t2.reg, 7);
    EXPECT_EQ(t2.zero, -20.0f);
    EXPECT_EQ(t2.max_age_ms, 2000u) << "default of sensors";
    EXPECT_TRUE(t2.essential) << "as the file says";

    EXPECT_EQ(b.type, CB_NUMBER_FLOAT32);
    EXPECT_EQ(b.scale, 1.0f);
    EXPECT_EQ(b.reg, 10);
    EXPECT_TRUE(b.essential) << "deg";
    EXPECT_TRUE(b.leads);
}

// The pool holds the curves themselves: the values at positions worked out by hand.
TEST(config_load, curves_of_the_example) {
    const cb_config c = loaded_config(full_example);
    const auto value = [&](int term, float x) {
        const cb_curve_config &curve = c.terms[term].as.curve;
        const float *pool = c.pool + curve.pool;
        const cb_ppoly ppoly = {pool, pool + curve.spans + 1, curve.spans_per_unit, curve.spans,
                                curve.degree};
        return searched_value(&ppoly, x);
    };
    EXPECT_EQ(c.terms[0].type, CB_TERM_BSPLINE);
    EXPECT_EQ(c.terms[0].as.curve.signal, 0);
    EXPECT_EQ(c.terms[0].as.curve.spans, 2);
    EXPECT_EQ(c.terms[0].as.curve.degree, 3);
    EXPECT_EQ(value(0, 0), 0.0f);
    EXPECT_NEAR(value(0, 14300), 10.0f, 1e-4f) << "a clamped spline ends at its last point";
    EXPECT_EQ(c.terms[1].type, CB_TERM_POLYLINE);
    EXPECT_EQ(c.terms[1].as.curve.pool, 2 + 1 + 2 * 4) << "right behind the spline";
    EXPECT_FLOAT_EQ(value(1, 60), 3.0f);
    EXPECT_FLOAT_EQ(value(1, 370), 4.5f);
    EXPECT_EQ(value(1, 1000), -3.0f);

    const cb_curve_config &kt = c.terms[2].as.curve;
    EXPECT_EQ(c.terms[2].type, CB_TERM_POLYNOMIAL);
    EXPECT_EQ(kt.signal, 1);
    EXPECT_EQ(kt.degree, 2);
    EXPECT_EQ(kt.center, 20.0f);
    EXPECT_EQ(kt.inverse_half_range, 0.02f);
    EXPECT_EQ(kt.from, 0.0f);
    EXPECT_EQ(kt.to, 80.0f);
    EXPECT_EQ(c.pool[kt.pool], 1.0f);
    EXPECT_EQ(c.pool[kt.pool + 1], -0.5f);
    EXPECT_EQ(c.pool[kt.pool + 2], 0.25f);

    const cb_curve_config &kb = c.terms[3].as.curve;
    EXPECT_EQ(kb.center, 0.0f);
    EXPECT_EQ(kb.inverse_half_range, 1.0f);
    EXPECT_EQ(kb.from, -180.5f) << "the signal's own range";
    EXPECT_EQ(kb.to, 180.5f);
    EXPECT_EQ(c.pool_count, kb.pool + 1);
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(c.terms[i].first_output, i);
        EXPECT_EQ(c.terms[i].outputs, 1);
        EXPECT_EQ(c.outputs[i].term, i);
    }
    EXPECT_STREQ(c.outputs[2].name, "KT");
}

TEST(config_load, channels_of_the_example) {
    const cb_config c = loaded_config(full_example);
    const cb_channel_config &z = c.channels[0], &y1 = c.channels[1], &y2 = c.channels[2];
    EXPECT_STREQ(z.name, "Z");
    EXPECT_EQ(z.sum_count, 2);
    EXPECT_EQ(z.sum[0], 0);
    EXPECT_EQ(z.sum[1], 2);
    EXPECT_EQ(z.limit_um, 300.0f);
    EXPECT_EQ(z.error_um, 400.0f);
    EXPECT_EQ(z.slew_um_per_s, 500.0f);
    EXPECT_EQ(z.deadband_um, 0.5f);
    EXPECT_EQ(z.sign, -1);
    EXPECT_EQ(z.reg, 4);
    EXPECT_EQ(z.type, CB_NUMBER_INT32);
    EXPECT_EQ(z.scale, 0.01f);
    EXPECT_TRUE(z.has_applied);
    EXPECT_EQ(z.applied_reg, 24);
    EXPECT_EQ(y1.sign, 1) << "default";
    EXPECT_EQ(y1.deadband_um, 0.0f) << "default";
    EXPECT_FALSE(y1.has_applied);
    EXPECT_EQ(y2.reg, 7);
    EXPECT_EQ(c.pairs[0].a, 1);
    EXPECT_EQ(c.pairs[0].b, 2);
    EXPECT_EQ(c.pairs[0].max_difference_um, 50.0f);
}

// Two loads into memory that held other things before: the CRC of the config depends on it.
TEST(config_load, every_byte_is_determined_by_the_text) {
    cb_load_scratch scratch;
    cb_message message;
    auto a = std::make_unique<cb_config>(), b = std::make_unique<cb_config>();
    std::memset(a.get(), 0x55, sizeof *a);
    std::memset(b.get(), 0xAA, sizeof *b);
    std::memset(&scratch, 0xAA, sizeof scratch);
    const auto text = full_example;
    ASSERT_EQ(cb_config_load(a.get(), text.data(), text.size(), &every_target, &scratch, &message),
              CB_OK);
    ASSERT_EQ(cb_config_load(b.get(), text.data(), text.size(), &every_target, &scratch, &message),
              CB_OK);
    EXPECT_EQ(std::memcmp(a.get(), b.get(), sizeof *a), 0);
}

json reversed(const json &value) {
    if (!value.is_object()) {
        json list = value;
        if (value.is_array())
            for (auto &element : list) element = reversed(element);
        return list;
    }
    json result = json::object();
    std::vector<std::pair<std::string, json>> members;
    for (const auto &[key, member] : value.items()) members.emplace_back(key, reversed(member));
    for (auto it = members.rbegin(); it != members.rend(); ++it) result[it->first] = it->second;
    return result;
}

// A float32 in mm has no units that a pair could need room for.
TEST(config_load, a_pair_of_float32_may_be_as_close_as_one_likes) {
    std::string text = with(R"("plc": 106, "type": "int16", "scale": 1})",
                            R"("plc": 106, "type": "float32", "scale": 1000})");
    text = with(R"("plc": 107, "type": "int16", "scale": 0.1})",
                R"("plc": 108, "type": "float32", "scale": 1000})", text);
    text = with("\"max_difference_um\": 50", "\"max_difference_um\": 0.5", text);
    const cb_config c = loaded_config(text);
    ASSERT_EQ(c.pairs_count, 1);
    EXPECT_EQ(c.pairs[0].max_difference_um, 0.5f);
}

TEST(config_load, the_order_of_keys_and_sections_does_not_matter) {
    const cb_config straight = loaded_config(full_example);
    const std::string backward = reversed(json::parse(full_example)).dump(1, '\t');
    ASSERT_LT(backward.find("\"pairs\""), backward.find("\"channels\": ["));
    const cb_config turned = loaded_config(backward);
    EXPECT_EQ(std::memcmp(&straight, &turned, sizeof straight), 0);
}

TEST(config_load, escapes_in_keys_and_names_are_resolved) {
    const cb_config straight = loaded_config(full_example);
    std::string text = with("\"revision\"", "\"re\\u0076ision\"");
    text = with("\"name\": \"T1\"", "\"n\\u0061me\": \"\\u0054\\u0031\"", text);
    const cb_config escaped = loaded_config(text);
    EXPECT_EQ(std::memcmp(&straight, &escaped, sizeof straight), 0);
}

TEST(config_load, line_ends_of_windows_do_no_harm) {
    const cb_config straight = loaded_config(full_example);
    std::string text;
    for (const char c : full_example) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
    const cb_config windows = loaded_config(text);
    EXPECT_EQ(std::memcmp(&straight, &windows, sizeof straight), 0);
}

TEST(config_load, periods_and_ages) {
    const auto config_of = [](const std::string &period) {
        return loaded_config(with("\"period_ms\": 30", "\"period_ms\": " + period));
    };
    EXPECT_EQ(config_of("12.5").period_us, 12500u);
    EXPECT_EQ(config_of("12.5").signals[0].max_age_ms, 38u) << "37.5, rounded up";
    EXPECT_EQ(config_of("1").period_us, 1000u);
    EXPECT_EQ(config_of("33.333").period_us, 33333u);
    EXPECT_EQ(loaded_config(with("\"hold_ms\": 500", "\"hold_ms\": 60000")).hold_us, 60000000u);
    EXPECT_EQ(loaded_config(with(", \"lead_ms\": 45", "")).lead_us, 0u);
}

// A bus that reads less often than every 2 s: by default its signals are not stale between two
// readings.
TEST(config_load, ages_of_a_slow_bus) {
    const auto age_ms = [](const std::string &every) {
        return loaded_config(with("\"every_ms\": 250", "\"every_ms\": " + every))
            .signals[2]
            .max_age_ms;
    };
    EXPECT_EQ(age_ms("250"), 2000u);
    EXPECT_EQ(age_ms("666"), 2000u);
    EXPECT_EQ(age_ms("1000"), 3000u);
    EXPECT_EQ(age_ms("60000"), 180000u);
}

TEST(config_load, hosts) {
    for (const char *host :
         {"10.0.0.255", "::1", "fe80::1:2", "2001:0db8:0000:0000:0000:0000:0000:0001",
          "::ffff:192.168.0.1", "::"}) {
        EXPECT_STREQ(loaded_config(with("127.0.0.1", host)).plc.host, host);
    }
    const cb_plc_config plc = loaded_config(with(", \"port\": 1502, \"unit\": 1", "")).plc;
    EXPECT_EQ(plc.port, 502);
    EXPECT_EQ(plc.unit, 1);
}

TEST(config_load, devices_below_dev) {
    for (const char *device : {"/dev/.x", "/dev/..x", "/dev/serial/by-id/a..b", "/dev/a./b"})
        EXPECT_STREQ(loaded_config(with("/dev/ttyS1", device)).buses[0].serial.device, device);
}

TEST(config_load, extended_can_identifiers_are_marked) {
    EXPECT_EQ(loaded_config(with("0x181", "0x7ff")).signals[1].can_id, 0x7ffu);
    EXPECT_EQ(loaded_config(with("0x181", "0x800")).signals[1].can_id, 0x80000800u);
    EXPECT_EQ(loaded_config(with("0x181", "0x1FFFFFFF")).signals[1].can_id, 0x9fffffffu);
}

TEST(config_load, default_of_referenced_bits_is_bit_1) {
    const auto text = with(",\n    \"referenced_bits\": [1, 4, 15]", "");
    EXPECT_EQ(loaded_config(text).plc.referenced_mask, 1u << 1);
}

// Reading one number twice is fine, as two signals.
TEST(config_load, the_same_number_may_be_read_twice) {
    std::string text = with("{\"name\": \"B\"", R"({"name": "X_again", "unit": "mm", "plc": 8,
        "type": "int32", "scale": 0.0002, "min": 0, "max": 14300}, {"name": "B")");
    const cb_config c = loaded_config(text);
    EXPECT_EQ(c.signals[3].reg, 8);
}

TEST(config_load, every_profile_and_exchange_that_is_allowed) {
    const auto plc_of = [](const std::string &profile, const std::string &exchange) {
        const std::string coarse = with("\"scale\": 0.01", "\"scale\": 0.1");
        return loaded_config(with("fc3+fc16", exchange, with("sinumerik-840d", profile, coarse)))
            .plc;
    };
    EXPECT_EQ(plc_of("generic", "fc23").exchange, CB_EXCHANGE_FC23);
    EXPECT_EQ(plc_of("fanuc", "fc23").profile, CB_PROFILE_FANUC);
    EXPECT_EQ(plc_of("fanuc", "fc3+fc16").exchange, CB_EXCHANGE_FC3_FC16);
    EXPECT_EQ(loaded_config(with("\"exchange\": \"fc3+fc16\",", "")).plc.exchange,
              CB_EXCHANGE_FC3_FC16);
}

}  // namespace
