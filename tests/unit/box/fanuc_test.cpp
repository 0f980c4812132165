// SPDX-License-Identifier: MIT
// The box before a FANUC control: no change that the NC sees is ever 9999 increments or more,
// whichever values it takes over; the handshake register; a PLC that applies something else.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/box_from_text.h"

namespace compbox {
namespace {

// Full range, X from -1 to 1 mm swings the demand from one end to the other; slew as good as none.
std::string file_of(bool applied, bool handshake, int sign, int scan_ms) {
    return R"({"format": "compbox/1", "revision": 1, "machine": {"name": "mill"},
  "cycle": {"period_ms": 30},
  "plc": {"profile": "fanuc", "transport": {"tcp": {"host": "127.0.0.1"}},
    "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16},
    "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,)" +
           std::string(handshake ? R"("handshake": 2,)" : "") + R"(
    "scan_ms": )" +
           std::to_string(scan_ms) + R"(, "heartbeat_timeout_ms": 200},
  "signals": [{"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -2,
    "max": 2}],
  "terms": [{"name": "EXX", "type": "polynomial", "signal": "X", "coefficients": [0, 9999]}],
  "channels": [{"name": "X", "sum": ["EXX"], "limit_um": 9999, "error_um": 100000,
    "slew_um_per_s": 1000000, "plc": 104, "type": "int16", "scale": 1, "sign": )" +
           std::to_string(sign) + (applied ? R"(, "applied": 24)" : "") + R"(}],
  "safety": {"hold_ms": 300, "ramp_um_per_s": 1000000}})";
}

// The PLC keeps what is written; the NC takes it over when the ladder gets round to it.
struct fanuc_rig : box_rig {
    double nc = 0, largest = 0;
    explicit fanuc_rig(const std::string &text) : box_rig(from_text(text)) {}

    uint16_t held = 0;
    void cycle() {
        in.held = CB_TRANSFER_OK;
        in.held_registers[4] = held;
        in.registers[24] = static_cast<uint16_t>(static_cast<int>(nc));
        step();
        if (out.write) held = out.registers[4];
    }
    void take_over() {
        const double value = static_cast<int16_t>(held);
        largest = std::max(largest, std::abs(value - nc));
        nc = value;
    }
};

TEST(box_fanuc, takes_the_nc_from_one_end_to_the_other_in_steps) {
    fanuc_rig rig(file_of(true, false, 1, 8));
    rig.position(8, -1);
    for (int i = 0; i < 200; ++i, i % 3 ? void() : rig.take_over()) rig.cycle();
    rig.take_over();
    EXPECT_EQ(rig.nc, 9999);
    rig.position(8, 1);
    for (int i = 0; i < 200; ++i, i % 3 ? void() : rig.take_over()) rig.cycle();
    rig.take_over();
    EXPECT_EQ(rig.nc, -9999) << "it does get there";
    EXPECT_LE(rig.largest, 9998);
    EXPECT_GT(rig.largest, 500);
}

// Demands swing, enable comes and goes, readings fail, writes get lost, the box is reloaded and
// started anew with the other sign; the NC takes over every 1st to 33rd value (a second).
TEST(box_fanuc, never_shows_the_nc_a_change_of_9999) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        const auto one_in = [&](unsigned n) { return engine() % n == 0; };
        const bool applied = one_in(2);
        int sign = 1, wait = 0, moved = 0;
        auto rig = std::make_unique<fanuc_rig>(file_of(applied, false, sign, 8));
        for (int i = 0; i < 3000; ++i) {
            if (one_in(15)) rig->position(8, one_in(2) ? 1 : -1);
            if (one_in(200)) rig->control(one_in(4) ? 2 : 1 | 2 | 8);
            rig->reading = !one_in(50);
            rig->write = one_in(20) ? CB_TRANSFER_UNKNOWN : CB_TRANSFER_OK;
            if (one_in(500)) {  // started anew with the other sign: asks before it writes
                sign = -sign;
                const fanuc_rig was = std::move(*rig);
                rig = std::make_unique<fanuc_rig>(file_of(applied, false, sign, 8));
                rig->nc = was.nc;
                rig->held = was.held;
                rig->largest = was.largest;
            }
            rig->cycle();
            if (wait-- > 0) continue;
            wait = static_cast<int>(engine() % 33);
            const double was = rig->nc;
            rig->take_over();
            moved += rig->nc != was;
            ASSERT_LE(rig->largest, 9998) << i;
        }
        EXPECT_GT(moved, 20) << "a test that stands still shows nothing";
    }
}

// However long the NC takes nothing: with applied the box stays within reach of what it has.
TEST(box_fanuc, waits_for_an_nc_that_takes_nothing) {
    fanuc_rig rig(file_of(true, false, 1, 8));
    rig.position(8, -1);
    for (int i = 0; i < 100; ++i) rig.cycle(), rig.take_over();
    ASSERT_EQ(rig.nc, 9999);
    rig.position(8, 1);
    for (int i = 0; i < 300; ++i) rig.cycle();
    EXPECT_EQ(static_cast<int16_t>(rig.held), 9999 - 9998);
    EXPECT_EQ(rig.reason(), CB_REASON_UNAPPLIED);
    rig.take_over();
    for (int i = 0; i < 100; ++i) rig.cycle(), rig.take_over();
    EXPECT_EQ(rig.nc, -9999);
    EXPECT_LE(rig.largest, 9998);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

// Without applied the box cannot know: then it is the limit that holds, where no two values are
// further apart than the largest step. How long the NC takes nothing does not matter.
TEST(box_fanuc, no_two_values_of_half_the_step_are_too_far_apart) {
    for (const bool small : {true, false}) {
        std::string text = file_of(false, false, 1, 8);
        if (small) text = compbox_test::with("\"limit_um\": 9999", "\"limit_um\": 4999", text);
        fanuc_rig rig(text);
        for (int swing = 0; swing < 6; ++swing) {
            rig.position(8, swing % 2 ? 1 : -1);
            for (int i = 0; i < 200 + 37 * swing; ++i) rig.cycle();
            rig.take_over();
        }
        if (small)
            EXPECT_EQ(rig.largest, 9998);
        else
            EXPECT_GT(rig.largest, 9998) << "what compbox check has a remark for";
    }
}

TEST(box_fanuc, counts_handshakes_and_leaves_with_the_alarm) {
    fanuc_rig rig(file_of(true, true, 1, 8));
    rig.position(8, 0.001);
    for (int i = 0; i < 40; ++i) {
        rig.in.registers[2] = i % 4 == 1 ? 0x0101 : i % 4 == 2 ? 0x0301 : 0;
        rig.cycle();
        rig.take_over();
    }
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.box->counters.handshakes, 10u);
    ASSERT_NE(rig.nc, 0);
    rig.in.registers[2] = 0x8000;
    rig.cycle();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    EXPECT_EQ(rig.reason(), CB_REASON_NC_ALARM);
    EXPECT_EQ(rig.box->counters.nc_alarms, 1u);
    for (int i = 0; i < 60; ++i) rig.cycle(), rig.take_over();
    EXPECT_EQ(rig.nc, 0);
    rig.control(1 | 2 | 4);
    rig.cycle();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT) << "the alarm is still there";
    rig.in.registers[2] = 0;
    rig.control(1 | 2);
    rig.cycle();
    rig.control(1 | 2 | 4);
    rig.cycle();
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
}

// Without the register nothing is read from where it would be.
TEST(box_fanuc, looks_at_no_handshake_that_the_file_does_not_have) {
    fanuc_rig rig(file_of(true, false, 1, 8));
    rig.in.registers[2] = 0x8101;
    for (int i = 0; i < 20; ++i) rig.cycle();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.box->counters.handshakes, 0u);
}

// ---- a PLC that applies something else

std::string sinumerik(double deadband_um) {
    std::string text = file_of(true, false, 1, 8);
    const auto change = [&](const std::string &a, const std::string &b) {
        text = compbox_test::with(a, b, text);
    };
    change("\"fanuc\"", "\"sinumerik-840d\"");
    change("\"scan_ms\": 8", "\"deadband_um\": " + std::to_string(deadband_um));
    change("\"type\": \"int16\", \"scale\": 1", "\"type\": \"int16\", \"scale\": 0.5");
    return text;
}

TEST(box_applied, within_the_deadband_is_applied) {
    for (const double off_um : {2.0, 3.0}) {
        box_rig rig(from_text(sinumerik(1.5)));
        rig.position(8, 0.01);
        for (int i = 0; i < 100; ++i) {
            rig.in.registers[24] = static_cast<uint16_t>(std::lround((-100 + off_um) / 0.5));
            rig.step();
        }
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(rig.reason(), off_um > 2.0 ? CB_REASON_UNAPPLIED : CB_REASON_NONE) << off_um;
    }
}

TEST(box_applied, is_reported_after_a_second_and_only_while_active) {
    box_rig rig(from_text(sinumerik(0.5)));
    rig.position(8, 0.01);
    rig.control(2);
    rig.steps(100);
    EXPECT_EQ(rig.reason(), CB_REASON_NOT_ENABLED);
    rig.control(1 | 2);
    rig.steps(30);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE) << "0.9 s";
    rig.steps(35);
    EXPECT_EQ(rig.reason(), CB_REASON_UNAPPLIED) << "1.25 s and a quarter of the time";
    EXPECT_EQ(rig.box->applied.verdict.channel, 0);
    EXPECT_GT(rig.box->counters.applied_foreign, 0u);
    rig.in.registers[24] = static_cast<uint16_t>(-200);
    rig.steps(35);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE) << "it follows now";
}

// ---- a second writer

// What a foreign client writes is applied: it moves all the time, half of the time, or stands.
TEST(box_applied, a_foreign_value_inside_error_um_is_counted_and_named_however_it_moves) {
    for (int way = 0; way < 4; ++way) {
        box_rig rig(from_text(sinumerik(0.5)));
        rig.position(8, 0.01);
        rig.in.registers[24] = static_cast<uint16_t>(-200);
        rig.steps(80);
        ASSERT_EQ(rig.reason(), CB_REASON_NONE);
        for (int n = 0; n < 100; ++n) {
            const double foreign_um[] = {150, 150.0 + n % 7, n % 2 ? 150.0 : -100.0,
                                         n % 2 ? 150.0 : 180.0};
            rig.in.registers[24] = static_cast<uint16_t>(std::lround(foreign_um[way] / 0.5));
            rig.step();
        }
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(rig.reason(), CB_REASON_UNAPPLIED) << "way " << way;
        EXPECT_GE(rig.box->counters.applied_foreign, 49u);
        EXPECT_EQ(rig.box->applied.verdict.channel, 0);
    }
}

// A box on a channel with `applied` as float32, 300 µm, error_um 400.
box_rig float_applied_rig() {
    config_builder b = simple();
    b.config->channels[0].type = CB_NUMBER_FLOAT32;
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    b.config->channels[0].scale = 1;
    box_rig rig(b);
    rig.position(8, 400);
    return rig;
}
void put_float(uint16_t *registers, float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    registers[0] = static_cast<uint16_t>(bits >> 16);
    registers[1] = static_cast<uint16_t>(bits);
}

// A PLC that moves a real along straight lines is beside what was sent by its rounding.
TEST(box_applied, a_float_is_applied_within_a_nanometre) {
    for (const float off_um : {0.0008F, 0.0015F}) {
        box_rig rig = float_applied_rig();
        for (int i = 0; i < 200; ++i) {
            put_float(rig.in.registers + 24, rig.box->channels[0].sent_um - off_um);
            rig.step();
        }
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(rig.reason(), off_um > 1e-3F ? CB_REASON_UNAPPLIED : CB_REASON_NONE) << off_um;
    }
}

TEST(box_applied, a_value_far_beyond_error_um_in_two_readings_is_a_fault) {
    for (float foreign_um : {3000.0f, -401.0f, std::numeric_limits<float>::infinity(),
                             std::numeric_limits<float>::quiet_NaN()}) {
        box_rig rig = float_applied_rig();
        rig.steps(10);
        put_float(rig.in.registers + 24, -40);
        rig.steps(10);
        put_float(rig.in.registers + 24, foreign_um);
        rig.step();
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE) << "one reading is none";
        put_float(rig.in.registers + 24, -40);
        rig.step();
        put_float(rig.in.registers + 24, foreign_um);
        rig.steps(2);
        EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
        EXPECT_EQ(rig.reason(), CB_REASON_FOREIGN);
        rig.control(1 | 2 | 4);
        rig.step();
        EXPECT_EQ(rig.mode(), CB_MODE_FAULT) << "the cause is there";
        put_float(rig.in.registers + 24, -40);
        rig.control(1 | 2);
        rig.step();
        rig.control(1 | 2 | 4);
        rig.step();
        EXPECT_NE(rig.mode(), CB_MODE_FAULT);
    }
}

// The output is at error_um; the PLC may report it a dead band further.
TEST(box_applied, a_value_within_the_deadband_of_an_output_at_error_um_is_none) {
    for (const float off_um : {4.0f, 7.0f}) {
        box_rig rig = float_applied_rig();
        rig.box->config.plc.deadband_um = 5;
        rig.box->config.channels[0].limit_um = rig.box->config.channels[0].error_um = 40;
        cb_box_start(rig.box.get());
        for (int i = 0; i < 100; ++i) {
            put_float(rig.in.registers + 24, static_cast<float>(rig.output()) - off_um);
            rig.step();
        }
        EXPECT_EQ(rig.mode(), off_um < 5 ? CB_MODE_ACTIVE : CB_MODE_FAULT);
        EXPECT_EQ(rig.reason(), off_um < 5 ? CB_REASON_NONE : CB_REASON_FOREIGN);
    }
}

// Item 0 of the bounds: a reading that is not finite never becomes an output.
TEST(box_applied, an_infinite_first_value_is_never_written) {
    for (float first :
         {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
          std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::max()}) {
        box_rig rig = float_applied_rig();
        put_float(rig.in.registers + 24, first);
        for (int n = 0; n < 50; ++n) {
            rig.step();
            ASSERT_LE(std::fabs(rig.output()), 300);
            if (n == 2) put_float(rig.in.registers + 24, 0);
        }
        rig.write = CB_TRANSFER_UNKNOWN;  // lost, and the read-back is infinite
        rig.steps(6);
        rig.write = CB_TRANSFER_OK;
        put_float(rig.in.registers + 24, first);
        put_float(rig.in.held_registers + 4, first);
        rig.in.held = CB_TRANSFER_OK;
        for (int n = 0; n < 50; ++n) {
            rig.step();
            ASSERT_LE(std::fabs(rig.output()), 300);
        }
    }
}

TEST(box_applied, what_another_client_left_in_a_register_is_counted_and_named) {
    box_rig rig(simple());
    rig.position(8, 400);
    rig.steps(40);
    ASSERT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_IF_ROOM);
    rig.in.held = CB_TRANSFER_OK;
    put_int32(rig.in.held_registers + 4, -4000);
    rig.step();
    EXPECT_EQ(rig.box->counters.registers_foreign, 0u);
    EXPECT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_NOTHING);
    rig.steps(40);
    rig.in.held = CB_TRANSFER_OK;
    put_int32(rig.in.held_registers + 4, 1000000);
    rig.step();
    EXPECT_EQ(rig.box->counters.registers_foreign, 1u);
    EXPECT_EQ(rig.box->foreign.channel, 0);
    EXPECT_EQ(rig.box->foreign.value_um, 10000.0f);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
}

// A write without a reply may act behind the next ones (docs/decisions/0003).
TEST(box_applied, an_own_write_that_acts_late_is_none_of_another_client) {
    box_rig rig(simple());
    rig.position(8, 400);
    rig.steps(38);
    rig.position(8, 200);
    rig.step();
    const double late_um = rig.written(4);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.step();
    rig.write = CB_TRANSFER_OK;
    rig.steps(2);
    ASSERT_GT(std::fabs(rig.written(4) - late_um), 0.1);
    ASSERT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_IF_ROOM);
    for (const bool is_own : {true, false}) {
        rig.in.held = CB_TRANSFER_OK;
        put_int32(rig.in.held_registers + 4, is_own ? std::round(late_um * 100) : 1000000);
        rig.step();
        EXPECT_EQ(rig.box->counters.registers_foreign, is_own ? 0u : 1u);
    }
}

// One reply that is lost does not end the watch; a PLC that never answers costs three writes.
TEST(box_applied, read_backs_end_with_the_third_in_a_row_that_has_no_reply) {
    box_rig rig(simple());
    rig.position(8, 400);
    const auto read_back = [&rig](cb_transfer result) {
        rig.steps(40);
        const bool wanted = cb_box_wants_held(rig.box.get()) == CB_WANT_IF_ROOM;
        rig.in.held = result;
        rig.step();
        rig.in.held = CB_TRANSFER_NONE;
        return wanted;
    };
    for (int i = 0; i < 5; ++i) {
        EXPECT_TRUE(read_back(CB_TRANSFER_UNKNOWN));
        EXPECT_TRUE(read_back(CB_TRANSFER_FAILED));
        EXPECT_TRUE(read_back(CB_TRANSFER_OK));
    }
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(read_back(CB_TRANSFER_UNKNOWN));
    rig.steps(200);
    EXPECT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_NOTHING);
}

TEST(box_applied, a_refused_read_back_is_the_last_one) {
    box_rig rig(simple());
    rig.position(8, 400);
    rig.steps(40);
    rig.in.held = CB_TRANSFER_REFUSED;
    rig.step();
    rig.steps(200);
    EXPECT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_NOTHING);
}

}  // namespace
}  // namespace compbox
