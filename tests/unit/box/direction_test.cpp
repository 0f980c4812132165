// SPDX-License-Identifier: MIT
// Curves with a branch for each direction, in the box: keys, start, reversal, HOLD, reload, and
// what is refused.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/box_fixture.h"
#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"

namespace compbox {
namespace {

using compbox_test::full_example;
using compbox_test::with;

const std::string polyline_example =
    R"({"name": "EYX", "type": "polyline", "signal": "X", "positions": [0, 240, 500], "values": [0, 12, -3]})";
const std::string polyline_branched =
    R"({"name": "EYX", "type": "polyline", "signal": "X", "positions": [0, 240, 500], "values": [0, 12, -3],
        "reversal_mm": 0.5, "backward": {"positions": [0, 500], "values": [-10, -20]}})";

std::string branched() {
    return with(polyline_example, polyline_branched);
}

compbox_test::loaded load(const std::string &text) {
    return compbox_test::load(text);
}

TEST(box_direction, every_curve_may_have_a_branch) {
    std::string text = branched();
    text = with(R"("control_points": [0, 10.5, -20, 5, 1e1]})",
                R"("control_points": [0, 10.5, -20, 5, 1e1], "reversal_mm": 2,
        "backward": {"degree": 2, "knots": [0, 0, 0, 9, 9, 9], "control_points": [1, 2, 4]}})",
                text);
    text = with(R"({"name": "KB")", R"({"name": "KX", "type": "polynomial", "signal": "X",
        "coefficients": [1, 2], "half_range": 14300, "reversal_mm": 3,
        "backward": {"coefficients": [7, -1], "from": 5, "half_range": 2000}}, {"name": "KB")",
                text);
    const auto got = load(text);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    EXPECT_EQ(compbox_test::invariants(c).broken, "");
    ASSERT_EQ(c.branches_count, 3);
    const cb_curve_config &spline = c.branches[c.terms[0].as.curve.backward];
    EXPECT_EQ(spline.degree, 2);
    EXPECT_EQ(spline.spans, 1);
    EXPECT_EQ(c.terms[0].as.curve.degree, 3);
    const cb_curve_config &line = c.branches[c.terms[1].as.curve.backward];
    EXPECT_EQ(c.pool[line.pool + 2], -10.0f);
    EXPECT_EQ(c.terms[1].as.curve.reversal_mm, 0.5f);
    const cb_curve_config &polynomial = c.branches[c.terms[3].as.curve.backward];
    EXPECT_EQ(polynomial.from, 5.0f);
    EXPECT_EQ(polynomial.to, 14300.0f) << "max of its signal";
    EXPECT_EQ(c.terms[2].as.curve.reversal_mm, 0.0f);
}

struct mistake {
    const char *piece, *other, *message;
};

TEST(box_direction, every_mistake_has_its_sentence) {
    const mistake mistakes[] = {
        {R"("reversal_mm": 0.5, )", "",
         "CB_ERROR_KEY terms[1]: backward needs the key reversal_mm too"},
        {R"(, "backward": {"positions": [0, 500], "values": [-10, -20]})", "",
         "CB_ERROR_KEY terms[1].reversal_mm: this key is for curves with a branch backward"},
        {R"("reversal_mm": 0.5)", R"("reversal_mm": 0)",
         "CB_ERROR_RANGE terms[1].reversal_mm: 0 is outside the range of 0.001 to 1000"},
        {R"("reversal_mm": 0.5)", R"("reversal_mm": 0.0142)",
         "CB_ERROR_RANGE terms[1].reversal_mm: 0.0142 is less than a millionth of the furthest "
         "position of X, which is about what float32 resolves"},
        {R"("reversal_mm": 0.5)", R"("reversal_mm": "0.5")",
         "CB_ERROR_TYPE terms[1].reversal_mm: must be a number, not \"0.5\""},
        {R"("backward": {"positions": [0, 500], "values": [-10, -20]})", R"("backward": [1, 2])",
         "CB_ERROR_TYPE terms[1].backward: must be an object {…}, not a list […]"},
        {R"("backward": {"positions": [0, 500], )", R"("backward": {)",
         "CB_ERROR_KEY terms[1].backward: the key positions is missing"},
        {R"("positions": [0, 500])", R"("positions": [0, 0])",
         "CB_ERROR_ORDER terms[1].backward.positions[1]: 0 is not above the position before it "
         "(0); the box keeps 24 bits, about 7 digits"},
        {R"([-10, -20])", R"([-10])",
         "CB_ERROR_RANGE terms[1].backward.values: 1 values for 2 positions; each position needs "
         "one"},
        {R"("backward": {"positions")", R"("backward": {"name": "EYX", "positions")",
         "CB_ERROR_KEY terms[1].backward.name: unknown key"},
        {R"("backward": {"positions")", R"("backward": {"degree": 3, "positions")",
         "CB_ERROR_KEY terms[1].backward.degree: unknown key"},
        {R"("signal": "X", "positions")", R"("signal": "T1", "positions")",
         "CB_ERROR_NAME terms[1].backward: a direction of travel needs a position in mm, and the "
         "unit of T1 is degC"},
        {R"("type": "polyline", )", R"("type": "linear", )",
         "CB_ERROR_KEY terms[1].signal: unknown key; is sigma meant?"},
    };
    for (const auto &[piece, other, message] : mistakes) {
        const auto got = load(with(piece, other, branched()));
        EXPECT_EQ(compbox_test::error_name(got.error) + " " + got.text, message)
            << piece << " -> " << other;
    }
}

// One axis with a lost motion of 8 µm: 6 forward and -2 backward, and a slope in either.
struct axis_rig : box_rig {
    double x = 100;
    explicit axis_rig(float reversal_mm = 0.5f, uint32_t lead_us = 0)
        : box_rig(builder(reversal_mm, lead_us)) {}
    static config_builder builder(float reversal_mm, uint32_t lead_us) {
        config_builder b;
        b.config->lead_us = lead_us;
        const unsigned position = b.position("X", 8, -1000, 1000);
        const unsigned back = b.polynomial("back", position, {-2, 0.02f});
        const unsigned curve = b.polynomial("EXX", position, {6, 0.01f});
        b.config->branches[b.config->branches_count++] = b.config->terms[back].as.curve;
        b.config->terms[back] = b.config->terms[curve];  // one term only, as the loader leaves it
        b.config->outputs[0] = b.config->outputs[1];
        b.config->terms_count = b.config->outputs_count = 1;
        b.config->terms[0].first_output = b.config->outputs[0].term = 0;
        b.config->terms[0].as.curve.reversal_mm = reversal_mm;
        b.channel("X", {0}, 4).slew_um_per_s = 1000000;
        return b;
    }
    double at(double mm) {
        position(8, x = mm);
        step();
        return box->outputs[0];
    }
    static double forward(double mm) { return 6 + 0.01 * mm; }
    static double backward(double mm) { return -2 + 0.02 * mm; }
};

TEST(box_direction, starts_at_the_mean_and_follows_the_way) {
    axis_rig rig;
    EXPECT_NEAR(rig.at(100), 0.5 * (rig.forward(100) + rig.backward(100)), 1e-4);
    EXPECT_NEAR(rig.at(100.25), rig.forward(100.25), 1e-4);
    EXPECT_NEAR(rig.at(300), rig.forward(300), 1e-4);
    EXPECT_NEAR(rig.at(299.75), 0.5 * (rig.forward(299.75) + rig.backward(299.75)), 1e-4);
    for (int i = 0; i < 1000; ++i) rig.at(299.75);
    EXPECT_NEAR(rig.at(299.75), 0.5 * (rig.forward(299.75) + rig.backward(299.75)), 1e-4)
        << "standing still is no direction";
    EXPECT_NEAR(rig.at(299.5), rig.backward(299.5), 1e-4);
    EXPECT_NEAR(rig.at(-20), rig.backward(-20), 1e-4);
    EXPECT_NEAR(rig.at(-19.5), rig.forward(-19.5), 1e-4);
}

TEST(box_direction, never_steps) {
    axis_rig rig;
    double x = 50, last = rig.at(x);
    for (int i = 0; i < 4000; ++i) {
        const double way = 0.01 * std::sin(i * 0.013) + 0.002 * (i % 2 ? 1 : -1);
        const double now = rig.at(x += way);
        // (C+ - C-) / reversal and the slope of a curve, for each mm of way
        ASSERT_LE(std::fabs(now - last), std::fabs(way) * (8.0 / 0.5 + 0.05) + 2e-3) << i;
        last = now;
    }
}

TEST(box_direction, hold_keeps_it_and_the_next_reading_counts_as_travel) {
    axis_rig rig;
    rig.at(100);
    rig.at(200);
    rig.reading = false;
    for (int i = 0; i < 10; ++i) rig.at(200);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    const cb_direction kept = rig.box->terms[0].direction;
    EXPECT_EQ(kept.blend, 1.0f);
    rig.reading = true;
    EXPECT_NEAR(rig.at(150), rig.backward(150), 1e-4);
}

// Braking hard, the position ahead turns round before the axis does.
TEST(box_direction, is_that_of_the_reading_not_of_the_lead) {
    axis_rig rig(0.5f, 100000);
    double x = 100, v = 200;
    rig.at(x);
    for (int i = 0; i < 10; ++i) rig.at(x += v * 0.03);
    for (; v > 0; v -= 30) {
        rig.at(x += v * 0.03);
        EXPECT_EQ(rig.box->terms[0].direction.blend, 1.0f) << v;
    }
}

TEST(box_direction, survives_a_reload_of_the_same_position) {
    axis_rig rig, fresh(0.5f), other(0.5f), plain(0.5f), kind(0.5f);
    rig.at(100);
    rig.at(200);
    ASSERT_TRUE(cb_box_adopt(fresh.box.get(), rig.box.get()));
    EXPECT_TRUE(fresh.box->terms[0].directed);
    EXPECT_EQ(fresh.box->terms[0].direction.blend, 1.0f);
    std::strcpy(other.box->config.signals[0].name, "Q");
    ASSERT_TRUE(cb_box_adopt(other.box.get(), rig.box.get()));
    EXPECT_FALSE(other.box->terms[0].directed) << "of another position it means nothing";
    plain.box->config.terms[0].as.curve.reversal_mm = 0;
    ASSERT_TRUE(cb_box_adopt(plain.box.get(), rig.box.get()));
    EXPECT_FALSE(plain.box->terms[0].directed);
    kind.box->config.terms[0].type = CB_TERM_LINEAR;
    ASSERT_TRUE(cb_box_adopt(kind.box.get(), rig.box.get()));
    EXPECT_FALSE(kind.box->terms[0].directed) << "a term of this kind has no branches";
}

TEST(box_direction, outside_of_either_branch_counts) {
    axis_rig rig;
    rig.box->config.branches[0].to = 150;
    cb_box_start(rig.box.get());
    rig.at(100);
    EXPECT_EQ(rig.box->counters.outside_curve, 0u);
    EXPECT_NEAR(rig.at(200), rig.forward(200), 1e-4);
    EXPECT_EQ(rig.box->counters.outside_curve, 1u);
    EXPECT_NEAR(rig.at(180), rig.backward(150), 1e-4);
}

}  // namespace
}  // namespace compbox
