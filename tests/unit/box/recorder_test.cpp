// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tests/support/box_fixture.h"

extern "C" {
#include "firmware/box/recorder.h"
}

namespace compbox {
namespace {

config_builder simple() {
    config_builder b;
    const unsigned x = b.position("X", 8);
    b.channel("Z", {b.polyline("EZX", x, {0, 1000}, {0, 100})}, 4);
    return b;
}

unsigned counter(const char *name) {
    for (unsigned i = 1; i < CB_COUNTERS_COUNT; ++i) {
        if (std::string(cb_counter_name(i)) == name) return 1u << (i - 1);
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
}

TEST(recorder, keeps_the_last_cycles_with_what_changed) {
    cb_record records[4];
    cb_recorder recorder;
    cb_recorder_start(&recorder, records, 4);
    EXPECT_EQ(cb_recorder_at(&recorder, 0), nullptr);
    box_rig rig(simple());
    rig.position(8, 400);
    for (int i = 1; i <= 7; ++i) {
        rig.reading = i != 6;
        rig.step();
        cb_recorder_note(&recorder, rig.box.get());
    }
    const cb_record *last = cb_recorder_at(&recorder, 0);
    ASSERT_NE(last, nullptr);
    EXPECT_EQ(last->cycle, 7u);
    EXPECT_EQ(last->time_us, 1000000 + 7 * 30000);
    EXPECT_EQ(last->mode, CB_MODE_ACTIVE);
    EXPECT_EQ(last->reason, CB_REASON_NONE);
    EXPECT_EQ(last->control, 3);
    EXPECT_EQ(last->channel_um[0], -40);
    EXPECT_EQ(last->counters, 0u);
    EXPECT_EQ(cb_recorder_at(&recorder, 1)->counters, counter("reads_failed"));
    EXPECT_EQ(cb_recorder_at(&recorder, 3)->cycle, 4u);
    EXPECT_EQ(cb_recorder_at(&recorder, 4), nullptr);
}

TEST(recorder, an_old_record_leaves_nothing_behind) {
    cb_record record;
    cb_recorder recorder;
    cb_recorder_start(&recorder, &record, 1);
    config_builder two = simple();
    two.channel("Y", {0}, 6);
    box_rig rig(two);
    rig.position(8, 400);
    rig.steps(5);
    cb_recorder_note(&recorder, rig.box.get());
    EXPECT_EQ(record.channel_um[1], -40);
    box_rig one(simple());
    one.step();
    cb_recorder_note(&recorder, one.box.get());
    EXPECT_EQ(record.channel_um[1], 0);
    EXPECT_EQ(cb_recorder_at(&recorder, 0)->cycle, 1u);
    EXPECT_EQ(cb_recorder_at(&recorder, 1), nullptr);
}

TEST(recorder, counters_have_names) {
    EXPECT_STREQ(cb_counter_name(0), "cycles");
    EXPECT_STREQ(cb_counter_name(CB_COUNTERS_COUNT - 1), "faults");
    EXPECT_STREQ(cb_counter_name(CB_COUNTERS_COUNT), "unknown");
}

}  // namespace
}  // namespace compbox
