// SPDX-License-Identifier: MIT
// CAN frames to samples, and the little of CANopen. Frames are written by hand from CiA 301 and
// SAE J1939; nothing here comes from the decoder.
#include <gtest/gtest.h>

extern "C" {
#include "firmware/signals/can.h"
#include "firmware/signals/canopen.h"
}
#include "tests/support/config_fixture.h"

namespace {

using compbox_test::full_example;
using compbox_test::load;
using compbox_test::with;

cb_can_frame frame(uint32_t id, std::initializer_list<int> bytes, int64_t time_us = 0) {
    cb_can_frame result = {id, static_cast<uint8_t>(bytes.size()), {}, time_us};
    size_t i = 0;
    for (int byte : bytes) result.data[i++] = static_cast<uint8_t>(byte);
    return result;
}

// A file whose signal T1 is replaced by these.
std::shared_ptr<cb_config> config_with(const std::string &signals) {
    const std::string t1 =
        R"({"name": "T1", "unit": "degC", "can": "0x181", "offset": 2, "type": "int16le", "scale": 0.1,
     "min": -10, "max": 90, "max_rate_per_s": 2, "max_age_ms": 2500})";
    const auto loaded = load(with(t1, signals));
    EXPECT_EQ(loaded.error, CB_OK) << loaded.text;
    return loaded.config;
}

std::string signal(const std::string &name, const std::string &keys) {
    return R"({"name": ")" + name + R"(", "unit": "degC", "min": -1e9, "max": 1e9, )" + keys + "}";
}

struct can : ::testing::Test {
    void use(const std::string &signals) {
        config = config_with(signals);
        cb_can_map_of(&map, config.get());
    }
    cb_can_taken take(const cb_can_frame &f) { return cb_can_take(&map, &f, &batch); }
    // The number of the signal called so, which must be in the batch once.
    float number(const std::string &name) {
        float found = -12345.0f;
        int times = 0;
        for (int i = 0; i < batch.count; ++i) {
            if (name != config->signals[batch.samples[i].signal].name) continue;
            found = batch.samples[i].raw;
            ++times;
        }
        EXPECT_EQ(times, 1) << name;
        return found;
    }
    std::shared_ptr<cb_config> config;
    cb_can_map map = {};
    cb_can_batch batch = {};
};

TEST_F(can, four_temperatures_of_one_tpdo) {
    use(signal("T1", R"("can": "0x181", "type": "int16le")") + "," +
        signal("A", R"("can": "0x181", "offset": 2, "type": "int16le")") + "," +
        signal("D", R"("can": "0x181", "offset": 4, "type": "uint16le")") + "," +
        signal("C", R"("can": "0x181", "offset": 6, "type": "int16")"));
    EXPECT_EQ(take(frame(0x181, {0x01, 0x02, 0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0x00}, 77)),
              CB_CAN_TAKEN);
    EXPECT_EQ(batch.count, 4);
    EXPECT_EQ(number("T1"), 0x0201);
    EXPECT_EQ(number("A"), -2);
    EXPECT_EQ(number("D"), 65535);
    EXPECT_EQ(number("C"), -256);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(batch.samples[i].time_us, 77);
}

TEST_F(can, wide_numbers_at_odd_bytes) {
    use(signal("T1", R"("can": "0x200", "offset": 1, "type": "int32le")") + "," +
        signal("A", R"("can": "0x201", "offset": 3, "type": "float32le")") + "," +
        signal("D", R"("can": "0x201", "offset": 3, "type": "float32")"));
    EXPECT_EQ(take(frame(0x200, {9, 0xFE, 0xFF, 0xFF, 0xFF})), CB_CAN_TAKEN);
    EXPECT_EQ(number("T1"), -2);
    EXPECT_EQ(take(frame(0x201, {0, 0, 0, 0x00, 0x00, 0xC0, 0x3F})), CB_CAN_TAKEN);
    EXPECT_EQ(number("A"), 1.5f);
}

TEST_F(can, identifiers_of_11_and_29_bits_are_different_ones) {
    use(signal("T1", R"("can": "0x181", "type": "int16le")") + "," +
        signal("A", R"("can": "0x00000181", "type": "int16le")") + "," +
        signal("J", R"("can": "0x18FEEE00", "offset": 2, "type": "uint16le")"));
    EXPECT_EQ(take(frame(0x181, {1, 0})), CB_CAN_TAKEN);
    EXPECT_EQ(batch.count, 1);
    EXPECT_EQ(number("T1"), 1);
    EXPECT_EQ(take(frame(0x181 | CB_CAN_EXTENDED, {2, 0})), CB_CAN_TAKEN);
    EXPECT_EQ(number("A"), 2);
    EXPECT_EQ(take(frame(0x18FEEE00 | CB_CAN_EXTENDED, {0, 0, 0x40, 0x23, 0, 0, 0, 0})),
              CB_CAN_TAKEN);
    EXPECT_EQ(number("J"), 0x2340);
    EXPECT_EQ(take(frame(0x182, {1, 0})), CB_CAN_FOREIGN);
    EXPECT_EQ(take(frame(0x18FEEE01 | CB_CAN_EXTENDED, {1, 0})), CB_CAN_FOREIGN);
}

// Electronic engine temperature 1 (PGN 65262): coolant in byte 1, 1 °C per bit from -40; oil in
// bytes 3 and 4, 1/32 °C per bit from -273.
TEST_F(can, single_bytes_of_a_j1939_message_from_any_source) {
    use(signal("T1", R"("can": "0x18feeexx", "type": "uint8", "zero": -40)") + "," +
        signal("A", R"("can": "0x18feeexx", "offset": 2, "type": "uint16le")") + "," +
        signal("D", R"("can": "0x18feee21", "offset": 7, "type": "int8")"));
    for (const uint32_t source : {0x00u, 0x21u, 0xFEu}) {
        batch.count = 0;
        const uint32_t id = 0x18FEEE00u | CB_CAN_EXTENDED | source;
        EXPECT_EQ(take(frame(id, {0x4B, 0xFF, 0x20, 0x27, 0, 0, 0, 0x80})), CB_CAN_TAKEN);
        EXPECT_EQ(number("T1"), 75);
        EXPECT_EQ(number("A"), 0x2720);
        EXPECT_EQ(batch.count, source == 0x21 ? 3 : 2);
    }
    EXPECT_EQ(number("T1"), 75);
    const uint32_t bit_30 = 0x40000000u;
    EXPECT_EQ(take(frame(0x18FEEE00u | CB_CAN_EXTENDED | bit_30, {1})), CB_CAN_FOREIGN);
    EXPECT_EQ(take(frame(0x18FEEF00u | CB_CAN_EXTENDED, {1})), CB_CAN_FOREIGN);
    EXPECT_EQ(take(frame(0x0CFEEE00u | CB_CAN_EXTENDED, {1})), CB_CAN_FOREIGN) << "priority 3";
}

TEST_F(can, the_newest_number_of_a_signal_stays) {
    use(signal("T1", R"("can": "0x181", "type": "int16le")"));
    take(frame(0x181, {1, 0}, 10));
    take(frame(0x181, {2, 0}, 20));
    EXPECT_EQ(batch.count, 1);
    EXPECT_EQ(number("T1"), 2);
    EXPECT_EQ(batch.samples[0].time_us, 20);
}

TEST_F(can, a_short_frame_gives_what_is_whole_in_it) {
    use(signal("T1", R"("can": "0x181", "type": "int16le")") + "," +
        signal("A", R"("can": "0x181", "offset": 2, "type": "int16le")"));
    EXPECT_EQ(take(frame(0x181, {1, 0, 5})), CB_CAN_SHORT);
    EXPECT_EQ(batch.count, 1);
    EXPECT_EQ(number("T1"), 1);
    EXPECT_EQ(take(frame(0x181, {})), CB_CAN_SHORT);
}

// A controller's driver cannot say 9 bytes; if it did, nothing beyond the array is read.
TEST_F(can, an_impossible_length_gives_nothing) {
    use(signal("T1", R"("can": "0x181", "offset": 6, "type": "int16le")"));
    cb_can_frame f = frame(0x181, {1, 2, 3, 4, 5, 6, 7, 8});
    f.length = 9;
    EXPECT_EQ(take(f), CB_CAN_SHORT);
    EXPECT_EQ(batch.count, 0);
}

TEST_F(can, sixty_signals_in_one_frame_fit_the_batch) {
    std::string signals = signal("T1", R"("can": "0x1", "type": "int16le")");
    for (int i = 0; i < 60; ++i)
        signals += "," + signal("S" + std::to_string(i), R"("can": "0x1", "type": "int16")");
    use(signals);
    EXPECT_EQ(take(frame(0x1, {0, 7})), CB_CAN_TAKEN);
    EXPECT_EQ(batch.count, 61);
}

// ---- loader ----

TEST(can_section, is_can0_without_nodes_when_left_out) {
    const auto config = load(full_example).config;
    EXPECT_STREQ(config->can.interface, "can0");
    EXPECT_EQ(config->can.nodes_count, 0);
}

TEST(can_section, names_interface_and_nodes) {
    const auto loaded = load(with(R"("safety":)", R"("can": {"interface": "can1", "nodes": [
            {"node": 5, "start": true}, {"node": 127, "heartbeat_timeout_ms": 3000}]}, "safety":)"));
    ASSERT_EQ(loaded.error, CB_OK) << loaded.text;
    const cb_can_config &can = loaded.config->can;
    EXPECT_STREQ(can.interface, "can1");
    ASSERT_EQ(can.nodes_count, 2);
    EXPECT_EQ(can.nodes[0].node, 5);
    EXPECT_TRUE(can.nodes[0].start);
    EXPECT_EQ(can.nodes[0].heartbeat_timeout_ms, 0u);
    EXPECT_EQ(can.nodes[1].node, 127);
    EXPECT_FALSE(can.nodes[1].start);
    EXPECT_EQ(can.nodes[1].heartbeat_timeout_ms, 3000u);
}

TEST(can_section, takes_the_names_that_the_kernel_takes) {
    const auto text_of = [](const std::string &name) {
        return load(with(R"("safety":)", R"("can": {"interface": ")" + name + R"("}, "safety":)"))
            .text;
    };
    for (const char *name : {"c", ".c", "..c", "123456789012345"}) EXPECT_EQ(text_of(name), "");
    for (const std::string name : {".", "..", "a/b", "a b", "a:b"})
        EXPECT_EQ(text_of(name),
                  "can.interface: \"" + name + "\" is not a name of a network interface");
}

TEST(can_section, is_refused_by_a_target_without_a_bus) {
    cb_target target = compbox_test::every_target;
    target.sources = 1u << CB_SOURCE_PLC;
    const auto loaded =
        load(with(R"("safety":)", R"("can": {"interface": "can1"}, "safety":)"), target);
    EXPECT_EQ(loaded.error, CB_ERROR_PROFILE);
    EXPECT_EQ(loaded.text, "can: testbox reads no CAN bus in this version");
}

// ---- CANopen ----

struct canopen : ::testing::Test {
    canopen() {
        config.nodes_count = 3;
        config.nodes[0] = {1, true, 1000};   // started and watched
        config.nodes[1] = {2, true, 0};      // started only
        config.nodes[2] = {3, false, 1000};  // watched only
        cb_canopen_start(nodes);
    }
    // Numbers of the nodes that are commanded to start at this moment, in order.
    std::string due(int64_t now_us) {
        cb_can_frame f = {};
        std::string starts;
        while (cb_canopen_due(&config, nodes, now_us, &f)) {
            EXPECT_EQ(f.id, 0u);
            EXPECT_EQ(f.length, 2);
            EXPECT_EQ(f.data[0], 1);
            starts += std::to_string(f.data[1]);
            last = f;
        }
        return starts;
    }
    bool hear(uint8_t node, int state, int64_t now_us) {
        const cb_can_frame f = frame(0x700u + node, {state}, now_us);
        return cb_canopen_take(&config, nodes, &f);
    }
    cb_can_config config = {};
    cb_canopen_node nodes[CB_MAX_CAN_NODES];
    cb_can_frame last = {};
};

constexpr int64_t s = 1000000;

TEST_F(canopen, every_node_to_be_started_is_commanded_once) {
    EXPECT_EQ(due(0), "12");
    EXPECT_EQ(due(0), "");
    EXPECT_EQ(due(10 * s), "");
}

TEST_F(canopen, a_node_that_boots_is_commanded_again) {
    due(0);
    EXPECT_TRUE(hear(2, 0, 5 * s));
    EXPECT_EQ(nodes[1].boots, 1u);
    EXPECT_EQ(due(5 * s), "2");
    EXPECT_EQ(due(7 * s), "") << "its heartbeat is not watched, so nobody knows that it disobeys";
}

TEST_F(canopen, a_watched_node_is_commanded_until_it_obeys) {
    due(0);
    hear(1, 127, s / 2);
    EXPECT_EQ(due(s / 2), "") << "not more often than once a second";
    EXPECT_EQ(due(s), "1");
    EXPECT_EQ(due(2 * s), "1");
    hear(1, 5 | 0x80, 2 * s);  // the bit above is that of node guarding
    EXPECT_EQ(nodes[0].state, CB_CANOPEN_OPERATIONAL);
    EXPECT_EQ(due(9 * s), "");
}

TEST_F(canopen, a_heartbeat_that_stays_away_is_lost_once) {
    hear(3, 5, 0);
    cb_canopen_watch(&config, nodes, s);
    EXPECT_EQ(nodes[2].losses, 0u);
    cb_canopen_watch(&config, nodes, s + 1);
    cb_canopen_watch(&config, nodes, 9 * s);
    EXPECT_EQ(nodes[2].losses, 1u);
    EXPECT_EQ(nodes[2].state, CB_CANOPEN_UNKNOWN);
    hear(3, 5, 10 * s);
    EXPECT_EQ(nodes[2].state, CB_CANOPEN_OPERATIONAL);
}

TEST_F(canopen, a_node_that_was_never_heard_is_lost_once) {
    for (int64_t now_us : {100 * s, 101 * s}) cb_canopen_watch(&config, nodes, now_us);
    EXPECT_EQ(nodes[0].losses, 0u);
    for (int64_t now_us : {101 * s + 1, 110 * s}) cb_canopen_watch(&config, nodes, now_us);
    EXPECT_EQ(nodes[0].losses, 1u);
    EXPECT_EQ(nodes[1].losses, 0u) << "its heartbeat is not watched";
    hear(1, 5, 111 * s);
    cb_canopen_watch(&config, nodes, 113 * s);
    EXPECT_EQ(nodes[0].losses, 2u);
}

TEST_F(canopen, after_the_bus_was_away_nodes_are_commanded_anew) {
    due(0);
    hear(1, 5, s);
    cb_canopen_bus_is_back(nodes);
    EXPECT_EQ(due(2 * s), "2") << "node 1 says that it runs";
}

// Nobody knows whether it still does: its heartbeat need not come again.
TEST_F(canopen, an_unwatched_node_that_ran_before_the_bus_was_away_is_commanded_anew) {
    due(0);
    hear(2, 5, s);
    EXPECT_EQ(due(2 * s), "");
    cb_canopen_bus_is_back(nodes);
    EXPECT_EQ(due(3 * s), "12");
    EXPECT_EQ(due(9 * s), "");
}

TEST_F(canopen, what_could_not_be_sent_is_due_again) {
    EXPECT_EQ(due(0), "12");
    cb_canopen_not_sent(&config, nodes, &last);
    EXPECT_EQ(nodes[0].starts, 1u);
    EXPECT_EQ(nodes[1].starts, 0u);
    EXPECT_EQ(due(s / 2), "");
    EXPECT_EQ(due(s), "2");
    EXPECT_EQ(nodes[1].starts, 1u);
}

TEST_F(canopen, other_frames_are_none_of_it) {
    EXPECT_FALSE(hear(4, 5, 0)) << "not one of ours";
    const cb_can_frame two_bytes = frame(0x701, {5, 5}),
                       extended = frame(0x701 | CB_CAN_EXTENDED, {5});
    EXPECT_FALSE(cb_canopen_take(&config, nodes, &two_bytes));
    EXPECT_FALSE(cb_canopen_take(&config, nodes, &extended));
}

}  // namespace
