// SPDX-License-Identifier: MIT
// The record of compboxd as compbox-view reads it: grown, compressed, broken.
#include "host-tools/view/record.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "host-tools/box_files/snapshot.h"
#include "tests/support/temporary.h"

using namespace compbox;
using namespace compbox::view;

namespace {

// A path that no other test has.
std::string own_file() {
    return compbox_test::temporary(testing::UnitTest::GetInstance()->current_test_info()->name());
}

void append(const std::string &path, const std::string &text) {
    std::ofstream(path, std::ios::app) << text;
}

// The values of T1 in the last hour.
std::vector<float> temperatures(const record &from, double now_s) {
    const columns table = from.values().last(1, now_s, {});
    for (const auto &one : table.all) {
        if (one.key.name == "T1") return one.values;
    }
    return {};
}

}  // namespace

TEST(view_record, rows_have_the_wall_clock_of_their_column) {
    const auto path = own_file();
    append(path, "time_s,T1,comp_X_um,mode,reason,unix_s\n");
    append(path, "0.0,20.5,1,1,0,1800000000.0\n0.03,,1,1,0,1800000000.03\nbroken\n");
    append(path, "30,22,1,1,0,1800000030.0\n30.03,9,9,9,9,9,9,9,9\n31,21\n");
    record from(path);
    EXPECT_TRUE(from.poll(1800000031.0));
    EXPECT_FALSE(from.poll(1800000031.0));
    EXPECT_EQ(temperatures(from, 1800000031.0).front(), 20.5f);
    EXPECT_EQ(temperatures(from, 1800000031.0).back(), 22.0f);
    append(path, "33,28,1,1,0,1800000033.0\n");
    EXPECT_TRUE(from.poll(1800000033.0));
    EXPECT_EQ(temperatures(from, 1800000033.0).back(), 28.0f);
}

TEST(view_record, without_that_column_the_last_row_is_as_old_as_the_file) {
    const auto path = own_file();
    append(path, "time_s,T1,mode,reason\n100,20,1,0\n700,21,1,0\n");
    record from(path);
    const double now_s = box_files::unix_now_s();
    EXPECT_TRUE(from.poll(now_s));
    const columns table = from.values().last(1, now_s, {});
    ASSERT_EQ(table.unix_s.size(), 5u);
    EXPECT_NEAR(table.unix_s.front(), now_s - 600.0, 6.0);
    EXPECT_NEAR(table.unix_s.back(), now_s, 6.0);
}

TEST(view_record, older_files_are_read_plain_and_compressed) {
    const auto path = own_file();
    const std::string head = "time_s,T1,mode,reason,unix_s\n";
    append(path, head + "0,3,1,0,1800000000\n");
    append(path + ".1", head + "0,2,1,0,1799999500\n");
    const gzFile old = ::gzopen((path + ".2.gz").c_str(), "wb");
    ::gzputs(old, (head + "0,1,1,0,1799999000\n").c_str());
    ::gzclose(old);
    record from(path);
    for (int i = 0; i < 4; ++i) from.poll(1800000001.0);
    const auto values = temperatures(from, 1800000001.0);
    ASSERT_EQ(values.size(), 8u) << "three spans and two gaps";
    EXPECT_EQ(values[0], 1.0f);
    EXPECT_EQ(values[3], 2.0f);
    EXPECT_EQ(values[6], 3.0f);
}

TEST(view_record, a_call_reads_about_a_megabyte) {
    const auto path = own_file();
    std::string text = "time_s,T1,mode,reason,unix_s\n";
    for (int i = 0; i < 100000; ++i) {
        text += fmt::format("{},{},1,0,{}\n", i, i, 1799900000 + i);
    }
    append(path, text);
    record from(path);
    unsigned calls = 0;
    while (from.poll(1800000000.0)) ++calls;
    EXPECT_EQ(calls, (text.size() >> 20) + 1);
    EXPECT_EQ(temperatures(from, 1800000000.0).back(), 99999.0f);
}
