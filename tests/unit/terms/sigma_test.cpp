// SPDX-License-Identifier: MIT
// The place of a bank's state: against double, spread over the steps of a second.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bank_rig.h"

namespace compbox {
namespace {

// T2, T1 and T1² with two time constants; a bank that states none; one with a direction.
const std::string two_banks = R"(
 {"name": "warm", "type": "linear", "outputs": ["banked", "b"],
  "bank": {"inputs": ["T2", "T1"], "powers": {"T1": [1, 2]}, "tau_s": [0, 60],
   "weights": [[0.01, -0.02, 0.3, 0.4, -0.005, 0.006], [0, 0, 0, 1, 0, 0]], "bias": [-3.5, 0]},
  "sigma": {"floor_um": [8, 0.5], "along_um": [4, 2], "offsets": [-2, 0.25],
   "directions": [[0.001, 0.002, 0.03, 0.04, -0.0005, 0.0006], [0, 0, 0, 0.1, 0, 0]]}},
 {"name": "silent", "type": "linear", "bank": {"inputs": ["T1"], "tau_s": [60], "weights": [[1]]}},
 {"name": "third", "type": "linear", "bank": {"inputs": ["T1", "T2"], "tau_s": [0], "weights": [[1, 0]]},
  "sigma": {"floor_um": [1], "along_um": [1], "offsets": [0], "directions": [[0.1, 0]]}})";

cb_sigma sigma_of(const bank_rig &rig, uint8_t output) {
    return cb_sigma_of(&rig.box->config, &rig.box->sigma, output);
}

double place(double offset, const double (&weights)[6], const double (&columns)[6]) {
    for (int i = 0; i < 6; ++i) offset += weights[i] * columns[i];
    return offset;
}

TEST(sigma, is_that_of_the_state) {
    bank_rig rig(two_banks);
    rig.t1 = 30, rig.t2 = 35;
    rig.go();
    const double columns[6] = {35, 35, 30, 30, 900, 900};
    const double z[2] = {place(-2, {0.001, 0.002, 0.03, 0.04, -0.0005, 0.0006}, columns),
                         place(0.25, {0, 0, 0, 0.1, 0, 0}, columns)};
    const cb_sigma a = sigma_of(rig, 0), b = sigma_of(rig, 1);
    for (int d = 0; d < 2; ++d) EXPECT_NEAR(a.place[d], z[d], 1e-5);
    EXPECT_EQ(a.place[2], 0);
    const double distance = z[0] * z[0] + z[1] * z[1];
    EXPECT_NEAR(cb_sigma_um(&a), std::sqrt(64 + 16 * distance), 1e-4);
    EXPECT_NEAR(cb_sigma_um(&b), std::sqrt(0.25 + 4 * distance), 1e-4);
    EXPECT_EQ(sigma_of(rig, 2).model, 0u);  // it states none
    EXPECT_NEAR(sigma_of(rig, 3).place[0], 3, 1e-6);
    EXPECT_NE(sigma_of(rig, 3).model, a.model);
}

// 5 rows of banks that state one: a row in each step of 30 ms, and a pass each second.
TEST(sigma, follows_within_a_second_a_row_in_each_step) {
    bank_rig rig(two_banks);
    rig.go();
    EXPECT_EQ(rig.box->config.sigma_rows, 1);
    const float before = sigma_of(rig, 3).place[0];
    rig.t1 = 25;
    int steps = 0;
    for (; sigma_of(rig, 3).place[0] == before; ++steps) {
        ASSERT_LT(steps, 50);
        rig.go();
    }
    EXPECT_GT(steps, 1);
    EXPECT_NEAR(sigma_of(rig, 3).place[0], 2.5, 1e-6);
}

TEST(sigma, keeps_the_place_while_an_input_is_missing) {
    bank_rig rig(two_banks);
    rig.go();
    rig.heard[AT_T2] = false;
    for (int i = 0; i < 80; ++i) rig.go();
    const cb_sigma before = sigma_of(rig, 0);
    rig.t1 = 25;
    for (int i = 0; i < 80; ++i) rig.go();
    EXPECT_EQ(sigma_of(rig, 0).place[0], before.place[0]);
    EXPECT_NE(sigma_of(rig, 0).model, 0u);
    rig.heard[AT_T2] = true;
    for (int i = 0; i < 80; ++i) rig.go();
    EXPECT_GT(sigma_of(rig, 0).place[1], before.place[1]);
}

TEST(sigma, is_not_known_before_every_input_was_read) {
    bank_rig rig(two_banks);
    rig.heard[AT_T2] = false;
    rig.go();
    EXPECT_EQ(sigma_of(rig, 0).model, 0u);
    rig.heard[AT_T2] = true;
    for (int i = 0; i < 80; ++i) rig.go();
    EXPECT_NE(sigma_of(rig, 0).model, 0u);
}

// A pass of the first step, and steps at any time: the clock jumps and goes back.
TEST(sigma, is_finite_at_any_time) {
    bank_rig rig(two_banks);
    const int64_t jumps_us[] = {30000, 30000, 30000, 3600000000, -5000000, 1, 2000000};
    for (int i = 0; i < 2000; ++i) {
        rig.t1 = (i * 37) % 150 - 40;
        rig.t2 = 10 + i % 30;
        rig.go(jumps_us[i % 7]);
        const cb_sigma a = sigma_of(rig, 0);
        ASSERT_TRUE(std::isfinite(cb_sigma_um(&a))) << i;
        ASSERT_LE(rig.box->sigma.bank, rig.box->config.banks_count) << i;
    }
}

}  // namespace
}  // namespace compbox
