// SPDX-License-Identifier: MIT
// The model's own sigma in what a probe adapts.
#include <gtest/gtest.h>

#include <cmath>

extern "C" {
#include "firmware/box/state.h"
}
#include "tests/support/probe_rig.h"

namespace compbox {
namespace {

std::string thermal(bool sigma) {
    return sigma ? adapted_file({with_sigma}) : adapted_file();
}

float stated_um(const probe_rig &rig) {
    return cb_probe_sigma(&rig.box->config, 0, &rig.state(), &rig.box->sigma, rig.box->outputs,
                          rig.now_us);
}

// The position's 20 µm and 15 µm that the model does not know.
TEST(sigma, the_first_probe_of_a_model_that_is_far_off_needs_no_repetition) {
    for (const bool sigma : {false, true}) {
        probe_rig rig(thermal(sigma));
        rig.temperature(0);
        rig.run_s(3);
        rig.touch(20 + 15);
        EXPECT_EQ(rig.asks(), !sigma);
        EXPECT_EQ(rig.state().taken, sigma ? 1u : 0u);
        EXPECT_NEAR(rig.y(), sigma ? 5 : 0, 1e-3);  // one step
    }
}

TEST(sigma, a_fresh_box_states_that_of_its_model) {
    probe_rig rig(thermal(true));
    rig.temperature(0);
    rig.run_s(3);
    EXPECT_NEAR(stated_um(rig), 8, 0.01);
    rig.temperature(10);
    rig.run_s(3);
    EXPECT_NEAR(stated_um(rig), std::sqrt(64 + 16 * 4 + 25), 0.01);  // and g's: 0.5 * 10 µm
}

TEST(sigma, grows_with_the_way_from_the_last_probe_and_ends_with_the_next) {
    probe_rig rig(thermal(true));
    rig.temperature(0);
    rig.run_s(3);
    for (int i = 0; i < 4; ++i) rig.touch(20 + 3);
    EXPECT_LT(stated_um(rig), 2);
    rig.temperature(25);
    rig.run_s(3);
    const float far = stated_um(rig);
    EXPECT_GT(far, 20);  // 4 * 5 µm, and what g does not know
    rig.touch(20 + 25 + 3);
    EXPECT_GT(rig.state().filter.expected_um, 20);
    EXPECT_LT(stated_um(rig), 2);
}

TEST(sigma, the_same_probe_moves_the_term_more_at_a_state_that_was_not_seen) {
    float moved[2];
    for (const bool away : {false, true}) {
        probe_rig rig(adapted_file({with_sigma, {"\"gain_max\": 0.5", "\"gain_max\": 0"}}));
        rig.temperature(0);
        rig.run_s(3);
        for (int i = 0; i < 8; ++i) rig.touch(20);
        const double degC = away ? 10 : 0;
        rig.temperature(degC);
        rig.run_s(3);
        rig.touch(20 + degC + 3);
        moved[away] = rig.y() - rig.m();
    }
    EXPECT_GT(moved[1], 2 * moved[0]);
    EXPECT_GT(moved[1], 2);
}

std::unique_ptr<cb_box> adopted(const probe_rig &rig, const std::string &text) {
    auto fresh = std::make_unique<cb_box>();
    fresh->config = *from_text(text).config;
    cb_box_start(fresh.get());
    EXPECT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
    return fresh;
}

TEST(sigma, goes_on_after_a_reload_and_a_restart) {
    probe_rig rig(thermal(true));
    rig.temperature(0);
    rig.run_s(3);
    for (int i = 0; i < 4; ++i) rig.touch(20 + 3);
    const float before = stated_um(rig), y = rig.y();
    cb_state state;
    cb_state_take(&state, rig.box.get());
    rig.box = adopted(rig, thermal(true));
    rig.step();
    EXPECT_NEAR(stated_um(rig), before, 1e-3);
    EXPECT_EQ(rig.y(), y);
    EXPECT_NE(rig.box->probes[0].filter.model, 0u);
    probe_rig again(thermal(true));
    cb_state_give(&state, again.box.get());
    again.temperature(0);
    again.run_s(3);
    EXPECT_NEAR(stated_um(again), before, 0.05);
    EXPECT_EQ(again.box->probes[0].filter.model, rig.box->probes[0].filter.model);
}

// What the probes have shown was of the model before: b stays, without a step, and is doubted.
TEST(sigma, of_another_model_says_that_nothing_of_it_was_measured) {
    probe_rig rig(thermal(true));
    rig.temperature(0);
    rig.run_s(3);
    for (int i = 0; i < 4; ++i) rig.touch(20 + 3);
    const float y = rig.y();
    std::string other = thermal(true);
    other.replace(other.find("[[0.2]]"), 7, "[[0.1]]");
    rig.box = adopted(rig, other);
    rig.step();
    EXPECT_NEAR(stated_um(rig), 8, 0.01);
    EXPECT_EQ(rig.y(), y);
    rig.touch(20 + 3);
    EXPECT_LT(stated_um(rig), 2);
}

}  // namespace
}  // namespace compbox
