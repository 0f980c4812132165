// SPDX-License-Identifier: MIT
#include "host-tools/view/columns.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host-tools/view/recent.h"

using namespace compbox;
using view::recent_values;

namespace {

// A snapshot with one signal, one term, one channel.
json snapshot_with(const json &value) {
    return {{"mode", "ACTIVE"},
            {"reason", "all is well"},
            {"signals", {{{"name", "T\"1"}, {"value", value}}}},
            {"terms", {{{"name", "EXX"}, {"value", value}}}},
            {"channels",
             {{{"name", "X"},
               {"demand_um", value},
               {"output_um", 2},
               {"applied_um", nullptr},
               {"limit_um", 300}}}}};
}

json table_of(const recent_values &recent) {
    return json::parse(view::columns_text(recent.all()));
}

}  // namespace

TEST(view_columns, no_rows_are_empty_lists) {
    EXPECT_EQ(json::parse(view::columns_text({})),
              json::parse(R"({"version":1,"unix_s":[],"mode":[],"reason":[],"channels":{},
                              "signals":{},"terms":{}})"));
}

TEST(view_columns, names_are_quoted_and_missing_values_are_null) {
    recent_values recent;
    recent.add(100.0, snapshot_with(1.5));
    recent.add(101.25, snapshot_with(nullptr));
    const json table = table_of(recent);
    EXPECT_EQ(table.at("unix_s"), json({100.0, 101.25}));
    EXPECT_EQ(table.at("mode"), json({"ACTIVE", "ACTIVE"}));
    EXPECT_EQ(table.at("signals").at("T\"1"), json({1.5, nullptr}));
    EXPECT_EQ(table.at("terms").at("EXX"), json({1.5, nullptr}));
    const json &channel = table.at("channels").at("X");
    EXPECT_EQ(channel.at("demand_um"), json({1.5, nullptr}));
    EXPECT_EQ(channel.at("limit_um"), json({300.0, 300.0}));
    EXPECT_FALSE(channel.contains("applied_um")) << "only nulls";
}

TEST(view_columns, two_channels_are_two_objects) {
    view::columns table;
    table.unix_s = {1.0};
    table.mode = table.reason = {""};
    table.all = {{{"channels", "X", "limit_um"}, {1.0f}},
                 {{"channels", "X", "output_um"}, {2.0f}},
                 {{"channels", "Y", "output_um"}, {3.0f}}};
    const json read = json::parse(view::columns_text(table));
    EXPECT_EQ(read.at("channels"),
              json::parse(R"({"X":{"limit_um":[1],"output_um":[2]},"Y":{"output_um":[3]}})"));
    EXPECT_EQ(read.at("mode"), json::parse("[null]"));
}

TEST(view_recent, one_row_for_each_second) {
    recent_values recent;
    for (int i = 0; i < 20; ++i) recent.add(100.0 + 0.2 * i, snapshot_with(i));
    EXPECT_EQ(table_of(recent).at("unix_s"), json({100.0, 101.0, 102.0, 103.0}));
    EXPECT_EQ(table_of(recent).at("terms").at("EXX"), json({0.0, 5.0, 10.0, 15.0}));
}

TEST(view_recent, ten_minutes_are_kept_and_no_more) {
    recent_values recent;
    for (int second = 0; second < 2000; ++second) recent.add(second, snapshot_with(second));
    const json table = table_of(recent);
    ASSERT_EQ(table.at("unix_s").size(), view::recent_rows);
    EXPECT_EQ(table.at("unix_s").front(), 1400.0);
    EXPECT_EQ(table.at("terms").at("EXX").front(), 1400.0);
    EXPECT_EQ(table.at("terms").at("EXX").back(), 1999.0);
}

TEST(view_recent, a_box_that_is_gone_leaves_one_empty_row) {
    recent_values recent;
    recent.add(1.0, nullptr);
    EXPECT_TRUE(table_of(recent).at("unix_s").empty()) << "there was none";
    recent.add(2.0, snapshot_with(1));
    for (double second = 3.0; second < 9.0; ++second) recent.add(second, nullptr);
    recent.add(9.0, snapshot_with(2));
    const json table = table_of(recent);
    EXPECT_EQ(table.at("unix_s"), json({2.0, 3.0, 9.0}));
    EXPECT_EQ(table.at("mode"), json({"ACTIVE", nullptr, "ACTIVE"}));
    EXPECT_EQ(table.at("terms").at("EXX"), json({1.0, nullptr, 2.0}));
}

TEST(view_recent, a_column_is_forgotten_after_ten_minutes_without_a_value) {
    recent_values recent;
    recent.add(0.0, snapshot_with(1));
    for (int second = 1; second < 600; ++second) recent.add(second, snapshot_with(nullptr));
    EXPECT_TRUE(table_of(recent).at("terms").contains("EXX"));
    recent.add(600.0, snapshot_with(nullptr));
    EXPECT_TRUE(table_of(recent).at("terms").empty());
}

TEST(view_recent, a_clock_that_goes_back_begins_anew) {
    recent_values recent;
    recent.add(100.0, snapshot_with(1));
    recent.add(50.0, snapshot_with(2));
    EXPECT_EQ(table_of(recent).at("unix_s"), json({50.0}));
    EXPECT_EQ(table_of(recent).at("terms").at("EXX"), json({2.0}));
}

TEST(view_recent, the_number_of_columns_is_limited) {
    recent_values recent;
    json snapshot = snapshot_with(1);
    for (int i = 0; i < 2000; ++i) {
        snapshot["signals"].push_back({{"name", "S" + std::to_string(i)}, {"value", i}});
    }
    recent.add(1.0, snapshot);
    EXPECT_EQ(recent.all().all.size(), view::recent_most_columns);
}
