// SPDX-License-Identifier: MIT
// The box step by step, with exact numbers: start, signals, lead, deadband, limits, registers.
// Faults and losses: fault_test.cpp; random everything: computing/property_test.cpp.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/box_fixture.h"

namespace compbox {
namespace {

// ---- start

TEST(box, starts_and_goes_to_the_wanted_value_at_the_slew_rate) {
    box_rig rig(simple());
    rig.position(8, 400);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_HEARTBEAT);  // one reading says nothing of its life
    EXPECT_TRUE(rig.out.write);
    EXPECT_EQ(rig.written(4), 0);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -15);  // 500 µm/s for 30 ms
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -30);
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.out.registers[0], 0x0001);
    EXPECT_EQ(rig.out.registers[1], 4);
    rig.steps(10);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
}

TEST(box, writes_nothing_before_it_has_heard_the_plc) {
    box_rig rig(simple());
    rig.reading = false;
    for (int i = 0; i < 100; ++i) {
        rig.step();
        ASSERT_FALSE(rig.out.write);
        ASSERT_EQ(rig.mode(), CB_MODE_STANDBY);
        ASSERT_EQ(rig.reason(), CB_REASON_NO_PLC);
    }
    EXPECT_EQ(cb_box_wants_held(rig.box.get()), CB_WANT_NOW);
    rig.reading = true;
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_EQ(rig.box->counters.reads_failed, 100u);
}

TEST(box, starts_from_what_the_plc_applies) {
    config_builder b = simple();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    box_rig rig(b);
    rig.position(8, 400);
    put_int32(rig.in.registers + 24, -2500);  // -25 µm
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -25);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    put_int32(rig.in.registers + 24, 0);  // looked at only where the box starts
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
}

TEST(box, ramps_down_what_it_finds_applied_when_nobody_wants_it) {
    config_builder b = simple();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    b.config->channels[0].sign = -1;
    box_rig rig(b);
    rig.control(0);
    put_int32(rig.in.registers + 24, 400);  // register +4 µm: the box's value is -4
    rig.step();
    EXPECT_DOUBLE_EQ(rig.output(), -4);
    EXPECT_DOUBLE_EQ(rig.written(4), 4);
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
    for (double expected : {2.5, 1.0, 0.0}) {
        rig.step();
        EXPECT_NEAR(rig.written(4), expected, 1e-9);
    }
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_NOT_ENABLED);
}

TEST(box, an_applied_value_beyond_the_limit_or_none_at_all_is_forced_inside) {
    config_builder b = simple();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    box_rig high(b);
    put_int32(high.in.registers + 24, 999999);
    high.step();
    EXPECT_DOUBLE_EQ(high.written(4), 300);
    b.config->channels[0].type = CB_NUMBER_FLOAT32;
    box_rig none(b);
    none.in.registers[24] = 0x7FC0;  // NaN
    none.step();
    EXPECT_EQ(none.output(), 0);
}

// ---- signals

// T1 on CAN: 2 µm per °C in the channel of X.
config_builder with_thermometer() {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned t1 = b.thermometer("T1");
    const unsigned ezx = b.polyline("EZX", x, {0, 1000}, {0, 100});
    const unsigned thermal = b.polynomial("thermal", t1, {0, 2});
    b.channel("Z", {ezx, thermal}, 4);
    return b;
}
constexpr unsigned t1 = 1;

TEST(box, a_sample_is_raw_times_scale) {
    box_rig rig(with_thermometer());
    rig.sample(t1, 105);
    rig.steps(20);
    EXPECT_FLOAT_EQ(rig.box->signals[t1].value, 10.5f);
    EXPECT_DOUBLE_EQ(rig.written(4), -21);
}

TEST(box, a_term_whose_thermometer_is_silent_fades_and_the_rest_goes_on) {
    box_rig rig(with_thermometer());
    rig.position(8, 100);
    rig.sample(t1, 100);
    rig.step();  // the sample's time is that of the step before: 30 ms old from now on
    rig.steps(65);
    EXPECT_DOUBLE_EQ(rig.written(4), -30);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
    rig.step();  // 67 x 30 ms = 2010 ms > 2000 ms
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_NEAR(rig.written(4), -28.5, 1e-9);  // 50 µm/s
    rig.step();
    EXPECT_NEAR(rig.written(4), -27, 1e-9);
    rig.steps(12);
    EXPECT_DOUBLE_EQ(rig.written(4), -10);
    EXPECT_EQ(rig.box->counters.terms_faded, 1u);
    EXPECT_EQ(rig.box->counters.signals_stale, 1u);
    rig.sample(t1, 100);
    rig.step();
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
    EXPECT_DOUBLE_EQ(rig.written(4), -25);  // back at the slew rate
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -30);
}

TEST(box, never_computes_with_a_signal_it_never_heard) {
    box_rig rig(with_thermometer());
    rig.position(8, 100);
    rig.steps(10);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_DOUBLE_EQ(rig.written(4), -10);
    EXPECT_EQ(rig.box->counters.terms_faded, 0u);  // it was never there
}

TEST(box, implausible_samples_are_counted_and_the_last_value_serves) {
    box_rig rig(with_thermometer());
    rig.sample(t1, 100);
    rig.steps(20);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (float raw : {-101.0f, 901.0f, nan, std::numeric_limits<float>::infinity()}) {
        rig.sample(t1, raw);
        rig.step();
        EXPECT_FLOAT_EQ(rig.box->signals[t1].value, 10);
    }
    EXPECT_EQ(rig.box->counters.samples_implausible, 4u);
    rig.sample(t1, 900);
    rig.step();
    EXPECT_FLOAT_EQ(rig.box->signals[t1].value, 90);  // the border belongs to the range
}

TEST(box, a_value_that_jumps_is_believed_after_the_time_it_would_need) {
    config_builder b = with_thermometer();
    b.config->signals[t1].max_rate_per_s = 2;
    box_rig rig(b);
    rig.sample(t1, 100);
    rig.step();
    rig.sample(t1, 101);  // 0.1 °C in 30 ms is more than 2 °C/s, but one unit of the sensor
    rig.step();
    EXPECT_FLOAT_EQ(rig.box->signals[t1].value, 10.1f);
    unsigned refused = 0;
    do {
        rig.sample(t1, 120);
        rig.step();
        ++refused;
    } while (rig.box->signals[t1].value < 11 && refused < 100);
    // 1.9 °C - 0.1 °C at 2 °C/s: 0.9 s = 30 steps; the 30th may still be short by a rounding
    EXPECT_GE(refused, 30u);
    EXPECT_LE(refused, 31u);
    EXPECT_EQ(rig.box->counters.samples_implausible, refused - 1);
}

TEST(box, samples_that_no_signal_expects_are_counted) {
    box_rig rig(with_thermometer());
    rig.sample(0, 5);   // a PLC signal
    rig.sample(77, 5);  // none
    rig.sample(t1, 50);
    rig.in.samples[2].time_us += 1000000;  // from the future
    rig.step();
    EXPECT_EQ(rig.box->counters.samples_unknown, 3u);
    EXPECT_FALSE(rig.box->signals[t1].known);
    rig.in.sample_count = CB_MAX_SAMPLES;
    rig.step();
    EXPECT_EQ(rig.box->counters.samples_unknown + rig.box->counters.samples_implausible,
              3u + CB_MAX_SAMPLES);
}

TEST(box, an_older_sample_does_not_replace_a_newer_one) {
    box_rig rig(with_thermometer());
    rig.steps(2);
    rig.sample(t1, 100);
    rig.sample(t1, 200);
    rig.in.samples[1].time_us -= 5000;
    rig.step();
    EXPECT_FLOAT_EQ(rig.box->signals[t1].value, 10);
}

TEST(box, positions_outside_a_curve_take_its_end_and_are_counted) {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned ezx = b.polyline("EZX", x, {200, 800}, {20, 80});
    b.channel("Z", {ezx}, 4);
    box_rig rig(b);
    rig.position(8, 900);
    rig.steps(10);
    EXPECT_DOUBLE_EQ(rig.written(4), -80);
    EXPECT_EQ(rig.box->counters.outside_curve, 10u);
}

TEST(box, a_term_that_is_not_finite_fades_and_is_counted) {
    config_builder b = with_thermometer();
    const cb_curve_config &c = b.config->terms[1].as.curve;
    b.config->pool[c.pool + 1] = 1e38f;
    box_rig rig(b);
    rig.sample(t1, 500);
    rig.steps(3);
    EXPECT_EQ(rig.box->counters.terms_not_finite, 3u);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_EQ(rig.output(), 0);
}

// ---- lead

TEST(box, leads_by_velocity_times_lead_time) {
    config_builder b = simple();
    b.config->lead_us = 45000;
    box_rig rig(b);
    double x = 100;
    for (int i = 0; i < 40; ++i) {
        rig.position(8, x);
        rig.step();
        x += 3;  // 100 mm/s
    }
    EXPECT_NEAR(rig.box->signals[0].velocity, 100, 0.01);
    EXPECT_NEAR(rig.box->signals[0].used, x - 3 + 4.5, 0.001);
    // A third of the way in each reading: about three readings to follow a new velocity.
    const float before = rig.box->signals[0].velocity;
    rig.position(8, x - 3);
    rig.step();
    EXPECT_NEAR(rig.box->signals[0].velocity, before * 2 / 3, 0.01);
}

TEST(box, a_lead_stays_in_the_plausible_range_and_ends_with_the_readings) {
    config_builder b = simple();
    b.config->lead_us = 500000;
    b.config->signals[0].max_age_ms = 10000;
    b.config->signals[0].essential = false;
    box_rig rig(b);
    double x = 900;
    for (int i = 0; i < 20; ++i) {
        rig.position(8, x);
        rig.step();
        x += 3;
    }
    EXPECT_EQ(rig.box->signals[0].used, 1000);
    rig.reading = false;
    rig.steps(3);
    EXPECT_EQ(rig.box->signals[0].used, 1000);  // 90 ms old
    rig.step();
    EXPECT_FLOAT_EQ(rig.box->signals[0].used, 957);  // standing is the better guess now
    rig.reading = true;
    rig.position(8, 950);
    rig.step();
    EXPECT_EQ(rig.box->signals[0].velocity, 0);  // no velocity across a gap
}

TEST(box, signals_that_do_not_lead_are_used_as_they_are) {
    config_builder b = simple();
    b.config->lead_us = 45000;
    b.config->signals[0].leads = false;
    box_rig rig(b);
    for (double x : {100.0, 103.0, 106.0}) {
        rig.position(8, x);
        rig.step();
    }
    EXPECT_FLOAT_EQ(rig.box->signals[0].used, 106);
}

// ---- channels and registers

TEST(box, the_deadband_spares_small_changes_but_never_zero_or_the_limit) {
    config_builder b = simple();
    b.config->channels[0].deadband_um = 2;
    b.config->channels[0].limit_um = 50;
    box_rig rig(b);
    const std::pair<double, double> x_and_output[] = {
        {400, -40},   {415, -40},                            // 1.5 µm off
        {421, -42.1}, {402, -42.1}, {490, -49}, {505, -50},  // the limit
        {15, -1.5},   {0, 0},                                // zero
    };
    for (const auto &[x, output] : x_and_output) {
        rig.position(8, x);
        rig.steps(10);
        EXPECT_DOUBLE_EQ(rig.written(4), output) << x;
    }
}

TEST(box, numbers_on_the_wire_are_those_written_by_hand) {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned e = b.polynomial("E", x, {-123.4f});
    cb_channel_config &a = b.channel("A", {e}, 3);
    a.type = CB_NUMBER_INT16;
    a.scale = 0.1f;
    cb_channel_config &c = b.channel("B", {e}, 4);
    c.type = CB_NUMBER_INT32_CDAB;
    c.sign = -1;
    cb_channel_config &f = b.channel("C", {e, e}, 6);
    f.type = CB_NUMBER_FLOAT32;
    f.scale = 1;
    b.config->plc.write.counters = true;
    b.config->plc.status = 14;
    b.config->plc.box_heartbeat = 2;
    box_rig rig(b);
    rig.steps(30);
    EXPECT_EQ(rig.out.registers[3], 0x04D2);  // 1234
    EXPECT_EQ(rig.out.registers[4], 0xCFCC);  // -12340 = 0xFFFFCFCC, low word first
    EXPECT_EQ(rig.out.registers[5], 0xFFFF);
    EXPECT_EQ(rig.out.registers[6], 0x4376);  // 246.8f = 0x4376CCCD
    EXPECT_EQ(rig.out.registers[7], 0xCCCD);
    EXPECT_EQ(rig.out.registers[14], 0x0001);
    EXPECT_EQ(rig.out.registers[2], 30);
    EXPECT_EQ(rig.out.registers[0], 30);
    EXPECT_EQ(rig.out.registers[15], 30);
    for (const unsigned i : {1u, 8u, 9u, 10u, 11u, 12u, 13u})
        EXPECT_EQ(rig.out.registers[i], 0) << i;
}

TEST(box, zero_is_written_as_zero_bits) {
    config_builder b = simple();
    b.config->channels[0].type = CB_NUMBER_FLOAT32;
    b.config->channels[0].sign = -1;
    box_rig rig(b);
    rig.steps(3);
    EXPECT_EQ(rig.out.registers[4], 0);
    EXPECT_EQ(rig.out.registers[5], 0);
}

TEST(box, beyond_the_limit_it_stays_there_and_says_so) {
    config_builder b = simple();
    b.config->channels[0].limit_um = 50;
    box_rig rig(b);
    rig.position(8, 800);
    rig.steps(20);
    EXPECT_DOUBLE_EQ(rig.written(4), -50);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.reason(), CB_REASON_LIMITED);
    EXPECT_EQ(rig.box->counters.outputs_limited, 20u);
}

TEST(box, the_heartbeats_wrap) {
    box_rig rig(simple());
    rig.heartbeat = 65533;
    rig.box->life.box_heartbeat = 65533;
    rig.steps(6);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.out.registers[1], 3);
    EXPECT_EQ(rig.box->counters.heartbeats_lost, 0u);
}

// ---- the host's short cuts

TEST(box, settle_is_where_a_box_arrives) {
    config_builder b = with_thermometer();
    b.config->lead_us = 45000;
    box_rig slow(b), settled(b);
    for (box_rig *rig : {&slow, &settled}) rig->position(8, 700);
    for (int i = 0; i < 100; ++i) {
        slow.sample(t1, 321);
        slow.step();
    }
    settled.sample(t1, 321);
    settled.in.read_ok = true;
    settled.in.read_us = settled.now_us;
    cb_box_settle(settled.box.get(), &settled.in, settled.now_us, &settled.out);
    EXPECT_EQ(settled.written(4), slow.written(4));
    EXPECT_EQ(settled.mode(), CB_MODE_ACTIVE);
    settled.position(8, 710);
    settled.in.sample_count = 0;
    settled.step();
    EXPECT_EQ(settled.mode(), CB_MODE_ACTIVE);
    // 1 µm for 10 mm; 0.5 µm for the lead, 45 ms at a third of 10 mm / 30 ms
    EXPECT_DOUBLE_EQ(settled.written(4), slow.written(4) - 1.5);
}

}  // namespace
}  // namespace compbox
