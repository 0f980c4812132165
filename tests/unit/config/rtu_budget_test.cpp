// SPDX-License-Identifier: MIT
// What a cycle takes on a serial line, counted by hand, and what the loader makes of it.
#include <gtest/gtest.h>

#include "tests/support/config_fixture.h"

extern "C" {
#include "firmware/config/rtu_budget.h"
}

using namespace compbox_test;

namespace {

const std::string tcp = R"("tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1})";

std::string on_line(const std::string &rtu, const std::string &exchange = "fc3+fc16") {
    std::string text = with(tcp, "\"rtu\": {\"device\": \"/dev/ttyS0\", " + rtu + "}");
    const std::string fc3 = "\"exchange\": \"fc3+fc16\"";
    text.replace(text.find(fc3), fc3.size(), "\"exchange\": \"" + exchange + "\"");
    const std::string profile = "sinumerik-840d";
    return text.replace(text.find(profile), profile.size(), "generic");
}

TEST(rtu_budget, the_loader_keeps_what_the_file_says) {
    const auto got = load(on_line(R"("baud": 230400, "parity": "none", "stop_bits": 2,
        "unit": 17, "slave_delay_ms": 3.5)"));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_plc_config &plc = got.config->plc;
    EXPECT_EQ(plc.transport, CB_TRANSPORT_RTU);
    EXPECT_STREQ(plc.serial.device, "/dev/ttyS0");
    EXPECT_EQ(plc.serial.line.baud, 230400u);
    EXPECT_EQ(plc.serial.line.parity, CB_PARITY_NONE);
    EXPECT_EQ(plc.serial.line.stop_bits, 2);
    EXPECT_EQ(plc.serial.slave_delay_us, 3500u);
    EXPECT_EQ(plc.unit, 17);
}

TEST(rtu_budget, what_the_file_leaves_out_is_8E1_unit_1_and_2_ms) {
    const auto got = load(on_line(R"("baud": 115200)"));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_plc_config &plc = got.config->plc;
    EXPECT_EQ(plc.serial.line.parity, CB_PARITY_EVEN);
    EXPECT_EQ(plc.serial.line.stop_bits, 1);
    EXPECT_EQ(plc.serial.slave_delay_us, 2000u);
    EXPECT_EQ(plc.unit, 1);
}

// Nothing shorter than the blocks could be read to see that no late reply is to come.
TEST(rtu_budget, blocks_of_two_and_three_registers_are_too_short_for_a_line) {
    const auto small = [](int read) {
        return R"({"format": "compbox/1", "revision": 1, "machine": {"name": "m", "axes": ["X"]},
  "cycle": {"period_ms": 30}, "plc": {"profile": "generic", "exchange": "fc3+fc16",
   "transport": {"rtu": {"device": "/dev/ttyS0", "baud": 115200}},
   "read": {"start": 0, "count": )" +
               std::to_string(read) + R"(}, "write": {"start": 100, "count": 3},
   "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101, "heartbeat_timeout_ms": 200},
  "signals": [{"name": "T", "unit": "degC", "bus": "b", "unit_id": 1, "register": 0, "type": "int16", "min": 0, "max": 50}],
  "buses": [{"name": "b", "rtu": {"device": "/dev/ttyS1", "baud": 9600}}],
  "terms": [{"name": "EXX", "type": "polyline", "signal": "T", "positions": [0, 50], "values": [0, 1]}],
  "channels": [{"name": "X", "sum": ["EXX"], "limit_um": 10, "error_um": 20, "slew_um_per_s": 5, "plc": 102,
   "type": "int16", "scale": 0.1}], "safety": {"hold_ms": 500, "ramp_um_per_s": 50}})";
    };
    const auto got = load(small(2));
    EXPECT_EQ(got.error, CB_ERROR_RANGE);
    EXPECT_NE(
        got.text.find(
            "plc.transport: on a serial line plc.read or plc.write needs at least 4 registers"),
        std::string::npos)
        << got.text;
    EXPECT_EQ(load(small(4)).error, CB_OK) << load(small(4)).text;
}

TEST(rtu_budget, a_bus_and_its_modules) {
    const auto got = load(full_example);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    ASSERT_EQ(got.config->buses_count, 1);
    const cb_bus_config &bus = got.config->buses[0];
    EXPECT_STREQ(bus.name, "pt100");
    EXPECT_STREQ(bus.serial.device, "/dev/ttyS1");
    EXPECT_EQ(bus.serial.line.baud, 9600u);
    EXPECT_EQ(bus.serial.slave_delay_us, 50000u);
    EXPECT_EQ(bus.every_us, 250000u);
    EXPECT_EQ(got.config->signals[2].bus, 0);
}

// The full example reads 32 registers and writes 16. 8E1 at 115 200 baud: 8 + 69 + 41 + 8
// characters of 95.49 µs, four silences of 1.75 ms, two delays.
TEST(rtu_budget, counts_every_character_silence_and_delay) {
    const auto two = load(on_line(R"("baud": 115200, "slave_delay_ms": 2)"));
    ASSERT_EQ(two.error, CB_OK) << two.text;
    EXPECT_NEAR(cb_rtu_cycle_us(&two.config->plc, &two.config->plc.serial.line),
                126 * 95.486 + 4 * 1750 + 2 * 2000, 4);
}

// fc23: 45 + 69 characters in one request; reading 32 and 16 after a loss takes 8 + 69 + 8 + 37.
TEST(rtu_budget, fc23_needs_time_to_read_both_blocks_after_a_loss) {
    const auto one = load(on_line(R"("baud": 115200, "slave_delay_ms": 0)", "fc23"));
    ASSERT_EQ(one.error, CB_OK) << one.text;
    const cb_rtu_line *line = &one.config->plc.serial.line;
    EXPECT_NEAR(cb_rtu_cycle_us(&one.config->plc, line), 114 * 95.486 + 2 * 1750, 4);
    EXPECT_NEAR(cb_rtu_longest_us(&one.config->plc, line), 122 * 95.486 + 4 * 1750, 4);
}

TEST(rtu_budget, the_slowest_rate_that_is_reported_is_taken_and_the_next_slower_is_not) {
    for (const std::string exchange : {"fc3+fc16", "fc23"}) {
        uint32_t recommended = 0;
        for (const uint32_t *baud = cb_usual_bauds; *baud != 0; ++baud) {
            const auto got = load(on_line("\"baud\": " + std::to_string(*baud), exchange));
            if (recommended == 0 && got.error != CB_OK) {
                const auto at = got.text.find("; ");
                ASSERT_NE(at, std::string::npos) << got.text;
                EXPECT_EQ(got.text.substr(at), "; 115200 baud is fast enough");
            } else {
                recommended = recommended == 0 ? *baud : recommended;
                EXPECT_EQ(got.error, CB_OK) << got.text;
            }
        }
        EXPECT_EQ(recommended, 115200u);
    }
}

}  // namespace
