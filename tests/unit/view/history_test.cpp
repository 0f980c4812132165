// SPDX-License-Identifier: MIT
#include "host-tools/view/history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace compbox::view;

namespace {

constexpr double now_s = 1.8e9;
constexpr int active = 1, hold = 2, heartbeat = 4;

const std::vector<float> &values_of(const columns &table, const std::string &name) {
    const auto found = std::find_if(table.all.begin(), table.all.end(),
                                    [&name](const column &one) { return one.key.name == name; });
    EXPECT_NE(found, table.all.end()) << name;
    return found->values;
}

// A row every minute for a month, with one peak of one row in the middle of it.
history month_with_peak() {
    history record;
    record.set_names({"T1", "comp_X_um"});
    const double start_s = now_s - 3600.0 * history_most_hours;
    for (int minute = 0; minute < 60 * 744; ++minute) {
        const bool peak = minute == 60 * 372;
        record.add(start_s + 60.0 * minute, peak ? hold : active, peak ? heartbeat : 0,
                   {peak ? 99.0f : 20.0f, peak ? -250.0f : 1.0f});
    }
    return record;
}

}  // namespace

TEST(view_history, a_peak_of_one_row_stays_in_a_month) {
    const columns table = month_with_peak().last(history_most_hours, now_s, {});
    EXPECT_LE(table.unix_s.size(), 1500u);
    EXPECT_GT(table.unix_s.size(), 1400u);
    const auto &temperature = values_of(table, "T1"), &output = values_of(table, "X");
    EXPECT_EQ(*std::max_element(temperature.begin(), temperature.end()), 99.0f);
    EXPECT_EQ(std::count(temperature.begin(), temperature.end(), 99.0f), 1);
    EXPECT_EQ(*std::min_element(output.begin(), output.end()), -250.0f);
    const auto mode = std::find(table.mode.begin(), table.mode.end(), "HOLD");
    ASSERT_NE(mode, table.mode.end());
    EXPECT_EQ(table.reason[static_cast<std::size_t>(mode - table.mode.begin())],
              "the PLC's heartbeat does not change");
}

TEST(view_history, every_number_of_hours_has_at_most_1500_rows_of_that_time) {
    const history record = month_with_peak();
    for (unsigned hours = 1; hours <= history_most_hours; ++hours) {
        const columns table = record.last(hours, now_s, {});
        ASSERT_LE(table.unix_s.size(), 1500u) << hours;
        ASSERT_TRUE(std::is_sorted(table.unix_s.begin(), table.unix_s.end())) << hours;
        ASSERT_GE(table.unix_s.front(), now_s - 3600.0 * hours - 3720.0) << hours;
        for (const auto &one : table.all) ASSERT_EQ(one.values.size(), table.unix_s.size());
    }
}

TEST(view_history, lowest_and_highest_are_in_the_order_of_time) {
    history record;
    record.set_names({"up", "down", "never"});
    for (int i = 0; i < 50; ++i) {
        const auto value = static_cast<float>(i);
        record.add(now_s + 0.1 * i, active, 0, {value, -value, NAN});
    }
    const columns table = record.last(1, now_s + 5.0, {"down"});
    ASSERT_EQ(table.unix_s.size(), 2u);
    EXPECT_EQ(values_of(table, "up"), (std::vector<float>{0.0f, 49.0f}));
    EXPECT_EQ(values_of(table, "down"), (std::vector<float>{-0.0f, -49.0f}));
    EXPECT_TRUE(std::isnan(values_of(table, "never").front()));
}

TEST(view_history, columns_know_their_group) {
    history record;
    record.set_names({"comp_X1_um", "EXX", "T1", "comp_um", "comp__um"});
    record.add(now_s, active, 0, {1, 2, 3, 4, 5});
    const columns table = record.last(1, now_s, {"EXX"});
    const auto group_of = [&table](const std::string &name) {
        for (const auto &one : table.all) {
            if (one.key.name == name) return one.key.group + "/" + one.key.quantity;
        }
        return std::string();
    };
    EXPECT_EQ(group_of("X1"), "channels/output_um");
    EXPECT_EQ(group_of("EXX"), "terms/");
    EXPECT_EQ(group_of("T1"), "signals/");
    EXPECT_EQ(group_of("comp_um"), "signals/");
    EXPECT_EQ(group_of("comp__um"), "signals/");
}

TEST(view_history, a_pause_is_one_row_of_gaps) {
    history record;
    record.set_names({"T1"});
    record.add(now_s - 1800.0, active, 0, {1.0f});
    record.add(now_s, active, 0, {2.0f});
    const columns table = record.last(1, now_s, {});
    ASSERT_EQ(table.unix_s.size(), 5u);
    EXPECT_EQ(table.mode[2], "");
    EXPECT_TRUE(std::isnan(values_of(table, "T1")[2]));
    EXPECT_EQ(values_of(table, "T1")[3], 2.0f);
}

TEST(view_history, older_files_may_come_later_and_have_other_columns) {
    history record;
    record.set_names({"T1", "T2"});
    record.add(now_s, active, 0, {1.0f, 2.0f});
    record.set_names({"T2", "old"});
    record.add(now_s - 600.0, active, 0, {3.0f, 4.0f});
    const columns table = record.last(1, now_s, {});
    EXPECT_EQ(values_of(table, "T2").front(), 3.0f);
    EXPECT_EQ(values_of(table, "T2").back(), 2.0f);
    EXPECT_EQ(values_of(table, "old").front(), 4.0f);
    EXPECT_TRUE(std::isnan(values_of(table, "old").back()));
}

TEST(view_history, a_row_that_is_too_old_or_has_no_clock_changes_nothing) {
    history record;
    record.set_names({"T1"});
    record.add(now_s, active, 0, {1.0f});
    for (const double then : {now_s - 3600.0 * 745, -5.0, 0.0, 1e300, double{NAN}}) {
        record.add(then, hold, 0, {77.0f});
    }
    for (const unsigned hours : {1u, 24u, 168u, 744u}) {
        const columns table = record.last(hours, now_s, {});
        EXPECT_EQ(values_of(table, "T1"), (std::vector<float>{1.0f, 1.0f})) << hours;
    }
}

TEST(view_history, more_columns_than_a_box_can_have_are_left_out) {
    history record;
    std::vector<std::string> names;
    for (int i = 0; i < 2000; ++i) names.push_back("S" + std::to_string(i));
    record.set_names(names);
    record.add(now_s, active, 0, std::vector<float>(2000, 1.0f));
    EXPECT_EQ(record.last(1, now_s, {}).all.size(), history_most_columns);
}
