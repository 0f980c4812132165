// SPDX-License-Identifier: MIT
// Assertions stay on in the product: a programmer's mistake ends the program where it is made.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <memory>

#include "tests/support/box_fixture.h"

extern "C" {
#include "firmware/base/assert.h"
#include "firmware/signals/bus_turns.h"
}

namespace compbox {
namespace {

const testing::KilledBySignal aborts(SIGABRT);

TEST(assertion, names_its_place_and_aborts) {
    EXPECT_EXIT(cb_assertion_failed("firmware/box/box.c", 7), aborts,
                "^assert_test: assertion failed at firmware/box/box.c:7: the program has a "
                "mistake, please report it\n$");
}

TEST(assertion, aborts_too_where_nobody_reads_the_log) {
    const auto with_a_full_log = [] {
        int ends[2];
        if (pipe(ends) != 0) return;
        fcntl(ends[1], F_SETFL, O_NONBLOCK);
        while (write(ends[1], "x", 1) == 1) {
        }
        fcntl(ends[1], F_SETFL, 0);  // from now on a write would wait for ever
        dup2(ends[1], STDERR_FILENO);
        cb_assertion_failed("firmware/box/box.c", 7);
    };
    EXPECT_EXIT(with_a_full_log(), aborts, "^$");
}

TEST(assertion, a_condition_is_evaluated_once_and_passes) {
    int evaluated = 0;
    CB_ASSERT(++evaluated == 1);
    EXPECT_EQ(evaluated, 1);
}

TEST(assertion, no_box_starts_with_more_than_its_arrays_hold) {
    const auto started_with = [](auto change) {
        auto box = std::make_unique<cb_box>();
        change(box->config);
        cb_box_start(box.get());
    };
    EXPECT_EXIT(started_with([](cb_config &c) { c.signals_count = CB_MAX_SIGNALS + 1; }), aborts,
                "at firmware/box/box.c:");
    EXPECT_EXIT(started_with([](cb_config &c) { c.channels_count = CB_MAX_CHANNELS + 1; }), aborts,
                "at firmware/box/box.c:");
    EXPECT_EXIT(started_with([](cb_config &c) { c.plc.write.count = CB_MAX_WRITE_REGISTERS + 1; }),
                aborts, "at firmware/box/box.c:");
}

TEST(assertion, a_step_needs_its_inputs_and_no_more_samples_than_fit) {
    config_builder builder;
    box_rig rig(builder);
    EXPECT_EXIT(cb_box_step(rig.box.get(), nullptr, 0, &rig.out), aborts,
                " at firmware/box/box.c:");
    rig.in.sample_count = CB_MAX_SAMPLES + 1;
    EXPECT_EXIT(cb_box_step(rig.box.get(), &rig.in, rig.now_us, &rig.out), aborts,
                " at firmware/signals/signals.c:");
}

TEST(assertion, no_box_takes_over_from_itself_and_no_mode_is_unknown) {
    config_builder builder;
    box_rig rig(builder);
    EXPECT_EXIT(cb_box_adopt(rig.box.get(), rig.box.get()), aborts, " at firmware/box/adopt.c:");
    rig.box->mode.mode = CB_MODE_STOPPED + 1;
    EXPECT_EXIT(rig.step(), aborts, " at firmware/box/mode.c:");
}

TEST(assertion, a_bus_that_the_file_does_not_have_has_no_turns) {
    const auto config = std::make_unique<cb_config>();
    cb_bus_turns turns{};
    EXPECT_EXIT(cb_bus_turns_start(&turns, config.get(), 0, 0), aborts,
                " at firmware/signals/bus_turns.c:");
}

}  // namespace
}  // namespace compbox
