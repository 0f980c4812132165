// SPDX-License-Identifier: MIT
// Reload: a new configuration takes over and nothing steps.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/support/box_fixture.h"

namespace compbox {
namespace {

config_builder original(float gain = 100) {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned t = b.thermometer("T1");
    const unsigned ezx = b.polyline("EZX", x, {0, 1000}, {0, gain});
    const unsigned thermal = b.polynomial("thermal", t, {0, 2});
    b.channel("Z", {ezx, thermal}, 4);
    return b;
}

// The same with everything in another place, a new axis in front and a new curve.
config_builder rearranged() {
    config_builder b;
    const unsigned y = b.position("Y", 12);
    const unsigned t = b.thermometer("T1");
    const unsigned x = b.position("X", 10);
    const unsigned eyx = b.polyline("EYX", y, {0, 1000}, {5, 5});
    const unsigned thermal = b.polynomial("thermal", t, {0, 2});
    const unsigned ezx = b.polyline("EZX", x, {0, 1000}, {0, 200});
    b.channel("Y", {eyx}, 6);
    b.channel("Z", {thermal, ezx}, 4);
    return b;
}

// Runs at X = 400 mm, T1 = 10 °C: -60 µm.
struct reload_rig : box_rig {
    explicit reload_rig(const config_builder &b = original()) : box_rig(b) {
        position(8, 400);
        for (int i = 0; i < 10; ++i) {
            sample(1, 100);
            step();
        }
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_DOUBLE_EQ(written(4), -60);
    }

    // The PLC, until the box itself has ramped to zero; and the first reading after that.
    void go_away() {
        reading = false;
        write = CB_TRANSFER_FAILED;
        steps(200);
    }
    void come_back() {
        reading = true;
        write = CB_TRANSFER_OK;
        in.held = CB_TRANSFER_OK;
    }

    bool reload(const config_builder &b) {
        auto fresh = std::make_unique<cb_box>();
        std::memset(fresh.get(), 0, sizeof *fresh);
        fresh->config = *b.config;
        cb_box_start(fresh.get());
        if (!cb_box_adopt(fresh.get(), box.get())) return false;
        box = std::move(fresh);
        return true;
    }
};

TEST(box_adopt, the_same_file_changes_nothing) {
    reload_rig rig;
    const cb_counters before = rig.box->counters;
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(rig.written(4), -60);
    EXPECT_EQ(rig.out.registers[1], 11);
    EXPECT_EQ(rig.box->counters.cycles, before.cycles + 1);
    EXPECT_EQ(rig.box->counters.holds, 0u);
}

TEST(box_adopt, a_new_curve_is_reached_at_the_slew_rate) {
    reload_rig rig;
    ASSERT_TRUE(rig.reload(rearranged()));
    rig.position(10, 400);
    rig.position(12, 7);
    double z = -60, y = 0;
    for (int i = 0; i < 10; ++i) {
        rig.step();
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE);
        ASSERT_LE(std::fabs(rig.written(4) - z), 15 + 1e-6);
        ASSERT_LE(std::fabs(rig.written(6) - y), 15 + 1e-6);
        z = rig.written(4);
        y = rig.written(6);
    }
    EXPECT_DOUBLE_EQ(z, -100);  // 80 + 20, although no new sample of T1 came
    EXPECT_DOUBLE_EQ(y, -5);
}

TEST(box_adopt, smaller_limits_are_slewed_into) {
    reload_rig rig;
    config_builder b = original();
    b.config->channels[0].limit_um = 20;
    ASSERT_TRUE(rig.reload(b));
    for (double expected : {-45, -30, -20, -20}) {
        rig.step();
        EXPECT_DOUBLE_EQ(rig.written(4), expected);
    }
}

// The PLC is away, its register keeps -60; the new file allows 20 only.
TEST(box_adopt, smaller_limits_are_slewed_into_from_what_the_plc_kept) {
    for (const bool pair : {false, true}) {
        config_builder before = original(), after = original();
        for (config_builder *b : {&before, &after}) b->channel("W", {}, 6);
        reload_rig rig(before);
        rig.go_away();
        ASSERT_FALSE(rig.out.write);
        if (pair)
            after.pair(0, 1, 20);
        else
            after.config->channels[0].limit_um = 20;
        ASSERT_TRUE(rig.reload(after));
        rig.come_back();
        put_int32(rig.in.held_registers + 4, -6000);
        put_int32(rig.in.held_registers + 6, 0);
        rig.step();
        ASSERT_TRUE(rig.out.write);
        double z = -60;
        for (int i = 0; i < 80; ++i, rig.step()) {
            ASSERT_LE(std::fabs(rig.written(4) - z), 15 + 1e-6) << i;
            z = rig.written(4);
        }
        EXPECT_LE(std::fabs(z - rig.written(6)), 20 + 1e-6);
    }
}

// What the PLC has and the box never gave it is forced into the limits.
TEST(box_adopt, what_is_not_the_box_s_own_is_no_excuse) {
    reload_rig rig;
    rig.go_away();
    config_builder b = original();
    b.config->channels[0].limit_um = 20;
    ASSERT_TRUE(rig.reload(b));
    rig.come_back();
    put_int32(rig.in.held_registers + 4, -25000);
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(4), -20);
}

TEST(box_adopt, what_the_plc_may_hold_is_taken_along) {
    reload_rig rig;
    rig.position(8, 900);
    rig.write = CB_TRANSFER_UNKNOWN;
    rig.steps(2);
    EXPECT_DOUBLE_EQ(rig.written(4), -90);  // two periods from -60, which may still be there
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_TRUE(rig.out.write);
    EXPECT_DOUBLE_EQ(rig.written(4), -90);
    EXPECT_EQ(rig.box->channels[0].possible_min_um, -90);
    EXPECT_EQ(rig.box->channels[0].possible_max_um, -60);
}

TEST(box_adopt, an_outage_a_fault_and_a_loss_are_taken_along) {
    reload_rig rig;
    rig.beating = false;
    rig.steps(8);
    ASSERT_EQ(rig.mode(), CB_MODE_HOLD);
    const uint32_t held_us = rig.box->mode.hold_us;
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.box->mode.hold_us, held_us + 30000);
    rig.beating = true;
    rig.step();
    EXPECT_EQ(rig.reason(), CB_REASON_WAIT_ENABLE);
}

// It names the channel by its place, which may be another one in the new file.
TEST(box_adopt, the_cause_of_a_latched_fault_is_taken_along) {
    const auto adopted = [](cb_cause cause) {
        reload_rig rig;
        rig.box->cause = cause;
        EXPECT_TRUE(rig.reload(rearranged()));
        return rig.box->cause;
    };
    for (const uint8_t kind : {CB_CAUSE_DEMAND, CB_CAUSE_UNAPPLIED}) {
        const cb_cause cause = adopted({kind, 0, -412, 400});
        EXPECT_EQ(cause.kind, kind);
        EXPECT_EQ(cause.index, 1) << "Z";
        EXPECT_EQ(cause.value, -412);
    }
    EXPECT_EQ(adopted({CB_CAUSE_NEVER, 0, 0, 90}).kind, CB_CAUSE_NONE) << "of a signal";
    EXPECT_EQ(adopted({CB_CAUSE_DEMAND, CB_MAX_CHANNELS, 0, 0}).kind, CB_CAUSE_NONE)
        << "a place that changed in memory";
    EXPECT_EQ(adopted({CB_CAUSE_DEMAND, CB_MAX_CHANNELS - 1, 0, 0}).kind, CB_CAUSE_NONE)
        << "of a channel that the new file has not";
}

TEST(box_adopt, an_alarm_of_a_handshake_that_is_no_longer_there_ends) {
    config_builder with = original();
    with.config->plc.has_handshake = true;
    with.config->plc.handshake = 2;
    reload_rig rig(with);
    rig.in.registers[2] = CB_HANDSHAKE_ALARM;
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT);
    rig.control(1 | 2 | 4);
    rig.step();
    EXPECT_NE(rig.mode(), CB_MODE_FAULT);
}

TEST(box_adopt, a_fading_term_goes_on_fading) {
    reload_rig rig;
    while (rig.reason() != CB_REASON_DEGRADED) rig.step();
    EXPECT_NEAR(rig.written(4), -58.5, 1e-9);
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_NEAR(rig.written(4), -57, 1e-9);
    EXPECT_EQ(rig.box->counters.terms_faded, 1u);
}

TEST(box_adopt, a_value_in_another_unit_is_another_value) {
    reload_rig rig;
    config_builder b = original();
    std::strcpy(b.config->signals[1].unit, "K");
    ASSERT_TRUE(rig.reload(b));
    EXPECT_FALSE(rig.box->signals[1].known);
    EXPECT_TRUE(rig.box->signals[0].known);
}

TEST(box_adopt, the_configuration_check_is_that_of_the_new_file) {
    reload_rig rig;
    ASSERT_TRUE(rig.reload(rearranged()));
    rig.position(10, 400);
    rig.position(12, 7);
    for (std::size_t i = 0; i < sizeof(cb_config) / 64 * 2 + 4; ++i) {
        rig.sample(1, 100);
        rig.step();
    }
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
}

// What would step is refused, and the fresh box is as it was.
TEST(box_adopt, refuses_what_would_step) {
    const struct {
        const char *what;
        void (*change)(cb_config &);
    } changes[] = {
        {"gone", [](cb_config &c) { std::strcpy(c.channels[0].name, "W"); }},
        {"register", [](cb_config &c) { c.channels[0].reg = 6; }},
        {"block", [](cb_config &c) { c.plc.write.start = 102; }},
        {"type", [](cb_config &c) { c.channels[0].type = CB_NUMBER_INT32_CDAB; }},
        {"scale", [](cb_config &c) { c.channels[0].scale = 0.1f; }},
        {"sign", [](cb_config &c) { c.channels[0].sign = -1; }},
        {"PLC", [](cb_config &c) { std::strcpy(c.plc.host, "192.0.2.1"); }},
        {"unit", [](cb_config &c) { c.plc.unit = 2; }},
        {"port", [](cb_config &c) { c.plc.port = 1502; }},
        {"wire", [](cb_config &c) { c.plc.transport = CB_TRANSPORT_RTU; }},
    };
    for (const auto &change : changes) {
        SCOPED_TRACE(change.what);
        reload_rig rig;
        config_builder b = original();
        change.change(*b.config);
        auto fresh = std::make_unique<cb_box>();
        std::memset(fresh.get(), 0, sizeof *fresh);
        fresh->config = *b.config;
        cb_box_start(fresh.get());
        auto before = std::make_unique<cb_box>();
        std::memcpy(before.get(), fresh.get(), sizeof *fresh);
        EXPECT_FALSE(cb_box_adopt(fresh.get(), rig.box.get()));
        EXPECT_EQ(std::memcmp(before.get(), fresh.get(), sizeof *fresh), 0);
        EXPECT_EQ(cb_box_obstacle(&fresh->config, rig.box.get()), 0u);
        rig.control(2);  // ramp to zero first: then anything goes
        while (rig.mode() != CB_MODE_STANDBY) rig.step();
        rig.step();
        EXPECT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    }
}

TEST(box_adopt, a_moved_block_with_its_registers_at_the_same_addresses_is_fine) {
    reload_rig rig;
    config_builder b = original();
    b.config->plc.write.start = 98;
    b.config->channels[0].reg = 6;
    ASSERT_TRUE(rig.reload(b));
    rig.step();
    EXPECT_DOUBLE_EQ(rig.written(6), -60);
}

// Another limit or register may come only when the PLC, which answers, has not set enable and holds
// zero for certain.
TEST(box_at_rest, is_standby_by_the_plcs_wish_with_all_at_zero) {
    reload_rig rig;
    EXPECT_FALSE(cb_box_at_rest(rig.box.get())) << "ACTIVE";
    rig.control(2);
    rig.step();
    EXPECT_FALSE(cb_box_at_rest(rig.box.get())) << "RAMP";
    for (int i = 0; i < 400 && rig.mode() != CB_MODE_STANDBY; ++i) rig.step();
    ASSERT_EQ(rig.mode(), CB_MODE_STANDBY);
    rig.steps(2);
    EXPECT_TRUE(cb_box_at_rest(rig.box.get()));
    rig.box->channels[0].possible_max_um = 1;
    EXPECT_FALSE(cb_box_at_rest(rig.box.get())) << "the PLC may hold something else";
}

// A file whose own demand is beyond its error_um stays in FAULT, whoever presses reset. The wider
// one that mends it is taken there, with enable off, and the reset ends the FAULT then.
TEST(box_at_rest, is_fault_with_enable_off_and_all_at_zero) {
    reload_rig rig;
    ASSERT_TRUE(rig.reload(original(1e6)));
    rig.step();
    ASSERT_EQ(rig.mode(), CB_MODE_FAULT);
    for (int i = 0; i < 400 && rig.written(4) != 0; ++i) rig.step();
    rig.steps(2);
    EXPECT_FALSE(cb_box_at_rest(rig.box.get())) << "enable is set";
    rig.control(2);
    rig.step();
    EXPECT_TRUE(cb_box_at_rest(rig.box.get()));
    rig.box->channels[0].possible_max_um = 1;
    EXPECT_FALSE(cb_box_at_rest(rig.box.get())) << "the PLC may hold something else";
    rig.step();
    rig.control(6);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_FAULT) << "the demand is still there";
    rig.control(2);
    ASSERT_TRUE(rig.reload(original()));
    rig.step();
    EXPECT_EQ(rig.reason(), CB_REASON_DEMAND) << "until the reset";
    rig.control(6);
    rig.step();
    EXPECT_EQ(rig.mode(), CB_MODE_STANDBY);
}

// The PLC returns after an outage with enable off and an offset of zero, but an old register.
// out: whether the box is at rest before it has written, and behind the confirmed write
std::pair<bool, bool> rests_behind_an_old_register(cb_transfer held, double register_um) {
    config_builder b = original();
    b.config->channels[0].has_applied = true;
    b.config->channels[0].applied_reg = 20;
    reload_rig rig(b);
    rig.go_away();
    rig.come_back();
    rig.in.held = held;
    rig.control(2);
    put_int32(rig.in.held_registers + 4, register_um / 0.01);
    rig.step();
    const bool before = cb_box_at_rest(rig.box.get());
    EXPECT_EQ(rig.written(4), 0);
    rig.steps(300);
    return {before, cb_box_at_rest(rig.box.get())};
}

// Otherwise the channel might change its register, and the old one would keep its value.
TEST(box_at_rest, is_not_before_the_plc_has_confirmed_zero) {
    using both = std::pair<bool, bool>;
    const both later(false, true);
    EXPECT_EQ(rests_behind_an_old_register(CB_TRANSFER_OK, -60), later);
    EXPECT_EQ(rests_behind_an_old_register(CB_TRANSFER_REFUSED, 0), later);
}

TEST(box_at_rest, is_not_standby_for_want_of_a_plc) {
    reload_rig rig;
    rig.go_away();
    ASSERT_EQ(rig.mode(), CB_MODE_STANDBY);
    EXPECT_FALSE(cb_box_at_rest(rig.box.get()));
    const auto fresh = std::make_unique<cb_box>();
    std::memset(fresh.get(), 0, sizeof *fresh);
    fresh->config = rig.box->config;
    cb_box_start(fresh.get());
    EXPECT_FALSE(cb_box_at_rest(fresh.get())) << "it has not heard the PLC yet";
}

}  // namespace
}  // namespace compbox
