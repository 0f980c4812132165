// SPDX-License-Identifier: MIT
// examples/dual-drive: the four motors at positions where the printed fits were worked out in exact
// fractions, and the two motors of a stage never further apart than they may be.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/box_fixture.h"
#include "tests/support/config_fixture.h"
#include "tests/support/paths.h"

namespace compbox {
namespace {

config_builder example() {
    std::ifstream file(from_source("examples/dual-drive/coefficients.json"));
    std::stringstream text;
    text << file.rdbuf();
    const auto got = compbox_test::load(text.str());
    EXPECT_EQ(got.error, CB_OK) << got.text << ", line " << got.line;
    config_builder b;
    *b.config = *got.config;
    return b;
}

enum { X1, X2, Y4, Y5 };

struct table_rig : box_rig {
    table_rig() : box_rig(example()) {}

    // One step; the invariants of both pairs hold in every one.
    void go(double x, double y) {
        position(8, x);
        position(10, y);
        step();
        EXPECT_LE(std::fabs(output(X1) - output(X2)), 40 + 1e-4);
        EXPECT_LE(std::fabs(output(Y4) - output(Y5)), 25 + 1e-4);
    }
    void settle(double x, double y) {
        for (int i = 0; i < 60; ++i) go(x, y);
    }
};

struct row {
    double x, y, um[4];
};
const row rows[] = {
    {0, 0, {-0.7100, 2.9230, 8.7416, 4.7088}},
    {120, 0, {122.6500, 90.8830, -9.9544, -13.9872}},
    {0, 120, {-57.8041, -54.1711, 73.1816, 92.5488}},
    {60, 60, {37.2311, 23.1641, 19.7336, 27.4008}},
    {37, 91, {4.8036, -2.4784, 41.7097, 55.4219}},
    {120, 120, {65.5559, 33.7889, 54.4856, 73.8528}},
};

TEST(dual_drive, the_motors_follow_the_printed_fits) {
    table_rig rig;
    for (const row &r : rows) {
        rig.settle(r.x, r.y);
        ASSERT_EQ(rig.mode(), CB_MODE_ACTIVE);
        for (unsigned motor = X1; motor <= Y5; ++motor) {
            EXPECT_NEAR(rig.output(motor), r.um[motor], 0.006)
                << motor << " at " << r.x << " " << r.y;
            EXPECT_NEAR(rig.written(2 + 2 * motor), r.um[motor], 0.006);
        }
    }
}

TEST(dual_drive, a_lost_plc_holds_both_motors_and_ramps_them_together) {
    table_rig rig;
    rig.settle(120, 120);
    const double x1 = rig.output(X1), x2 = rig.output(X2);
    rig.beating = false;
    for (int i = 0; i < 8; ++i) rig.go(120, 120);
    EXPECT_EQ(rig.mode(), CB_MODE_HOLD);
    EXPECT_EQ(rig.output(X1), x1);
    EXPECT_EQ(rig.output(X2), x2);
    for (int i = 0; i < 400; ++i) rig.go(120, 120);
    for (unsigned motor = X1; motor <= Y5; ++motor) EXPECT_EQ(rig.output(motor), 0) << motor;
}

// With a tighter pair neither motor gets what it wants, and both still move.
TEST(dual_drive, a_pair_gives_way_before_it_racks_the_stage) {
    config_builder b = example();
    b.config->pairs[0].max_difference_um = 10;
    box_rig rig(b);
    rig.position(8, 120);
    rig.position(10, 0);
    for (int i = 0; i < 60; ++i) {
        rig.step();
        ASSERT_LE(std::fabs(rig.output(X1) - rig.output(X2)), 10 + 1e-4);
    }
    EXPECT_GT(rig.output(X2), 50);
    EXPECT_GT(rig.box->counters.pairs_limited, 0u);
}

}  // namespace
}  // namespace compbox
