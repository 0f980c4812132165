// SPDX-License-Identifier: MIT
// The site's ceiling: what it lowers, and that no output passes it whatever the file states.
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "tests/support/box_from_text.h"
#include "tests/support/dice.h"

extern "C" {
#include "firmware/box/ceiling.h"
}

namespace compbox {
namespace {

using compbox_test::full_example;

std::string replaced(std::string text, const std::string &from, const std::string &to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

// With a tangent of channel Z: a slope of at most 200 µm/m, 1000 µm/m/s.
std::string with_tangent() {
    return replaced(
        full_example, R"("sign": -1, "plc": 104)",
        R"("sign": -1, "tangent": {"signal": "X", "slope_plc": 108, "slope_type": "int32",
      "slope_scale": 1e-8, "slope_limit": 2e-4, "slope_slew_per_s": 1e-3, "reference_plc": 110,
      "reference_type": "int32", "reference_scale": 0.001}, "plc": 104)");
}

struct ceiling : ::testing::Test {
    config_builder b = from_text(with_tangent());
    cb_config &config = *b.config;
    const cb_channel_config &z = config.channels[0], &y1 = config.channels[1],
                            &y2 = config.channels[2], &slope = config.channels[3];
    uint32_t apply(float um, float um_per_s) {
        const cb_ceiling of_site = {um, um_per_s};
        return cb_ceiling_apply(&config, &of_site);
    }
};

TEST_F(ceiling, absent_changes_nothing) {
    cb_config before;
    std::memcpy(&before, &config, sizeof config);
    EXPECT_EQ(apply(0, 0), 0u);
    EXPECT_EQ(std::memcmp(&before, &config, sizeof config), 0);
    EXPECT_EQ(apply(FLT_MAX, FLT_MAX), 0u);
    EXPECT_EQ(config.ceiling_um, FLT_MAX);
}

TEST_F(ceiling, lowers_the_limits_that_are_above_it_and_no_others) {
    ASSERT_TRUE(slope.is_slope);
    EXPECT_EQ(apply(150, 100), 0b1001u);  // Y1 and Y2 have 100 µm and 50 µm/s
    EXPECT_EQ(config.ceiling_um, 150);
    EXPECT_EQ(z.limit_um, 150);
    EXPECT_EQ(z.slew_um_per_s, 100);
    EXPECT_EQ(z.error_um, 400);
    EXPECT_EQ(y1.limit_um, 100);
    EXPECT_EQ(y2.slew_um_per_s, 50);
}

TEST_F(ceiling, holds_for_slopes_per_metre_of_travel) {
    EXPECT_EQ(apply(150, 0), 0b1001u);
    EXPECT_EQ(slope.limit_um, 150);
    EXPECT_FLOAT_EQ(slope.slew_um_per_s, 1000);
}

TEST_F(ceiling, leaves_a_slope_able_to_reach_zero_within_a_second) {
    EXPECT_EQ(apply(0, 80), 0b1001u);
    EXPECT_EQ(slope.slew_um_per_s, 80);
    EXPECT_EQ(slope.limit_um, 80);
    EXPECT_GE(slope.error_um, slope.limit_um);
    EXPECT_EQ(z.limit_um, 300) << "a channel may take as long as it needs";
}

TEST_F(ceiling, takes_deadband_and_derived_numbers_along) {
    EXPECT_EQ(apply(0.25f, 0), 0b1111u);
    EXPECT_EQ(z.deadband_um, 0.25f);
    EXPECT_EQ(z.top_um, 0.25f);
    EXPECT_EQ(y2.top_um, 0.2f) << "two units of its register";
    EXPECT_EQ(y1.top_um, 0) << "its register has no value within the ceiling but zero";
    EXPECT_LE(z.most_um, 0.25f);
}

// A pair with the ceiling below its difference, inputs by dice: nothing passes the ceiling, at no
// rate beyond it.
TEST(ceiling_property, no_output_is_beyond_it_or_faster) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        compbox_test::dice dice(seed);
        const auto within = [&dice](float from, float to) {
            return from + (to - from) * static_cast<float>(dice(1001)) * 1e-3f;
        };
        config_builder b;
        const unsigned x = b.position("X", 8);
        const unsigned term = b.polyline("E", x, {0, 500, 1000}, {0, 5000, -3000});
        const unsigned other = b.polyline("F", x, {0, 1000}, {-800, 7000});
        b.channel("A", {term}, 4);
        b.channel("B", {other}, 6);
        b.pair(0, 1, 40);
        for (unsigned i = 0; i < 2; ++i) b.config->channels[i].error_um = 1e6f;
        const cb_ceiling ceiling = {within(0.5f, 150), within(2, 700)};
        cb_ceiling_apply(b.config.get(), &ceiling);
        box_rig rig(b);
        float was[2] = {0, 0}, largest = 0;
        for (int i = 0; i < 300; ++i) {
            if (i % 20 == 0) rig.position(8, within(0, 1000));
            rig.step();
            for (unsigned k = 0; k < 2; ++k) {
                const float um = rig.box->channels[k].output_um;
                const float unit_um = rig.box->config.channels[k].unit_um;
                EXPECT_LE(std::fabs(um), ceiling.um * 1.000001f);
                EXPECT_LE(std::fabs(um - was[k]), ceiling.um_per_s * 0.06f * 1.00001f + unit_um);
                was[k] = um;
                largest = std::fmax(largest, std::fabs(um));
            }
        }
        EXPECT_GT(largest, 0) << "the box compensated";
    }
}

}  // namespace
}  // namespace compbox
