// SPDX-License-Identifier: MIT
// Models in the box: what each gives for signals, when it fades, and what the PLC is informed of.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/box_from_text.h"
#include "tests/support/config_fixture.h"

namespace compbox {
namespace {

const std::string file = R"({
  "format": "compbox/1", "revision": 1, "machine": {"name": "m"}, "cycle": {"period_ms": 30},
  "plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1"}},
    "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16},
    "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101, "heartbeat_timeout_ms": 200},
  "signals": [
    {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "Y", "unit": "mm", "plc": 10, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "Z", "unit": "mm", "plc": 12, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "T1", "unit": "degC", "can": "0x181", "type": "int16le", "scale": 0.1, "min": -50, "max": 150},
    {"name": "T2", "unit": "degC", "can": "0x182", "type": "int16le", "scale": 0.1, "min": -50, "max": 150},
    {"name": "L", "unit": "mm", "can": "0x183", "type": "int16le", "scale": 0.1, "min": 0, "max": 500, "essential": false}
  ],
  "terms": [
    {"name": "vol", "type": "volumetric", "chain": "XYfZ", "outputs": ["vol_x", "vol_y", "vol_z"],
     "errors": ["EXX", "EBX", "EAZ"], "tool_length": "L", "tool_offset_mm": [100, 200, 300],
     "reference_points_mm": {"X": [10, 20, 30], "Z": [0, 0, 400]}, "squareness_urad": {"C0Y": 20, "B0Z": 30, "A0Z": 40}},
    {"name": "growth", "type": "product", "term": "slope", "signal": "X", "origin": 250},
    {"name": "slope", "type": "linear", "inputs": ["T1", "T2"], "weights": [0.01, -0.005], "constant": 0.25},
    {"name": "EXX", "type": "polynomial", "signal": "X", "coefficients": [0, 0.02]},
    {"name": "EBX", "type": "polynomial", "signal": "X", "coefficients": [5, 0.01]},
    {"name": "EAZ", "type": "polynomial", "signal": "Z", "coefficients": [8]},
    {"name": "net", "type": "bpnet", "inputs": ["T1", "T2"], "outputs": ["net_x", "net_y"],
     "activation": "logsig", "hidden_weights": [[0.7, -1.1], [0.3, 0.9], [-0.4, 0.2]], "hidden_bias": [0.1, -0.2, 0.3],
     "output_weights": [[1, -2, 0.5], [0.25, 1.5, -1]], "output_bias": [0.7, -0.8], "linear_weights": [[0.5, 0], [0, 0.25]],
     "input_center": [20, 30], "input_scale": [10, 5], "output_center": [1, 2], "output_scale": [30, 40],
     "input_min": [10, 20], "input_max": [30, 40], "margin": [2, 2], "fade": [10, 10]}
  ],
  "channels": [
    {"name": "X", "sum": ["vol_x", "net_x", "growth"], "limit_um": 900, "error_um": 1000, "slew_um_per_s": 100000,
     "plc": 104, "type": "int32", "scale": 0.01},
    {"name": "Y", "sum": ["vol_y", "net_y"], "limit_um": 900, "error_um": 1000, "slew_um_per_s": 100000,
     "plc": 106, "type": "int32", "scale": 0.01}
  ],
  "safety": {"hold_ms": 500, "ramp_um_per_s": 50}
})";

enum { T1 = 3, T2 = 4, L = 5 };

struct model_rig : box_rig {
    double x = 400, y = -300, z = 150, t1 = 23, t2 = 34, l = 120;
    bool heard[6] = {true, true, true, true, true, true};

    explicit model_rig(const std::string &text = file) : box_rig(from_text(text)) {}
    void go() {
        const double values[] = {0, 0, 0, t1, t2, l};
        position(8, x);
        position(10, y);
        position(12, z);
        for (unsigned i = T1; i <= L; ++i) {
            if (heard[i])
                in.samples[in.sample_count++] = {static_cast<uint8_t>(i),
                                                 static_cast<float>(values[i] * 10), now_us};
        }
        step();
    }
    void go(unsigned count) {
        for (unsigned i = 0; i < count; ++i) go();
    }
    double term(const std::string &name) const {
        for (unsigned i = 0; i < box->config.outputs_count; ++i) {
            if (name == box->config.outputs[i].name) return box->outputs[i];
        }
        return NAN;
    }
    const cb_counters &counted() const { return box->counters; }
};

// The network as the file says it, unfolded, in double.
std::vector<double> network(double t1, double t2) {
    const double w[3][2] = {{0.7, -1.1}, {0.3, 0.9}, {-0.4, 0.2}}, b[] = {0.1, -0.2, 0.3};
    const double v[2][3] = {{1, -2, 0.5}, {0.25, 1.5, -1}}, c[] = {0.7, -0.8};
    const double n[] = {(t1 - 20) / 10, (t2 - 30) / 5}, linear[] = {0.5 * n[0], 0.25 * n[1]};
    const double center[] = {1, 2}, scale[] = {30, 40};
    std::vector<double> y;
    for (int k = 0; k < 2; ++k) {
        double sum = c[k] + linear[k];
        for (int i = 0; i < 3; ++i)
            sum += v[k][i] / (1 + std::exp(-(w[i][0] * n[0] + w[i][1] * n[1] + b[i])));
        y.push_back(center[k] + scale[k] * sum);
    }
    return y;
}

TEST(terms, linear_and_product) {
    model_rig rig;
    rig.go();
    EXPECT_NEAR(rig.term("slope"), 0.25 + 0.23 - 0.17, 1e-6);
    EXPECT_NEAR(rig.term("growth"), 0.31 * (400 - 250), 1e-4);
    rig.x = -100;
    rig.t2 = 20;
    rig.go();
    EXPECT_NEAR(rig.term("growth"), 0.38 * (-100 - 250), 1e-4);
}

TEST(terms, network_within_its_range) {
    model_rig rig;
    for (double t : {10.0, 17.5, 29.9}) {
        rig.t1 = t;
        rig.t2 = 50 - t;
        rig.go();
        EXPECT_NEAR(rig.term("net_x"), network(t, 50 - t)[0], 1e-4) << t;
        EXPECT_NEAR(rig.term("net_y"), network(t, 50 - t)[1], 1e-4) << t;
    }
    EXPECT_EQ(rig.counted().models_extrapolated, 0u);
}

// X and Y carry the workpiece, Z the tool. With all axes at 0 the tip without tool is at (100, 200,
// 300); the tool points down. L_X = tip + x + y + z - reference; L_Z = tip without travel of Z.
TEST(terms, volumetric_by_hand) {
    model_rig rig;
    rig.go();
    const double exx = 0.02 * 400, ebx = 5 + 0.01 * 400, eaz = 8;
    const double lx[] = {100 - 10 + 400, 200 - 20 - 300, 300 - 30 + 150 - 120};
    const double lz[] = {100, 200, 300 - 400 - 120};
    // eps x L for eps = (0, ebx, 0): (ebx Lz, 0, -ebx Lx); for (eaz, 0, 0): (0, -eaz Lz, eaz Ly)
    const double ex = exx + 1e-3 * (ebx * lx[2] + 30.0 * 150 - 20.0 * -300);
    const double ey = 1e-3 * (-eaz * lz[2] - 40.0 * 150);
    const double ez = 1e-3 * (-ebx * lx[0] + eaz * lz[1]);
    EXPECT_NEAR(rig.term("vol_x"), ex, 1e-4);
    EXPECT_NEAR(rig.term("vol_y"), ey, 1e-4);
    EXPECT_NEAR(rig.term("vol_z"), ez, 1e-4);
}

// All 18 errors, and all but one that is zero.
TEST(terms, a_volumetric_term_has_any_of_the_errors) {
    const auto with_errors = [](bool all) {
        std::string errors = R"("EXX", "EBX", "EAZ")", terms;
        for (const char axis : std::string("XYZ")) {
            for (const char kind : std::string("XYZABC")) {
                const std::string name{'E', kind, axis};
                if (errors.find(name) != std::string::npos) continue;
                if (all || name != "EZZ") errors += ", \"" + name + "\"";
                terms += R"({"name": ")" + name + R"(", "type": "polynomial", "signal": ")" + axis +
                         R"(", "coefficients": [)" + (name == "EZZ" ? "0" : "3, 0.01") + "]}, ";
            }
        }
        const std::string slope = R"({"name": "slope")";
        return compbox_test::with(R"("EXX", "EBX", "EAZ")", errors,
                                  compbox_test::with(slope, terms + slope, file));
    };
    model_rig few, most(with_errors(false)), all(with_errors(true));
    for (model_rig *rig : {&few, &most, &all}) rig->go();
    for (const char *output : {"vol_x", "vol_y", "vol_z"}) {
        EXPECT_EQ(all.term(output), most.term(output));
        EXPECT_GT(std::fabs(all.term(output) - few.term(output)), 1);
    }
}

TEST(terms, a_little_outside_is_counted_and_goes_on) {
    model_rig rig;
    rig.go(3);
    rig.t1 = 31;  // trained to 30, margin 2
    rig.go();
    EXPECT_NEAR(rig.term("net_x"), network(31, 34)[0], 1e-4);
    EXPECT_EQ(rig.counted().models_extrapolated, 1u);
    EXPECT_EQ(rig.counted().models_weakened, 0u);
    EXPECT_EQ(rig.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(rig.reason(), CB_REASON_EXTRAPOLATED);
    EXPECT_EQ(rig.out.registers[0], CB_MODE_ACTIVE | CB_REASON_EXTRAPOLATED << 8);
    rig.t1 = 30;
    rig.go();
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
}

TEST(terms, far_outside_it_fades_and_says_so) {
    model_rig rig;
    rig.go(3);
    rig.t1 = 37;  // 5 of 10 beyond the margin
    rig.go();
    EXPECT_NEAR(rig.term("net_x"), 0.5 * network(32, 34)[0], 1e-4);
    EXPECT_EQ(rig.counted().models_weakened, 1u);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_NE(rig.term("vol_x"), 0) << "the rest goes on";
    rig.t1 = 60;
    rig.go();
    EXPECT_EQ(rig.term("net_x"), 0);
    double last = rig.term("net_x");
    for (double t = 60; t > 20; t -= 0.1) {  // no step anywhere on the way back
        rig.t1 = t;
        rig.go();
        EXPECT_LT(std::fabs(rig.term("net_x") - last), 1.5) << t;
        last = rig.term("net_x");
    }
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
}

// A missing thermometer takes down what stands on it, and only that.
TEST(terms, what_uses_a_fading_term_fades_itself) {
    model_rig rig;
    rig.go(3);
    const double growth = rig.term("growth"), net = rig.term("net_x"), vol = rig.term("vol_x");
    rig.heard[T2] = false;
    rig.go(65);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE) << "its last value serves for two seconds";
    rig.go(1);
    EXPECT_EQ(rig.reason(), CB_REASON_DEGRADED);
    EXPECT_NEAR(rig.term("growth"), growth - 1.5, 1e-3);
    EXPECT_NEAR(std::fabs(rig.term("net_x")), std::fabs(net) - 1.5, 1e-3);
    EXPECT_EQ(rig.term("vol_x"), vol);
    EXPECT_EQ(rig.counted().terms_faded, 3u) << "slope, growth, net";
    rig.go(100);
    EXPECT_EQ(rig.term("growth"), 0);
    rig.heard[T2] = true;
    rig.go();
    EXPECT_NEAR(rig.term("growth"), growth, 1e-4);
    EXPECT_EQ(rig.reason(), CB_REASON_NONE);
    rig.heard[L] = false;
    rig.go(70);
    EXPECT_LT(std::fabs(rig.term("vol_x")), std::fabs(vol));
    EXPECT_EQ(rig.counted().terms_faded, 4u);
    EXPECT_NEAR(rig.term("growth"), growth, 1e-4);
}

TEST(terms, a_product_that_overflows_is_counted_and_fades) {
    std::string text =
        compbox_test::with(R"("coefficients": [8])", R"("coefficients": [1e8])", file);
    const std::string kaz = R"({"name": "K1", "type": "product", "term": "EAZ", "signal": "X"},
        {"name": "K2", "type": "product", "term": "K1", "signal": "X", "origin": 1e9},
        {"name": "K3", "type": "product", "term": "K2", "signal": "X", "origin": 1e9},
        {"name": "K4", "type": "product", "term": "K3", "signal": "X", "origin": 1e9},
        {"name": "K5", "type": "product", "term": "K4", "signal": "X", "origin": 1e9}, )";
    text = compbox_test::with(R"({"name": "slope")", kaz + R"({"name": "slope")", text);
    model_rig rig(text);
    rig.go();
    EXPECT_EQ(rig.counted().terms_not_finite, 1u);
    EXPECT_EQ(rig.term("K5"), 0);
    EXPECT_TRUE(std::isfinite(rig.term("K4")));
}

// Curves of one position that share their breaks, and one that does not: each has the bits of its
// own evaluation wherever the axis stands, jumps or leaves the curves.
TEST(terms, curves_on_the_same_breaks_are_each_their_own) {
    config_builder b;
    const unsigned x = b.position("X", 8, -500, 1500), y = b.position("Y", 10, -500, 1500);
    const std::vector<float> breaks = {0, 100, 110, 400, 1000}, others = {0, 100, 120, 400, 1000};
    b.polyline("A", x, breaks, {1, 5, 2, -8, 3});
    b.polyline("B", y, breaks, {2, 5, 2, -8, 3});
    b.polyline("C", x, others, {3, 5, 2, -8, 3});
    b.polynomial("D", x, {1, 0.5f});
    b.polyline("E", x, breaks, {-9, 15, 22, 8, 30});
    b.channel("Z", {0, 1, 2, 3, 4}, 4);
    box_rig rig(b);
    EXPECT_EQ(rig.box->config.grids_count, 3);
    std::mt19937 random(9);
    uint32_t outside = 0;
    for (int i = 0; i < 5000; ++i) {
        const double places[] = {0, 100, 110, 120, 400, 1000, -300, 1400};
        for (unsigned axis : {x, y}) {
            const double mm = i % 3 == 0 ? places[random() % 8]
                                         : static_cast<double>(random() % 12000) * 0.1 - 100;
            rig.position(8 + 2 * axis, mm);
        }
        rig.step();
        const cb_config &c = rig.box->config;
        for (unsigned t : {0u, 1u, 2u, 4u}) {
            const cb_curve_config &curve = c.terms[t].as.curve;
            const float *at = c.pool + curve.pool;
            const cb_ppoly own = {at, at + curve.spans + 1, curve.spans_per_unit, curve.spans,
                                  curve.degree};
            const cb_curve_value value =
                cb_ppoly_evaluate(&own, rig.box->signals[curve.signal].used);
            ASSERT_EQ(rig.box->outputs[t], value.value) << t << ' ' << i;
            outside += value.outside;
        }
    }
    EXPECT_GT(outside, 1000u);
    EXPECT_GE(rig.box->counters.outside_curve, outside) << "the polynomial is left too";
}

}  // namespace
}  // namespace compbox
