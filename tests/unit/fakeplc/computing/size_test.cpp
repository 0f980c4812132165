// SPDX-License-Identifier: MIT
// The PLC program's own size: whatever a Modbus client writes, no axis goes further, and an alarm
// names the axis.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "host-tools/twin/random.h"
#include "tests/support/fakeplc_rig.h"

namespace compbox::fakeplc {
namespace {

constexpr double size_um = 90.0;  // of a FANUC with this map 99.99 at most
constexpr double slope_um_per_s = 1000.0;

const char *const all_profiles[] = {"generic", "sinumerik-840d", "fanuc"};

twin::twin_config sized_machine() {
    twin::twin_config config = small_machine();
    config.plc.size_um = size_um;
    return config;
}

// The applied value register and the correction at the axis after each scan.
struct extremes {
    double applied_um = 0.0, here_um = 0.0, nc_um = 0.0;

    void add(const rig &of) {
        const double at_mm = of.plc.nc().position_mm()[0];
        const auto keep = [](double &most, double um) { most = std::max(most, std::fabs(um)); };
        keep(applied_um, of.applied());
        keep(here_um, of.plc.duties().wanted()[0].at_um(at_mm));
        keep(nc_um, of.plc.held()[0].at_um(at_mm));
    }
};

TEST(Size, OfAForeignValueIsThePlcsOwnWithAnAlarm) {
    for (const char *profile : all_profiles) {
        SCOPED_TRACE(profile);
        rig r(sized_machine(), small_map(), profile);
        r.box_runs_ms(1200, active, 20.0);
        ASSERT_TRUE(r.plc.alarms().standing().empty());
        for (const double um : {10000.0, -10000.0}) {
            for (int i = 0; i < 40; ++i) {
                r.box_runs_ms(30, active, um);
                EXPECT_LE(std::fabs(r.applied()), size_um + 1e-9);
            }
            EXPECT_NEAR(r.applied(), um > 0 ? size_um : -size_um, 1e-9);
        }
        EXPECT_TRUE(r.plc.alarms().stands("size-X"));
        EXPECT_TRUE(
            r.had("alarm size-X came: the box requests more of X than the PLC's own size "
                  "of 90 um"));
        EXPECT_EQ(r.plc.duties().times_limited(), 1);
        r.box_runs_ms(600, active, 20.0);
        EXPECT_EQ(r.applied(), 20.0) << "from the size, not from the value beyond it";
        EXPECT_TRUE(r.plc.alarms().stands("size-X")) << "until reset";
        r.plc.press_reset();
        r.box_runs_ms(60, active, 20.0);
        EXPECT_TRUE(r.plc.alarms().standing().empty());
    }
}

TEST(Size, IsReachedWithoutAnAlarm) {
    rig r(sized_machine());
    r.box_runs_ms(1500, active, size_um);
    EXPECT_EQ(r.applied(), size_um);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
}

TEST(Size, ActsOnlyWhereTheValueIsTakenOver) {
    rig r(sized_machine());
    r.box_runs_ms(1500, standby, 10000.0);
    EXPECT_EQ(r.applied(), 0.0);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
}

TEST(Size, OfAFlickeringValueIsCountedEachTime) {
    rig r(sized_machine());
    r.box_runs_ms(1500, active, 0.0);
    for (int i = 0; i < 5; ++i) {
        r.box_runs_ms(30, active, 10000.0);
        r.box_runs_ms(30, active, 0.0);
    }
    EXPECT_EQ(r.plc.duties().times_limited(), 5);
    EXPECT_TRUE(r.plc.alarms().stands("size-X"));
}

TEST(Size, BelongsToTheAxis) {
    register_map map = small_map();
    map.write.count = 10;
    map.channels.push_back({"Y", 14, std::nullopt, map.channels[0].format, 0.01});
    map.channels.push_back({"X2", 16, std::nullopt, map.channels[0].format, 0.01});
    twin::twin_config config = sized_machine();
    config.axes[1] = config.axes[0];
    config.plc.axis_size_um[1] = 30.0;
    config.channels["X2"] = 'X';
    rig r(config, map);
    for (const int address : {14, 16}) r.set_reg(address, 0x7FFF);
    r.box_runs_ms(2000, active, 10000.0);
    EXPECT_EQ(r.plc.state().applied_um, (std::vector<double>{90.0, 30.0, 90.0}));
    for (const char *name : {"size-X", "size-Y", "size-X2"}) {
        EXPECT_TRUE(r.plc.alarms().stands(name)) << name;
    }
}

TEST(Size, IsForgottenByARestartOfThePlcAlone) {
    rig r(sized_machine());
    r.box_runs_ms(1500, active, 10000.0);
    ASSERT_TRUE(r.plc.alarms().stands("size-X"));
    r.plc.restart();
    r.run_ms(30);
    EXPECT_FALSE(r.plc.alarms().stands("size-X"));
    EXPECT_EQ(r.plc.duties().times_limited(), 0);
    r.box_runs_ms(1500, active, 10000.0);
    EXPECT_TRUE(r.plc.alarms().stands("size-X"));
    EXPECT_EQ(r.applied(), size_um);
}

// ---- values that are not numbers

register_map float_map() {
    register_map map = small_map();
    map.write.count = 8;
    map.channels[0].format = format("float32");
    map.channels[0].tangent = taken_tangent{14, 16, format("float32"), format("float32"), 1.0, 1.0};
    map.write.count = 8;
    return map;
}

void set_float(rig &r, int address, float value) {
    std::uint32_t bits;
    static_assert(sizeof bits == sizeof value);
    std::memcpy(&bits, &value, sizeof bits);
    r.set_reg(address, bits >> 16);
    r.set_reg(address + 1, bits & 0xFFFF);
}

void box_writes(rig &r, float um, float slope, float reference_mm) {
    r.set_reg(10, active), r.set_reg(11, ++r.beat);
    set_float(r, 12, um / 0.01f);
    set_float(r, 14, slope);
    set_float(r, 16, reference_mm);
}

TEST(NotANumber, IsNotTakenOverAndAfterTheWatchdogsTimeTheOffsetGoesToZero) {
    const float none[] = {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()};
    for (const float value : none) {
        for (int field = 0; field < 3; ++field) {
            SCOPED_TRACE(std::to_string(value) + " in field " + std::to_string(field));
            rig r(sized_machine(), float_map());
            const auto live_ms = [&](int duration_ms, float um, float slope, float at_mm) {
                for (int t = 0; t < duration_ms; t += 30) {
                    box_writes(r, um, slope, at_mm);
                    r.run_ms(30);
                }
            };
            live_ms(1500, 50.0f, 0.0f, 12.0f);
            EXPECT_NEAR(r.applied(), 50.0, 1e-4);
            const float bad[3] = {field == 0 ? value : 80.0f, field == 1 ? value : 0.0f,
                                  field == 2 ? value : 12.0f};
            live_ms(180, bad[0], bad[1], bad[2]);
            EXPECT_NEAR(r.applied(), 50.0, 1e-4) << "no part of the block is taken";
            EXPECT_TRUE(r.plc.alarms().stands("box-number"));
            EXPECT_TRUE(r.had("alarm box-number came: a value of the box is not a number"));
            live_ms(1500, bad[0], bad[1], bad[2]);
            EXPECT_EQ(r.applied(), 0.0);
            live_ms(300, 50.0f, 0.0f, 12.0f);
            EXPECT_NEAR(r.applied(), 50.0, 1e-4);
            EXPECT_TRUE(r.plc.alarms().standing().empty());
        }
    }
}

TEST(NotANumber, OfOneMotorHoldsTheOtherAsWell) {
    register_map map = small_map();
    map.write.count = 8;
    map.channels[0].format = format("float32");
    map.channels.push_back({"X2", 14, std::nullopt, format("float32"), 0.01});
    twin::twin_config config = sized_machine();
    config.channels["X2"] = 'X';
    rig r(config, map);
    const auto live_ms = [&](int duration_ms, float one, float two) {
        for (int t = 0; t < duration_ms; t += 30) {
            r.set_reg(10, active), r.set_reg(11, ++r.beat);
            set_float(r, 12, one), set_float(r, 14, two);
            r.run_ms(30);
        }
    };
    live_ms(1500, 4000.0f, 4000.0f);
    ASSERT_NEAR(r.applied(), 40.0, 1e-4);
    for (int i = 0; i < 60; ++i) {
        live_ms(30, std::nanf(""), -4000.0f);
        const auto &um = r.plc.state().applied_um;
        EXPECT_NEAR(um[0], um[1], 1e-9);
    }
    EXPECT_EQ(r.applied(), 0.0);
}

// ---- K0 + tan beta (P - P0)

// tan beta by 1e-6, P0 by 0.0001 mm, both int32.
register_map slope_map() {
    register_map map = small_map();
    map.write.count = 10;
    map.channels[0].tangent = taken_tangent{14, 16, format("int32"), format("int32"), 1e-6, 1e-4};
    return map;
}

void set_long(rig &r, int address, double raw) {
    const auto bits = static_cast<std::uint32_t>(static_cast<std::int32_t>(raw));
    r.set_reg(address, bits >> 16);
    r.set_reg(address + 1, bits & 0xFFFF);
}

void set_slope(rig &r, double slope, double reference_mm) {
    set_long(r, 14, std::round(slope * 1e6));
    set_long(r, 16, std::round(reference_mm * 1e4));
}

TEST(Size, HoldsForTheSumOfValueAndSlope) {
    for (const char *profile : {"generic", "sinumerik-840d"}) {
        SCOPED_TRACE(profile);
        rig r(sized_machine(), slope_map(), profile);
        r.box_runs_ms(1500, active, 60.0);
        ASSERT_TRUE(r.plc.alarms().standing().empty());
        set_slope(r, 0.001, 12.3456 - 500.0);  // 500 um more, where the axis stands
        extremes most;
        for (int i = 0; i < 60; ++i) {
            r.box_runs_ms(30, active, 60.0);
            most.add(r);
        }
        EXPECT_LE(most.applied_um, size_um + 1e-9);
        EXPECT_LE(most.here_um, size_um + 1e-9);
        EXPECT_LE(most.nc_um, size_um + 0.25 + 1e-9) << "half of what may tear";
        EXPECT_NEAR(most.here_um, size_um, 1e-9);
        EXPECT_TRUE(r.plc.alarms().stands("size-X"));
    }
}

TEST(Size, LeavesASlopeThatStaysWithinItAlone) {
    rig r(sized_machine(), slope_map());
    set_slope(r, -0.0005, 112.3456);  // 50 um, and 20 um ahead
    r.box_runs_ms(1500, active, -1.0);
    EXPECT_NEAR(r.plc.held()[0].at_um(12.3456), 49.0, 1e-6);
    EXPECT_NEAR(r.plc.held()[0].slope, -0.0005, 1e-12);
    EXPECT_NEAR(r.applied(), -1.0, 1e-9);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
}

// Calls look(position, seconds since the scan before) after each scan of the next duration_ms.
template <typename visitor>
void watch_scans(rig &r, double &before_s, std::int64_t duration_ms, visitor look) {
    r.now_us += duration_ms * ms;
    r.plc.run_to(r.now_us, [&](const plc_state &state) {
        look(state.position_mm[0], state.time_s - before_s);
        before_s = state.time_s;
    });
}

TEST(Size, ASlopeAloneIsTakenOverNoFasterThanAValue) {
    rig r(sized_machine(), slope_map());
    r.box_runs_ms(1500, active, 0.0);
    set_slope(r, 0.0005, 12.3456 - 100.0);
    double before_um = 0.0, before_s = r.plc.state().time_s;
    for (int i = 0; i < 40; ++i) {
        r.write(active, 0.0);
        watch_scans(r, before_s, 30, [&](double at_mm, double dt_s) {
            const double um = r.plc.duties().wanted()[0].at_um(at_mm);
            EXPECT_LE(std::fabs(um - before_um), slope_um_per_s * dt_s + 1e-9);
            before_um = um;
        });
    }
    EXPECT_NEAR(before_um, 50.0, 1e-6);
    EXPECT_TRUE(r.plc.alarms().standing().empty());
}

// A writer that draws numbers over nine decades, P0 near the axis or anywhere, while the axis
// moves.
class foreign_writer {
  public:
    foreign_writer(rig &r, std::uint64_t seed) : r_(r), dice_(seed, "foreign") {}

    void write() {
        move();
        if (dice_.uniform() < 0.25) set_slope(r_, any(0.01), reference_mm());
        const double um = dice_.uniform() < 0.5 ? dice_.symmetric(size_um) : any(2e7);
        r_.write(dice_.uniform() < 0.95 ? active : standby, um);
    }

  private:
    void move() {
        if (r_.plc.moving()) return;
        twin::twin_step step;
        step.target_mm[0] = 1000.0 * dice_.uniform();
        step.feed_mm_per_s = 20.0 + 200.0 * dice_.uniform();
        r_.plc.move(step);
    }
    double any(double most) {
        return dice_.symmetric(most) * std::pow(10.0, -6.0 * dice_.uniform());
    }
    double reference_mm() {
        return dice_.uniform() < 0.7 ? r_.plc.nc().position_mm()[0] : dice_.symmetric(2e5);
    }

    rig &r_;
    twin::random_stream dice_;
};

// 100 s of any numbers; the correction stays within one step of what it was where the axis is now.
extremes storm(const char *profile, std::uint64_t seed) {
    rig r(sized_machine(), slope_map(), profile);
    foreign_writer writer(r, seed);
    extremes most;
    r.run_ms(1100);
    correction before;
    double before_s = r.plc.state().time_s;
    for (int i = 0; i < 4000; ++i) {
        writer.write();
        watch_scans(r, before_s, 25, [&](double at_mm, double dt_s) {
            const double um = r.plc.duties().wanted()[0].at_um(at_mm);
            const double was_um = std::clamp(before.at_um(at_mm), -size_um, size_um);
            EXPECT_LE(std::fabs(um - was_um), slope_um_per_s * dt_s + 1e-9);
            before = r.plc.duties().wanted()[0];
            most.add(r);
        });
    }
    EXPECT_GT(r.plc.duties().times_limited(), 500);
    return most;
}

TEST(Size, HoldsWhateverIsWrittenAndHoweverTheAxisMoves) {
    for (const char *profile : {"generic", "sinumerik-840d"}) {
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
            SCOPED_TRACE(std::string(profile) + ", seed " + std::to_string(seed));
            const extremes most = storm(profile, seed);
            EXPECT_LE(most.applied_um, size_um + 1e-9);
            EXPECT_LE(most.here_um, size_um + 1e-9);
            EXPECT_LE(most.nc_um, 1.15 * size_um) << "slopes that turn while the axis moves";
            EXPECT_GT(most.here_um, 0.99 * size_um);
        }
    }
}

// Any 32 bits as a float: infinities, NaN, denormals and the largest numbers among them.
TEST(Size, HoldsForFloatsOfAnyBits) {
    for (const char *profile : {"generic", "sinumerik-840d"}) {
        SCOPED_TRACE(profile);
        rig r(sized_machine(), float_map(), profile);
        twin::random_stream dice(3, "bits");
        extremes most;
        r.run_ms(1100);
        int not_numbers = 0;
        double before_um = 0.0, before_s = r.plc.state().time_s;
        for (int i = 0; i < 8000; ++i) {
            box_writes(r, 80.0f, 0.0005f, 20.0f);
            for (int field = 12; field < 18; field += 2) {
                if (dice.uniform() < 0.6) continue;
                r.set_reg(field, static_cast<unsigned>(dice.next() & 0xFFFF));
                r.set_reg(field + 1, static_cast<unsigned>(dice.next() & 0xFFFF));
            }
            watch_scans(r, before_s, 30, [&](double at_mm, double dt_s) {
                const double um = r.plc.duties().wanted()[0].at_um(at_mm);
                EXPECT_LE(std::fabs(um - before_um), slope_um_per_s * dt_s + 1e-6);
                before_um = um;
                most.add(r);
                not_numbers += r.plc.duties().not_a_number() ? 1 : 0;
            });
        }
        EXPECT_LE(most.applied_um, size_um + 1e-9);
        EXPECT_LE(most.here_um, size_um + 1e-6);
        EXPECT_LE(most.nc_um, size_um + 0.25 + 1e-6);
        EXPECT_GT(r.plc.duties().times_limited(), 500);
        EXPECT_GT(not_numbers, 10);
    }
}

}  // namespace
}  // namespace compbox::fakeplc
