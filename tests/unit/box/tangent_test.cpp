// SPDX-License-Identifier: MIT
// Tangent mode: slopes against differences of the values themselves, what stands in the registers,
// when the slope is given up, its limits whatever happens, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/support/box_from_text.h"
#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"
#include "tests/support/dice.h"
#include "tests/support/paths.h"

namespace compbox {
namespace {

using compbox_test::with;

// Every kind of term depends on X in some way.
const std::string file = R"({
  "format": "compbox/1", "revision": 1, "machine": {"name": "m"}, "cycle": {"period_ms": 30},
  "plc": {"profile": "sinumerik-840d", "transport": {"tcp": {"host": "127.0.0.1"}},
    "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16, "counters": true},
    "control": 0, "plc_heartbeat": 1, "status": 101, "box_heartbeat": 102, "heartbeat_timeout_ms": 200},
  "signals": [
    {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "Y", "unit": "mm", "plc": 10, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "Z", "unit": "mm", "plc": 12, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "T", "unit": "degC", "plc": 14, "type": "int16", "scale": 0.1, "min": -50, "max": 150}
  ],
  "terms": [
    {"name": "vol", "type": "volumetric", "chain": "XYfZ", "outputs": ["vol_x", "vol_y", "vol_z"],
     "errors": ["EXX", "EBX", "EAZ", "ECY"], "tool_length": "Z", "tool_offset_mm": [100, 200, 300],
     "reference_points_mm": {"X": [10, 20, 30]}, "squareness_urad": {"C0Y": 20, "B0Z": 30}},
    {"name": "EXX", "type": "bspline", "signal": "X", "degree": 3, "knots": [-2000, -2000, -2000, -2000, 0, 2000, 2000, 2000, 2000],
     "control_points": [0, 40, -30, 20, 5]},
    {"name": "EBX", "type": "polynomial", "signal": "X", "half_range": 2000, "coefficients": [1, 20, -9]},
    {"name": "EAZ", "type": "polynomial", "signal": "Z", "coefficients": [8]},
    {"name": "ECY", "type": "polyline", "signal": "Y", "positions": [-2000, 2000], "values": [-9, 12]},
    {"name": "growth", "type": "product", "term": "slope", "signal": "X", "origin": 250},
    {"name": "slope", "type": "linear", "inputs": ["T", "X"], "weights": [0.001, 0.00001], "constant": -0.01},
    {"name": "net", "type": "bpnet", "inputs": ["X", "T"], "outputs": ["net_x", "net_y"], "activation": "tansig",
     "hidden_weights": [[0.7, -1.1], [0.3, 0.9], [-0.4, 0.2]], "hidden_bias": [0.1, -0.2, 0.3],
     "output_weights": [[1, -2, 0.5], [0.25, 1.5, -1]], "output_bias": [0.7, -0.8], "linear_weights": [[0.5, 0], [0, 0.25]],
     "input_center": [0, 20], "input_scale": [1000, 10], "output_scale": [10, 40],
     "input_min": [-900, 0], "input_max": [900, 40], "margin": [100, 5], "fade": [600, 10]}
  ],
  "channels": [
    {"name": "X", "sum": ["vol_x", "net_x", "growth"], "limit_um": 900, "error_um": 1000, "slew_um_per_s": 100000,
     "sign": -1, "plc": 104, "type": "int32", "scale": 0.01,
     "tangent": {"signal": "X", "slope_plc": 106, "slope_type": "int32", "slope_scale": 1e-8, "slope_limit": 0.01,
       "slope_slew_per_s": 0.05, "reference_plc": 108, "reference_type": "int32", "reference_scale": 0.001}},
    {"name": "Y", "sum": ["vol_y", "net_y"], "limit_um": 900, "error_um": 1000, "slew_um_per_s": 100000,
     "plc": 110, "type": "int32", "scale": 0.01}
  ],
  "safety": {"hold_ms": 500, "ramp_um_per_s": 50}
})";

enum { X_SLOPE = 2 };  // behind the channels X and Y

struct tangent_rig : box_rig {
    double x = 400, y = -300, z = 150, t = 23;
    explicit tangent_rig(const std::string &text = file) : box_rig(from_text(text)) {}
    void go(unsigned count = 1) {
        for (unsigned i = 0; i < count; ++i) {
            position(8, x);
            position(10, y);
            position(12, z);
            in.registers[14] = static_cast<uint16_t>(std::lround(t * 10));
            step();
        }
    }
    double wanted_um() const { return box->channels[0].wanted_um; }
    double wanted_slope() const { return box->channels[X_SLOPE].wanted_um; }  // µm/m
    double slope() const { return box->channels[X_SLOPE].output_um; }
};

TEST(tangent, is_the_slope_of_the_whole_channel) {
    tangent_rig rig;
    ASSERT_EQ(compbox_test::invariants(rig.box->config).broken, "");
    for (const double t : {23.0, 44.0, 52.0}) {  // inside, in the margin, fading
        for (const double x :
             {-1900.0, -1310.0, -1250.0, -700.0, -1.0, 3.0, 555.5, 950.0, 1222.0}) {
            rig.t = t;
            const double step = 2;
            rig.x = x - step;
            rig.go();
            const double below = rig.wanted_um();
            rig.x = x + step;
            rig.go();
            const double above = rig.wanted_um();
            rig.x = x;
            rig.go();
            EXPECT_NEAR(rig.wanted_slope(), (above - below) / (2 * step) * 1000, 0.1)
                << "x " << x << ", t " << t;
        }
    }
}

TEST(tangent, what_stands_in_the_registers) {
    tangent_rig rig;
    rig.go(20);
    EXPECT_NEAR(rig.written(4), -rig.wanted_um(), 0.006) << "K0, sign -1";
    EXPECT_NEAR(get_int32(rig.out.registers + 6) * 1e-8, -rig.wanted_slope() * 1e-6, 1e-8);
    EXPECT_NEAR(get_int32(rig.out.registers + 8) * 0.001, 400, 0.0006);
    EXPECT_EQ(rig.out.registers[0], rig.out.registers[15]) << "sequence number";
}

TEST(tangent, is_evaluated_at_the_reference_with_lead) {
    tangent_rig rig(with("\"period_ms\": 30", "\"period_ms\": 30, \"lead_ms\": 100", file));
    for (int i = 0; i < 60; ++i) {
        rig.x += 3;
        rig.go();
    }
    const double reference = get_int32(rig.out.registers + 8) * 0.001;
    EXPECT_NEAR(reference, rig.x + 10, 0.01);
    tangent_rig there;
    there.x = reference;
    there.go(60);
    EXPECT_NEAR(rig.wanted_um(), there.wanted_um(), 0.02);
    EXPECT_NEAR(rig.wanted_slope(), there.wanted_slope(), 0.02);
}

// A PLC that moves in straight lines shows, at the new reference, values between the tangent before
// and the new one. Within its deadband the value itself does not move meanwhile.
TEST(tangent, a_straight_line_from_the_tangent_before_is_applied_as_sent) {
    struct plc_program {
        const char *interpolate_ms;
        int times;  // how far it is towards the tangent before, in a straight line at most 1
        bool foreign;
    };
    for (const plc_program &plc : {plc_program{"30", 1, false}, {"30", 3, true}, {"0", 1, true}}) {
        const std::string keys = std::string("\"plc\": {\"interpolate_ms\": ") +
                                 plc.interpolate_ms + ", \"deadband_um\": 0,";
        tangent_rig rig(with("\"sign\": -1,", "\"sign\": -1, \"deadband_um\": 30, \"applied\": 24,",
                             with("\"plc\": {", keys, file)));
        rig.x = 0;
        double um = 0, slope = 0, reference_mm = 0;
        int moved = 0;
        for (int i = 0; i < 60; ++i) {
            const double new_um = rig.written(4),
                         way_mm = get_int32(rig.out.registers + 8) * 0.001 - reference_mm;
            const double there_um = um + slope * way_mm * 1000;
            moved += std::fabs(there_um - um) > 0.05 && new_um == um;
            put_int32(rig.in.registers + 24, (new_um + plc.times * (there_um - new_um)) * 100);
            um = new_um;
            slope = get_int32(rig.out.registers + 6) * 1e-8;
            reference_mm += way_mm;
            rig.x += i > 20 ? 10 : 0;
            rig.go();
        }
        EXPECT_GT(moved, 10);
        EXPECT_EQ(rig.box->counters.applied_foreign > 0, plc.foreign)
            << plc.interpolate_ms << " ms, " << plc.times << " times";
    }
}

TEST(tangent, is_given_up_outside_of_active_and_at_the_limit) {
    tangent_rig rig;
    rig.go(20);
    const double k0 = rig.output();
    EXPECT_GT(std::fabs(rig.slope()), 3);
    rig.reading = false;
    rig.go(8);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.output(), k0) << "the value stays";
    EXPECT_EQ(rig.slope(), 0) << "the slope does not";
    rig.reading = true;
    rig.in.registers[0] = 0xB;
    rig.go(20);
    EXPECT_NE(rig.slope(), 0);
    rig.control(2);  // enable off: zero at the ramp, the slope at once
    rig.go(4);
    EXPECT_NE(rig.output(), 0);
    EXPECT_EQ(rig.slope(), 0);
    tangent_rig low(
        with("\"limit_um\": 900, \"error_um\": 1000, \"slew_um_per_s\": 100000,\n     \"sign\"",
             "\"limit_um\": 1, \"error_um\": 1000, \"slew_um_per_s\": 100000, \"sign\"", file));
    low.go(20);
    EXPECT_EQ(std::fabs(low.output()), 1);
    EXPECT_EQ(low.slope(), 0) << "an output at its limit does not follow the error";
}

TEST(tangent, is_clamped_and_counted) {
    tangent_rig rig(with("\"slope_limit\": 0.01", "\"slope_limit\": 1e-5", file));
    rig.x = 1000;
    rig.go(20);
    EXPECT_EQ(std::fabs(rig.slope()), 10);
    EXPECT_GT(std::fabs(rig.wanted_slope()), 10);
    EXPECT_GT(rig.box->counters.slopes_limited, 0u);
}

// Whatever the positions, the wire and the control word do.
TEST(tangent, limits_always_hold) {
    compbox_test::dice random(5);
    for (int run = 0; run < 40; ++run) {
        tangent_rig rig(
            with("\"slope_limit\": 0.01, \n", "\"slope_limit\": 0.01,\n",
                 with("\"slope_slew_per_s\": 0.05", "\"slope_slew_per_s\": 0.012",
                      with("\"slope_limit\": 0.01,", "\"slope_limit\": 0.01, \n", file))));
        const cb_channel_config &config = rig.box->config.channels[X_SLOPE];
        double last = 0;
        for (int i = 0; i < 300; ++i) {
            if (random(10u) == 0) rig.x = static_cast<double>(random(4001u)) - 2000;
            if (random(10u) == 0) rig.t = static_cast<double>(random(220u)) - 60;
            rig.x =
                std::fmax(-2000, std::fmin(2000, rig.x + static_cast<double>(random(31u)) - 15));
            rig.reading = random(12u) != 0;
            rig.beating = random(12u) != 0;
            rig.write = random(8u) ? CB_TRANSFER_OK : static_cast<cb_transfer>(1 + random(4u));
            rig.control(random(15u) == 0 ? random(16u) : 0xBu);
            const int64_t elapsed_us = random(20u) ? 30000 : 1000 * random(400u);
            rig.position(8, rig.x);
            rig.position(10, rig.y);
            rig.position(12, rig.z);
            rig.in.registers[14] = static_cast<uint16_t>(std::lround(rig.t * 10));
            rig.step(elapsed_us);
            const double slope = rig.slope();
            ASSERT_LE(std::fabs(slope), config.limit_um);
            ASSERT_TRUE(std::isfinite(slope));
            const double most =
                config.slew_um_per_s * std::fmin(static_cast<double>(elapsed_us), 60000) * 1e-6;
            ASSERT_LE(std::fabs(slope - last), std::fmax(most, config.scale) * 1.0001 + 1e-3)
                << run << ", " << i;
            ASSERT_NEAR(get_int32(rig.out.registers + 6) * 1e-2, -slope, 1e-2);
            last = slope;
        }
    }
}

TEST(tangent, outlives_a_reload_and_is_not_moved_under_the_plc) {
    tangent_rig rig, fresh;
    rig.go(20);
    ASSERT_TRUE(cb_box_adopt(fresh.box.get(), rig.box.get()));
    EXPECT_EQ(fresh.slope(), rig.slope());
    EXPECT_EQ(fresh.box->tangent.reference[0], rig.box->tangent.reference[0]);
    const char *const others[][2] = {
        {"\"reference_scale\": 0.001", "\"reference_scale\": 0.002"},
        {"\"reference_plc\": 108", "\"reference_plc\": 112"},
        {"\"reference_type\": \"int32\"", "\"reference_type\": \"float32\""},
        {"\"tangent\": {\"signal\": \"X\"", "\"tangent\": {\"signal\": \"Y\""},
    };
    for (const auto &[piece, change] : others) {
        tangent_rig other(with(piece, change, file));
        EXPECT_FALSE(cb_box_adopt(other.box.get(), rig.box.get())) << change;
    }
}

TEST(tangent, every_mistake_has_its_sentence) {
    const struct {
        const char *piece, *other, *message;
    } mistakes[] = {
        {", \"counters\": true", "",
         "channels[0].tangent: the PLC needs plc.write.counters to recognise a torn "
         "block: value, slope and reference belong together"},
        {"\"tangent\": {\"signal\": \"X\"", "\"tangent\": {\"signal\": \"T\"",
         "channels[0].tangent.signal: \"T\" is not a position in mm from the PLC, which a "
         "tangent needs"},
        {"{\"name\": \"X\", \"unit\": \"mm\"", "{\"name\": \"X\", \"unit\": \"deg\"",
         "channels[0].tangent.signal: \"X\" is not a position in mm from the PLC, which a "
         "tangent needs"},
        {"\"tangent\": {\"signal\": \"X\"", "\"tangent\": {\"signal\": \"Q\"",
         "channels[0].tangent.signal: no signal is called \"Q\""},
        {"\"slope_type\": \"int32\"", "\"slope_type\": \"uint32\"",
         "channels[0].tangent.slope_type: \"uint32\" is unsigned, and a slope may be negative; use "
         "a "
         "signed type"},
        {"\"slope_type\": \"int32\"", "\"slope_type\": \"int16\"",
         "channels[0].tangent.slope_limit: 0.01 in units of 1e-8 (slope_scale) does not fit into "
         "\"int16\""},
        {"\"slope_limit\": 0.01", "\"slope_limit\": 0.2",
         "channels[0].tangent.slope_limit: 0.2 is outside the range of 1e-6 to 0.1"},
        {"\"slope_scale\": 1e-8", "\"slope_scale\": 0.5",
         "channels[0].tangent.slope_limit: 0.01 is less than one unit of the register, 0.5 "
         "(slope_scale)"},
        {"\"slope_slew_per_s\": 0.05", "\"slope_slew_per_s\": 0.005",
         "channels[0].tangent.slope_slew_per_s: 0.005 is below slope_limit (0.01): the slope must "
         "be "
         "able to reach zero within a second"},
        {"\"reference_type\": \"int32\"", "\"reference_type\": \"int16\"",
         "channels[0].tangent.reference_type: positions of X in units of 0.001 (reference_scale) "
         "do "
         "not fit into \"int16\""},
        {"\"scale\": 0.0001, \"min\": -2000, \"max\": 2000},\n    {\"name\": \"Y\"",
         "\"scale\": 0.0001, \"min\": -2000, \"max\": 9e6},\n    {\"name\": \"Y\"",
         "channels[0].tangent.reference_type: positions of X in units of 0.001 (reference_scale) "
         "do not fit into \"int32\""},
        {"\"slope_type\": \"int32\"", "\"slope_type\": \"int32cdab\"",
         "channels[0].tangent.slope_type: profile sinumerik-840d has no \"int32cdab\": an S7 as "
         "Modbus server keeps the order "
         "ABCD; use int16, int32 or float32"},
        {"\"reference_type\": \"int32\"", "\"reference_type\": \"int32cdab\"",
         "channels[0].tangent.reference_type: profile sinumerik-840d has no \"int32cdab\": an S7 "
         "as Modbus server keeps the order "
         "ABCD; use int16, int32 or float32"},
        {"\"slope_plc\": 106", "\"slope_plc\": 105",
         "channels[0].tangent.slope_plc: register 105 already belongs to channel X"},
        {"\"reference_plc\": 108", "\"reference_plc\": 115",
         "channels[0].tangent.reference_plc: registers 115 and 116: the second is outside "
         "plc.write, "
         "100 to 115"},
        {"\"reference_plc\": 108, ", "", "channels[0].tangent: the key reference_plc is missing"},
        {"\"slope_limit\"", "\"slope_limt\"",
         "channels[0].tangent.slope_limt: unknown key; is slope_limit meant?"},
        {"\"safety\"",
         "\"pairs\": [{\"channels\": [\"X\", \"Y\"], \"max_difference_um\": 9}], \"safety\"",
         "pairs[0].channels[0]: channel \"X\" has a tangent, which could move the pair apart "
         "between two writes"},
    };
    for (const auto &[piece, other, message] : mistakes)
        EXPECT_EQ(compbox_test::load(with(piece, other, file)).text, message) << other;
}

// examples/sinumerik-law: at 32.3 degC tan(beta) is 0.000132 by the control's manual. K0(T) and
// tan(beta)(T) as a polynomial and a linear term, and the control's own law over them.
std::string law() {
    std::ifstream example(from_source("examples/sinumerik-law/coefficients.json"));
    std::stringstream text;
    text << example.rdbuf();
    return text.str();
}

float get_float(const uint16_t *registers) {
    const uint32_t bits = static_cast<uint32_t>(registers[0]) << 16 | registers[1];
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

TEST(tangent, sinumerik_law_at_its_check_value) {
    box_rig rig(from_text(law()));
    rig.in.registers[14] = 323;
    for (int i = 0; i < 40; ++i) {
        rig.position(8, 1020);
        rig.step();
    }
    const double tan_beta = get_float(rig.out.registers + 6);
    EXPECT_NEAR(tan_beta, 0.000132, 0.0000005);
    EXPECT_EQ(get_float(rig.out.registers + 8), 1020) << "P0 is where it was evaluated";
    const double k0 = get_float(rig.out.registers + 4) * 1000;  // SD43900 in mm
    EXPECT_NEAR(k0, 4.65 + 0.132158 * 700, 1e-3) << "K0 is the whole error there";
    // what the control makes of it half a metre on is the law itself
    const double p = 1520;
    EXPECT_NEAR(k0 + 1000 * tan_beta * (p - 1020), 4.65 + 0.132158 * (p - 320), 1e-3);
}

}  // namespace
}  // namespace compbox
