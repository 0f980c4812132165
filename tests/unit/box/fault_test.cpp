// SPDX-License-Identifier: MIT
// What the box does when something fails: losses, faults, stop, and how it comes back.
#include <gtest/gtest.h>

#include "tests/support/box_fixture.h"

namespace compbox {
namespace {

// Running at X = 400 mm, output -40 µm.
struct running_rig : box_rig {
    explicit running_rig(const config_builder &b = simple()) : box_rig(b) {
        position(8, 400);
        steps(10);
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_DOUBLE_EQ(written(4), -40);
    }
};

// Steps until the mode changes; returns how many steps that took, with the one that changed it.
template <class Rig>
int steps_until(Rig &rig, cb_mode mode, int most = 1000) {
    for (int i = 1; i <= most; ++i) {
        rig.step();
        if (rig.mode() == mode) return i;
    }
    return -1;
}

// ---- losses

TEST(box_fault, three_failed_readings_cost_nothing_the_fourth_is_a_loss) {
    running_rig rig;
    rig.reading = false;
    rig.steps(3);  // 90 ms: three periods
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.reason(), CB_REASON_NO_PLC);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.out.registers[0], 0x0102);
    EXPECT_EQ(rig.box->counters.holds, 1u);
}

TEST(box_fault, hold_then_ramp_then_standby) {
    running_rig rig;
    rig.reading = false;
    EXPECT_EQ(steps_until(rig, CB_MODE_HOLD), 4);
    EXPECT_EQ(steps_until(rig, CB_MODE_RAMP), 17);  // 500 ms
    EXPECT_NEAR(rig.written(4), -38.5, 1e-9);       // 50 µm/s
    EXPECT_EQ(steps_until(rig, CB_MODE_STANDBY), 27);
    EXPECT_EQ(rig.written(4), 0);
    rig.reading = true;
    rig.steps(10);
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
    rig.control(2);
    rig.step();
    rig.control(2 | 1);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -15);
}

TEST(box_fault, a_frozen_heartbeat_is_a_loss_after_its_timeout) {
    running_rig rig;
    rig.beating = false;
    EXPECT_EQ(steps_until(rig, CB_MODE_HOLD), 7);  // 210 ms
    EXPECT_EQ(rig.reason(), CB_REASON_HEARTBEAT);
    EXPECT_EQ(rig.box->counters.heartbeats_lost, 1u);
    rig.beating = true;
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
    rig.control(1 | 2 | 8);  // permit resume
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, a_heartbeat_behind_a_silence_is_no_beat) {
    running_rig rig;
    rig.reading = false;
    rig.steps(100);
    rig.reading = true;
    rig.control(1 | 2 | 8);  // permit resume
    rig.heartbeat += 1000;   // the PLC went on meanwhile, and then its program stopped
    rig.beating = false;
    for (int n = 0; n < 20; ++n) {
        rig.step();
        EXPECT_NE(rig.mode(), CB_MODE_ACTIVE);
    }
    rig.beating = true;
    rig.steps(3);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

// A PLC whose server goes on, whatever its program does. It may take a write without an answer
// behind a later one for at least cb_limiter_late_us().
struct server_rig : running_rig {
    struct late_write {
        double um;
        int64_t left_us;
    };
    std::vector<late_write> late;
    double held_um = -40;

    static config_builder file(cb_exchange exchange) {
        config_builder b = simple();
        b.config->plc.exchange = static_cast<uint8_t>(exchange);
        b.config->channels[0].slew_um_per_s = 200;
        return b;
    }
    explicit server_rig(cb_exchange exchange) : running_rig(file(exchange)) {}

    // One step. With FC23 no reading comes without the reply to the write.
    void step(cb_transfer fate) {
        const bool answered = fate == CB_TRANSFER_OK;
        if (answered) {
            held_um = written(4);
            for (late_write &w : late) w.left_us -= 30000;
        } else {
            late.push_back({written(4), cb_limiter_late_us(&box->config)});
        }
        write = fate;
        reading = answered || box->config.plc.exchange != CB_EXCHANGE_FC23;
        box_rig::step();
        const double most_um = 200 * 0.06 + 0.001;
        EXPECT_LE(std::fabs(written(4) - held_um), most_um);
        for (const late_write &w : late)
            EXPECT_LE(w.left_us > 0 ? std::fabs(written(4) - w.um) : 0, most_um);
    }
};

TEST(box_fault, a_write_without_an_answer_never_ends_the_ramp_of_a_dead_heartbeat) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC23, CB_EXCHANGE_FC3_FC16}) {
        server_rig rig(exchange);
        rig.beating = false;
        for (int n = 0; n < 100 && rig.mode() != CB_MODE_RAMP; ++n) rig.step(CB_TRANSFER_OK);
        ASSERT_EQ(rig.reason(), CB_REASON_HEARTBEAT);
        rig.step(CB_TRANSFER_UNKNOWN);
        // 40 um at 50 um/s; at 12 um the output waits for the end of two turns of 520 ms
        for (int n = 0; n < 36 + 20; ++n) rig.step(CB_TRANSFER_OK);
        EXPECT_EQ(rig.written(4), 0);
        EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    }
}

TEST(box_fault, writes_without_an_answer_now_and_then_delay_the_ramp_and_never_end_it) {
    for (bool beating : {false, true}) {
        for (cb_exchange exchange : {CB_EXCHANGE_FC23, CB_EXCHANGE_FC3_FC16}) {
            server_rig rig(exchange);
            rig.beating = beating;
            rig.control(2);
            // 12 um in two turns of 520 ms, which take 36 confirmed writes and 12 others
            for (int n = 0; n < 4 * 48; ++n) rig.step(n % 4 ? CB_TRANSFER_OK : CB_TRANSFER_UNKNOWN);
            EXPECT_EQ(rig.written(4), 0);
        }
    }
}

TEST(box_fault, an_implausible_position_is_a_loss_when_the_last_good_one_is_too_old) {
    running_rig rig;
    rig.position(8, 1000.1);
    rig.steps(3);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.reason(), CB_REASON_SIGNAL);
    EXPECT_EQ(rig.box->counters.samples_implausible, 4u);
}

TEST(box_fault, a_torn_reading_is_no_reading) {
    config_builder b = simple();
    b.config->plc.read.counters = true;
    b.config->plc.control = 2;
    b.config->plc.plc_heartbeat = 3;
    running_rig rig(b);
    rig.in.registers[0] = 7;
    rig.in.registers[31] = 6;
    rig.position(8, 900);
    rig.steps(3);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.box->counters.reads_torn, 3u);
    rig.in.registers[31] = 7;
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -55);
}

TEST(box_fault, a_reading_from_the_future_is_none) {
    running_rig rig;
    const int64_t now_us = rig.now_us;
    rig.position(8, 900);
    rig.in.read_us = now_us + 30001;
    rig.in.last_write = CB_TRANSFER_OK;
    rig.in.read_ok = true;
    cb_box_step(rig.box.get(), &rig.in, now_us + 30000, &rig.out);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.box->counters.reads_failed, 1u);
}

TEST(box_fault, every_referenced_bit_counts) {
    config_builder b = simple();
    b.config->plc.referenced_mask = 1 << 4 | 1 << 5;
    box_rig rig(b);
    rig.control(1 | 2 | 16);
    rig.steps(5);
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_NOT_REFERENCED);
    rig.control(1 | 16 | 32);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, enable_going_away_ramps_and_coming_back_resumes) {
    running_rig rig;
    rig.control(2);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
    EXPECT_NEAR(rig.written(4), -38.5, 1e-9);
    rig.control(2 | 1);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
}

// ---- time

TEST(box_fault, time_going_backward_makes_everything_stale) {
    running_rig rig;
    rig.step(-1);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.reason(), CB_REASON_CLOCK);
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.box->counters.clock_jumps, 1u);
    rig.control(1 | 2 | 8);
    rig.step();  // the heartbeat has to be seen moving again, and is
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, five_periods_may_pass_not_more) {
    running_rig rig;
    rig.step(150000);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    rig.step(150001);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.reason(), CB_REASON_CLOCK);
}

TEST(box_fault, a_jump_makes_slow_sensors_stale_too) {
    config_builder b = simple();
    const unsigned t = b.thermometer("T1", 600000);
    b.config->channels[0].sum[1] = static_cast<uint8_t>(b.polynomial("t", t, {0, 1}));
    b.config->channels[0].sum_count = 2;
    box_rig rig(b);
    rig.sample(t, 100);
    rig.steps(20);
    EXPECT_TRUE(rig.box->signals[t].fresh);
    rig.step(200000);
    EXPECT_FALSE(rig.box->signals[t].fresh);
    EXPECT_FALSE(rig.box->signals[t].known);
}

TEST(box_fault, a_suspended_box_wakes_without_a_step) {
    running_rig rig;
    rig.position(8, 900);
    rig.step(3600LL * 1000000);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_DOUBLE_EQ(rig.output(), -40);
    EXPECT_FALSE(rig.out.write);  // an hour: the PLC may hold anything by now
    rig.step(3600LL * 1000000);   // and longer than hold_ms
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
}

// ---- what the PLC holds

TEST(box_fault, a_box_that_lost_track_asks_before_it_writes) {
    running_rig rig;
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(3);
    EXPECT_TRUE(rig.out.write);
    EXPECT_FALSE(cb_box_wants_held(rig.box.get()));
    rig.step();  // 150 ms since the last confirmed write
    EXPECT_TRUE(rig.out.last);
    rig.step();
    EXPECT_FALSE(rig.out.write);
    EXPECT_TRUE(cb_box_wants_held(rig.box.get()));
    rig.steps(50);  // no answer to the question: silent
    EXPECT_FALSE(rig.out.write);
    rig.write = CB_TRANSFER_OK;
    rig.in.held = CB_TRANSFER_OK;
    put_int32(rig.in.held_registers + 4, -3000);
    rig.control(1 | 2 | 8);
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_DOUBLE_EQ(rig.written(4), -30);
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -40);
    EXPECT_EQ(rig.box->counters.resyncs, 1u);
}

unsigned status_of(const box_rig &rig) {
    return rig.out.registers[rig.box->config.plc.status];
}

// What the PLC's status says last is not ACTIVE, and its outputs do not move for it.
TEST(box_fault, contact_lost_while_the_plc_is_read_ends_with_one_last_write) {
    for (const uint32_t hold_us : {0u, 500000u}) {
        config_builder b = simple();
        b.config->hold_us = hold_us;
        running_rig rig(b);
        rig.position(8, 900);  // the outputs are on their way to -90
        rig.step();
        const double sent_um = rig.output() - 3 * 15;
        rig.write = CB_TRANSFER_UNKNOWN;
        for (int i = 0; i < 3; ++i) {
            rig.step();
            ASSERT_FALSE(rig.out.last) << i;
            ASSERT_EQ(status_of(rig), CB_MODE_ACTIVE);
        }
        const double before_um = rig.written(4);
        EXPECT_GE(before_um, sent_um);
        rig.write = CB_TRANSFER_FAILED;
        rig.step();
        EXPECT_TRUE(rig.out.write && rig.out.last);
        rig.step();  // it was not sent: once more
        EXPECT_TRUE(rig.out.write && rig.out.last);
        EXPECT_EQ(status_of(rig) & 0xFF, hold_us > 0 ? CB_MODE_HOLD : CB_MODE_RAMP);
        EXPECT_EQ(status_of(rig) >> 8, CB_REASON_UNCONFIRMED);
        EXPECT_EQ(rig.written(4), before_um);
        EXPECT_FALSE(cb_box_wants_held(rig.box.get())) << "the read-back follows the last write";
        rig.write = CB_TRANSFER_UNKNOWN;
        for (int i = 0; i < 50; ++i) {
            rig.step();
            ASSERT_FALSE(rig.out.write || rig.out.last) << i;
            ASSERT_TRUE(cb_box_wants_held(rig.box.get()));
        }
    }
}

// A cable that is pulled after some late replies: the reason names the cable.
TEST(box_fault, a_mute_plc_that_is_no_longer_read_is_reported_as_absent) {
    running_rig rig;
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(6);
    EXPECT_EQ(rig.reason(), CB_REASON_UNCONFIRMED);
    rig.reading = false;
    for (int i = 0; i < 60; ++i) {  // 1.8 s: it may be a reconnection
        rig.step();
        ASSERT_EQ(rig.reason(), CB_REASON_UNCONFIRMED) << i;
    }
    rig.steps(10);
    for (int i = 0; i < 1000; ++i) {
        rig.step();
        ASSERT_EQ(rig.reason(), CB_REASON_NO_PLC) << i;
        ASSERT_NE(rig.mode(), CB_MODE_ACTIVE) << i;
    }
    rig.reading = true;  // still without a confirmed write
    rig.control(1 | 2 | 8);
    rig.step();
    EXPECT_NE(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.reason(), CB_REASON_UNCONFIRMED);
}

TEST(box_fault, a_last_write_that_cannot_be_sent_is_given_up) {
    running_rig rig;
    rig.write = CB_TRANSFER_FAILED;
    rig.steps(4);
    EXPECT_TRUE(rig.out.last);
    rig.steps(3);  // CB_READ_PERIODS
    EXPECT_FALSE(rig.out.write || rig.out.last);
    EXPECT_TRUE(cb_box_wants_held(rig.box.get()));
}

// After an outage: readings come, what the PLC holds does not, so nothing is written.
TEST(box_fault, a_box_that_may_not_write_is_not_active) {
    running_rig rig;
    rig.lose_plc();
    rig.steps(10);
    EXPECT_EQ(rig.reason(), CB_REASON_NO_PLC);
    rig.control(1 | 2 | 8);
    for (int i = 0; i < 40; ++i) {
        rig.reading = i % 2 == 0;
        rig.step();
        ASSERT_FALSE(rig.out.write);
        ASSERT_NE(rig.mode(), CB_MODE_ACTIVE) << i;
        ASSERT_EQ(rig.reason(), CB_REASON_UNCONFIRMED) << i;
    }
    rig.find_plc();
    rig.in.held = CB_TRANSFER_OK;
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

// Nobody knows which PLC would get it.
TEST(box_fault, a_plc_that_cannot_be_read_gets_no_last_write) {
    running_rig rig;
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.reading = false;
    for (int i = 0; i < 50; ++i) {
        rig.step();
        ASSERT_FALSE(rig.out.last) << i;
    }
    running_rig late;
    late.write = CB_TRANSFER_FAILED;
    late.steps(4);
    EXPECT_TRUE(late.out.last);
    late.reading = false;
    late.step(4 * 30000);
    EXPECT_FALSE(late.out.last);
}

TEST(box_fault, a_restarted_plc_is_met_at_zero) {
    running_rig rig;
    rig.lose_plc();
    rig.steps(10);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_DOUBLE_EQ(rig.output(), -40);
    EXPECT_FALSE(rig.out.write);
    rig.find_plc();
    rig.in.held = CB_TRANSFER_OK;  // all registers 0
    rig.control(1 | 2 | 8);
    rig.step();
    EXPECT_EQ(rig.written(4), 0);
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -15);
}

// Whether it restarted or lived on nobody knows: its own duty has taken the offset to zero
// meanwhile.
TEST(box_fault, a_plc_that_will_not_say_is_met_at_zero_and_that_is_a_loss) {
    running_rig rig;
    rig.lose_plc();
    rig.steps(40);
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
    const double virtual_um = rig.output();
    EXPECT_GT(virtual_um, -20);
    rig.find_plc();
    rig.in.held = CB_TRANSFER_REFUSED;
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_DOUBLE_EQ(rig.written(4), 0);
    rig.steps(20);
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
    rig.control(1 | 2 | 8);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -15);
}

// ---- what the run before left in the PLC

TEST(box_fault, a_status_of_a_box_at_work_is_a_loss_at_the_first_contact) {
    for (unsigned status : {0x0001u, 0x0702u, 0x0703u, 0x1004u, 0x004Du}) {
        box_rig rig(simple());
        rig.position(8, 400);
        rig.in.held_registers[0] = static_cast<uint16_t>(status);
        rig.steps(100);
        EXPECT_EQ(rig.mode(), CB_MODE_STANDBY) << status;
        EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
        rig.control(2);
        rig.step();
        rig.control(1 | 2);
        rig.step();
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE) << "a new edge of enable";
    }
    for (unsigned status : {0x0000u, 0x0005u, 0x0A05u}) {
        box_rig rig(simple());
        rig.in.held_registers[0] = static_cast<uint16_t>(status);
        rig.steps(3);
        EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE) << status;
    }
}

// After a crash at 101 µm: the register goes on from there, and down at the ramp rate.
TEST(box_fault, outputs_start_from_the_register_at_the_first_contact) {
    box_rig rig(simple());
    rig.in.held_registers[0] = CB_MODE_RAMP;
    put_int32(rig.in.held_registers + 4, 10100);
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_DOUBLE_EQ(rig.written(4), 101);
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), 99.5);
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
}

TEST(box_fault, a_first_contact_that_is_not_answered_writes_nothing_and_is_named) {
    box_rig rig(simple());
    for (int n = 0; n < 20; ++n) {
        rig.in.held = CB_TRANSFER_UNKNOWN;
        rig.step();
        ASSERT_FALSE(rig.out.write);
    }
    EXPECT_EQ(rig.reason(), CB_REASON_UNCONFIRMED);
    rig.steps(3);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, a_first_contact_that_is_refused_is_a_loss_unless_the_run_before_stopped) {
    for (bool stopped : {false, true}) {
        box_rig rig(simple());
        rig.box->life.stopped_before = stopped;
        rig.in.held = CB_TRANSFER_REFUSED;
        rig.steps(5);
        EXPECT_EQ(rig.mode(), stopped ? CB_MODE_ACTIVE : CB_MODE_STANDBY);
    }
}

// Its registers survived, its offset begins at zero: so do the outputs.
TEST(box_fault, a_plc_whose_heartbeat_went_back_is_met_at_zero) {
    for (bool back : {false, true}) {
        running_rig rig;
        rig.steps(100);
        rig.lose_plc();
        rig.steps(10);
        rig.find_plc();
        if (back) rig.heartbeat = 3;
        rig.in.held = CB_TRANSFER_OK;
        put_int32(rig.in.held_registers + 4, -4000);
        rig.step();
        EXPECT_DOUBLE_EQ(rig.written(4), back ? 0 : -40);
    }
}

TEST(box_fault, applied_values_are_believed_before_registers) {
    config_builder b = simple();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 24;
    running_rig rig(b);
    rig.lose_plc();
    rig.steps(10);
    rig.reading = true;
    rig.in.held = CB_TRANSFER_OK;
    put_int32(rig.in.held_registers + 4, -4000);
    put_int32(rig.in.registers + 24, -1000);  // the PLC has begun its own ramp
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -10);
}

TEST(box_fault, a_result_for_outputs_that_were_not_for_writing_is_not_believed) {
    running_rig rig;
    rig.lose_plc();
    rig.steps(20);
    EXPECT_FALSE(rig.out.write);
    const cb_channel_state before = rig.box->channels[0];
    const uint32_t failed = rig.box->counters.writes_failed;
    for (cb_transfer result : {CB_TRANSFER_OK, CB_TRANSFER_FAILED}) {
        rig.now_us += 30000;
        rig.in.last_write = static_cast<uint8_t>(result);
        cb_box_step(rig.box.get(), &rig.in, rig.now_us, &rig.out);
    }
    EXPECT_FALSE(rig.out.write);
    EXPECT_EQ(rig.box->counters.writes_failed, failed);
    EXPECT_GT(rig.box->plc.unconfirmed_us, 20u * 30000);
    EXPECT_EQ(rig.box->channels[0].sent_um, before.sent_um);
}

// A PLC that answers every reading, the read-back too, and no write.
struct mute_rig : running_rig {
    mute_rig() {
        write = CB_TRANSFER_UNKNOWN;
        put_int32(in.held_registers + 4, -4000);
    }
    void step() {
        if (cb_box_wants_held(box.get())) in.held = CB_TRANSFER_OK;
        running_rig::step();
    }
    void steps(unsigned count) {
        for (unsigned i = 0; i < count; ++i) step();
    }
};

TEST(box_fault, writes_that_are_never_confirmed_are_a_loss_although_the_plc_is_read) {
    mute_rig rig;
    rig.control(1 | 2 | 8);  // permit resume does not help before the loss is over
    EXPECT_EQ(steps_until(rig, CB_MODE_HOLD), 4);  // 150 ms > 4.5 periods
    EXPECT_EQ(rig.reason(), CB_REASON_UNCONFIRMED);
    EXPECT_EQ(steps_until(rig, CB_MODE_RAMP), 17);  // 500 ms
    for (int i = 0; i < 500; ++i) {
        rig.step();
        ASSERT_NE(rig.mode(), CB_MODE_ACTIVE) << i;
        ASSERT_EQ(rig.reason(), CB_REASON_UNCONFIRMED) << i;
    }
    EXPECT_EQ(rig.box->counters.holds, 1u);
    rig.write = CB_TRANSFER_OK;
    rig.steps(2);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, after_unconfirmed_writes_a_new_edge_of_enable_is_needed) {
    mute_rig rig;
    EXPECT_EQ(steps_until(rig, CB_MODE_HOLD), 4);
    rig.control(2);
    rig.step();
    rig.control(2 | 1);
    rig.steps(2);
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);  // the edge came while nothing was confirmed
    rig.write = CB_TRANSFER_OK;
    rig.steps(3);
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
    rig.control(2);
    rig.step();
    rig.control(2 | 1);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

TEST(box_fault, three_unconfirmed_writes_in_a_row_cost_no_mode) {
    running_rig rig;
    for (int i = 0; i < 100; ++i) {
        rig.write = i % 4 == 3 ? CB_TRANSFER_OK : CB_TRANSFER_UNKNOWN;
        rig.step();
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE) << i;
    }
    EXPECT_EQ(rig.box->counters.writes_unknown, 75u);
}

// fc23 after an outage: the one reading is by fc3, then request after request has no answer, so
// the readings stop as well and permit resume is at hand each time.
TEST(box_fault, a_plc_found_again_that_never_confirms_is_not_compensated_again_and_again) {
    mute_rig rig;
    rig.control(1 | 2 | 8);
    unsigned active = 0;
    for (int i = 0; i < 400; ++i) {
        rig.reading = cb_box_wants_held(rig.box.get());
        rig.step();
        active += i > 20 && rig.mode() == CB_MODE_ACTIVE;
    }
    EXPECT_GT(rig.box->counters.resyncs, 20u);
    EXPECT_EQ(active, 0u);
}

TEST(box_fault, an_unconfirmed_write_in_standby_keeps_the_box_there) {
    mute_rig rig;
    rig.write = CB_TRANSFER_OK;
    rig.control(2);
    EXPECT_GT(steps_until(rig, CB_MODE_STANDBY), 0);
    rig.write = CB_TRANSFER_FAILED;
    put_int32(rig.in.held_registers + 4, 0);
    rig.steps(5);
    rig.control(2 | 1);
    rig.steps(10);
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_UNCONFIRMED);
    rig.write = CB_TRANSFER_OK;
    rig.steps(2);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);  // nothing was lost while it compensated nothing
}

TEST(box_fault, lost_track_is_counted_from_the_contact) {
    running_rig rig;
    rig.lose_plc();
    rig.steps(100);
    rig.reading = true;
    rig.in.held = CB_TRANSFER_OK;
    rig.step();
    EXPECT_TRUE(rig.out.write);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(3);
    EXPECT_TRUE(rig.out.write);
}

// ---- faults

TEST(box_fault, demand_beyond_the_error_limit) {
    config_builder b = simple();
    b.config->channels[0].error_um = 90;
    b.config->channels[0].limit_um = 80;
    running_rig rig(b);
    rig.position(8, 901);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    EXPECT_EQ(rig.reason(), CB_REASON_DEMAND);
    EXPECT_EQ(rig.out.registers[0], 0x1004);
    EXPECT_NEAR(rig.written(4), -38.5, 1e-9);
    rig.position(8, 400);
    rig.steps(40);
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);  // latched
    EXPECT_EQ(rig.written(4), 0);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
    rig.control(1 | 2 | 8);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.box->counters.faults, 1u);
}

TEST(box_fault, a_reset_bit_that_is_already_on_is_no_edge) {
    config_builder b = simple();
    b.config->channels[0].error_um = 90;
    b.config->channels[0].limit_um = 80;
    running_rig rig(b);
    rig.control(1 | 2 | 4);
    rig.steps(2);
    rig.position(8, 901);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    rig.position(8, 400);
    rig.steps(3);
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    rig.control(1 | 2);
    rig.step();
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_RAMP);
}

TEST(box_fault, a_sound_configuration_is_never_called_corrupt) {
    running_rig rig;
    rig.steps(static_cast<unsigned>(sizeof(cb_config) / 64 * 3));
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.box->counters.faults, 0u);
}

TEST(box_fault, writes_refused_for_three_seconds) {
    running_rig rig;
    rig.write = CB_TRANSFER_REFUSED;
    for (int i = 0; i < 101; ++i) {  // the row begins with the first answer, and lasts 3 s
        if (cb_box_wants_held(rig.box.get())) {
            rig.in.held = CB_TRANSFER_OK;
            put_int32(rig.in.held_registers + 4, -4000);
        }
        rig.step();
        if (i < 3) {
            ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE) << i;
        } else {  // 4.5 periods without a write that was taken
            ASSERT_TRUE(rig.mode() == CB_MODE_HOLD || rig.mode() == CB_MODE_RAMP ||
                        rig.mode() == CB_MODE_STANDBY)
                << i;
            ASSERT_EQ(rig.reason(), CB_REASON_UNCONFIRMED) << i;
        }
    }
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    EXPECT_EQ(rig.reason(), CB_REASON_WRITE_REFUSED);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);  // still refusing
    rig.control(1 | 2);
    rig.write = CB_TRANSFER_OK;
    rig.in.held = CB_TRANSFER_OK;
    rig.steps(2);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_NE(rig.mode(), CB_MODE_FAULT);
}

// fc23 at a server without that function: FC3 answers when the box asks what it holds, and every
// FC23 is refused, so that there is no reading either.
// A control that stops refuses one write, and then its cable is pulled.
TEST(box_fault, one_refused_write_before_an_outage_is_no_fault) {
    running_rig rig;
    rig.write = CB_TRANSFER_REFUSED;
    rig.step();
    rig.lose_plc();
    for (int i = 0; i < 1000; ++i) {
        rig.step();
        ASSERT_NE(rig.mode(), CB_MODE_FAULT) << i;
    }
    EXPECT_EQ(rig.reason(), CB_REASON_NO_PLC);
    EXPECT_EQ(rig.box->counters.writes_refused, 1u);
}

TEST(box_fault, a_plc_that_never_took_a_write_is_not_compensated) {
    for (const bool reads_too : {false, true}) {
        box_rig rig(simple());
        rig.control(1 | 2 | 8);
        rig.position(8, 400);
        rig.sample(1, 0);
        rig.write = CB_TRANSFER_REFUSED;
        unsigned changes = 0, before = 0;
        for (int i = 0; i < 200; ++i) {
            rig.reading = reads_too || !rig.out.write;
            if (cb_box_wants_held(rig.box.get())) rig.in.held = CB_TRANSFER_OK;
            rig.step();
            ASSERT_NE(rig.mode(), CB_MODE_ACTIVE) << i;
            changes += status_of(rig) != before;
            before = status_of(rig);
        }
        EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
        EXPECT_EQ(rig.reason(), CB_REASON_WRITE_REFUSED);
        EXPECT_LE(changes, 4u) << "calm";
    }
}

TEST(box_fault, one_accepted_write_ends_a_row_of_refusals) {
    running_rig rig;
    for (int i = 0; i < 500; ++i) {
        rig.write = i % 3 == 0 ? CB_TRANSFER_OK : CB_TRANSFER_REFUSED;
        rig.step();
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE);
    }
    EXPECT_GT(rig.box->counters.writes_refused, 300u);
}

TEST(box_fault, overruns_again_and_again) {
    running_rig rig;
    for (int i = 0; i < 15; ++i) {
        rig.in.missed_ticks = 1;
        rig.step(60000);
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE);
    }
    rig.in.missed_ticks = 1;
    rig.step(60000);
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    EXPECT_EQ(rig.reason(), CB_REASON_OVERRUN);
    EXPECT_EQ(rig.box->counters.missed_ticks, 16u);
    rig.steps(31);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_NE(rig.mode(), CB_MODE_FAULT);  // 32 good cycles: below 16 again
    EXPECT_EQ(rig.box->life.overrun_score, 0);
}

// A computer that stood still for minutes and is well again: the operator can reset the fault.
TEST(box_fault, a_second_in_time_permits_the_reset_after_any_number_of_overruns) {
    running_rig rig;
    for (int i = 0; i < 1000; ++i) {
        rig.in.missed_ticks = 1;
        rig.step(60000);
    }
    ASSERT_EQ(rig.reason(), CB_REASON_OVERRUN);
    rig.in.missed_ticks = 0;
    rig.steps(31);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_NE(rig.mode(), CB_MODE_FAULT);
}

TEST(box_fault, overruns_now_and_then_are_forgiven) {
    running_rig rig;
    for (int i = 0; i < 2000; ++i) {
        rig.in.missed_ticks = i % 33 == 0 ? 3 : 0;
        rig.step(rig.in.missed_ticks ? 120000 : 30000);
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE) << i;
    }
}

// ---- stop

TEST(box_fault, stop_is_at_zero_written_and_confirmed_in_time) {
    config_builder b = simple();
    b.config->channels[0].sum_count = 3;  // three times EZX: 300 µm at X = 1000
    box_rig rig(b);
    rig.position(8, 1000);
    rig.steps(50);
    EXPECT_DOUBLE_EQ(rig.written(4), -300);
    rig.in.stop = true;
    double took_s = 0;
    while (!rig.out.stopped && took_s < 100) {
        rig.step();
        took_s += 0.030;
    }
    EXPECT_LE(took_s, 300.0 / 50 + 1);
    EXPECT_GE(took_s, 300.0 / 50);
    EXPECT_EQ(rig.out.registers[0], 0x0A05);
    EXPECT_EQ(rig.written(4), 0);
}

// The thread that stops the daemon asks beside the loop, whose step may not have found the damage
// yet.
TEST(box_fault, the_stated_time_of_a_stop_reads_no_channel_that_the_box_does_not_have) {
    box_rig rig(simple());
    rig.position(8, 1000);
    rig.steps(50);
    const std::int64_t sound_us = cb_box_stop_us(rig.box.get());
    EXPECT_GE(sound_us, 1000000) << "100 µm at less than 50 µm/s";
    rig.box->config.channels_count = 255;
    EXPECT_EQ(cb_box_stop_us(rig.box.get()), 0);
}

// A write without a reply may still take effect, so it holds the output until two turns are over.
TEST(box_fault, the_stated_time_of_a_stop_includes_late_writes) {
    config_builder b = simple();
    b.config->channels[0].sum_count = 3;
    b.config->plc.heartbeat_timeout_ms = 2000;
    box_rig rig(b);
    rig.position(8, 1000);
    rig.steps(50);
    const std::int64_t turns_us = 4 * std::int64_t{cb_limiter_late_us(&rig.box->config)};
    const std::int64_t moving_us = cb_box_stop_us(rig.box.get()) - turns_us;
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.step();
    rig.write = CB_TRANSFER_OK;
    rig.beating = false;
    rig.in.stop = true;
    rig.step();
    const std::int64_t stated_us = cb_box_stop_us(rig.box.get());
    std::int64_t took_us = 0;
    while (!rig.out.stopped && took_us < 100000000) {
        rig.step();
        took_us += 30000;
    }
    EXPECT_GT(took_us, moving_us + 1000000);
    EXPECT_LE(took_us, stated_us + 1000000);
}

// It would leave its offset behind STOPPED, where no later write overwrites it.
TEST(box_fault, no_write_of_a_ramp_can_take_effect_behind_stopped) {
    running_rig rig;
    const std::int64_t late_us = cb_limiter_late_us(&rig.box->config);
    rig.in.stop = true;
    while (std::fabs(rig.written(4)) > 3) rig.step();
    ASSERT_NE(rig.written(4), 0);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.step();
    rig.write = CB_TRANSFER_OK;
    std::int64_t alive_us = 0;
    for (; rig.mode() != CB_MODE_STOPPED && alive_us < 100000000; alive_us += 30000) rig.step();
    EXPECT_GE(alive_us, late_us);
    EXPECT_LE(alive_us, late_us + 3 * 30000);
}

TEST(box_fault, stopped_means_that_the_plc_confirmed_it) {
    running_rig rig;
    rig.in.stop = true;
    EXPECT_GT(steps_until(rig, CB_MODE_STOPPED), 0);
    EXPECT_FALSE(rig.out.stopped);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(2);
    EXPECT_FALSE(rig.out.stopped);
    rig.write = CB_TRANSFER_OK;
    rig.step();
    EXPECT_TRUE(rig.out.stopped);
}

TEST(box_fault, a_stop_at_the_first_contact_waits_for_the_confirmation) {
    box_rig rig(simple());
    rig.in.stop = true;
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_FALSE(rig.out.stopped);
    rig.steps(2);
    EXPECT_TRUE(rig.out.stopped);
}

TEST(box_fault, a_box_that_never_wrote_stops_at_once) {
    box_rig rig(simple());
    rig.reading = false;
    rig.steps(3);
    rig.in.stop = true;
    rig.step();
    EXPECT_TRUE(rig.out.stopped);
}

TEST(box_fault, stop_waits_for_a_zero_that_was_not_confirmed) {
    running_rig rig;
    rig.in.stop = true;
    rig.steps(27);
    EXPECT_EQ(rig.written(4), 0);
    rig.write = CB_TRANSFER_FAILED;
    rig.steps(3);
    EXPECT_NE(rig.mode(), CB_MODE_STOPPED);
}

TEST(box_fault, a_zero_from_before_does_not_count) {
    config_builder b = simple();
    b.config->ramp_um_per_s = 500;
    box_rig rig(b);
    rig.position(8, 150);
    rig.steps(2);  // zero was confirmed; -15 is written …
    EXPECT_DOUBLE_EQ(rig.written(4), -15);
    rig.write = CB_TRANSFER_UNKNOWN;  // … and may have arrived
    rig.in.stop = true;
    rig.steps(3);
    EXPECT_EQ(rig.written(4), 0);
    EXPECT_NE(rig.mode(), CB_MODE_STOPPED);
    rig.write = CB_TRANSFER_OK;
    rig.steps(cb_limiter_late_us(&rig.box->config) / 30000 + 2);  // until -15 arrives no more
    EXPECT_EQ(rig.mode(), CB_MODE_STOPPED);
}

TEST(box_fault, a_box_in_fault_can_be_stopped) {
    config_builder b = simple();
    b.config->channels[0].error_um = 90;
    b.config->channels[0].limit_um = 80;
    running_rig rig(b);
    rig.position(8, 901);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    rig.in.stop = true;
    EXPECT_GT(steps_until(rig, CB_MODE_STOPPED), 20);
}

}  // namespace
}  // namespace compbox
