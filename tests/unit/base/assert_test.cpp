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
#include "firmware/terms/kinds.h"
#include "firmware/wire/modbus_rtu.h"
}

namespace compbox {
namespace {

const testing::KilledBySignal aborts(SIGABRT);

TEST(assertion, names_its_place_and_aborts) {
    EXPECT_EXIT(cb_assertion_failed("firmware/box/box.c", 7), aborts,
                "^base_test: assertion failed at firmware/box/box.c:7: the program has a "
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

TEST(assertion, no_box_starts_with_terms_or_channels_outside_of_its_arrays) {
    const auto started_with = [](auto change) {
        config_builder builder;
        builder.channel("X", {builder.polyline("E", builder.position("X", 2), {0, 1000}, {0, 10})},
                        2);
        box_rig rig(builder);
        change(rig.box->config);
        cb_box_start(rig.box.get());
    };
    const char *const in_terms = " at firmware/terms/derive.c:", *const in_box =
                                                                     " at firmware/box/box.c:";
    EXPECT_EXIT((started_with([](cb_config &) {}), exit(0)), testing::ExitedWithCode(0), "^$");
    EXPECT_EXIT(started_with([](cb_config &c) { c.terms[0].as.curve.pool = CB_POOL_FLOATS - 3; }),
                aborts, in_terms);
    EXPECT_EXIT(started_with([](cb_config &c) { c.terms[0].as.curve.spans = 0; }), aborts,
                in_terms);
    EXPECT_EXIT(started_with([](cb_config &c) { c.terms[0].type = CB_TERM_TYPES; }), aborts,
                in_terms);
    EXPECT_EXIT(started_with([](cb_config &c) { c.terms[0].first_output = c.outputs_count; }),
                aborts, in_terms);
    EXPECT_EXIT(started_with([](cb_config &c) { c.terms[0].as.curve.signal = c.signals_count; }),
                aborts, in_terms);
    EXPECT_EXIT(started_with([](cb_config &c) { c.channels[0].sum[0] = c.outputs_count; }), aborts,
                in_box);
    EXPECT_EXIT(started_with([](cb_config &c) { c.channels[0].reg = c.plc.write.count; }), aborts,
                in_box);
}

TEST(assertion, a_sound_frame_is_long_enough) {
    const cb_modbus_request request = cb_modbus_read(0, 1);
    const uint8_t frame[CB_RTU_MAX_FRAME] = {};
    uint16_t registers[1];
    uint8_t exception = 0;
    EXPECT_EXIT(cb_rtu_decode_sound(&request, frame, 2, registers, &exception), aborts,
                " at firmware/wire/modbus_rtu.c:");
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
