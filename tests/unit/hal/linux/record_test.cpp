// SPDX-License-Identifier: MIT
// The record holds whole lines only, also when the disk is full, and counts what it loses.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/files/record.h"
}

namespace {

struct files {
    std::string path = compbox_test::temporary("record.csv");
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    std::unique_ptr<cb_record> record = std::make_unique<cb_record>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();

    files() {
        config->signals_count = 2;
        std::strcpy(config->signals[0].name, "X");
        std::strcpy(config->signals[1].name, "T1");
        config->outputs_count = 1;
        std::strcpy(config->outputs[0].name, "EZX");
        config->channels_count = 1;
        std::strcpy(config->channels[0].name, "Z");
    }
    std::vector<std::string> lines() const {
        std::vector<std::string> result;
        std::ifstream in(path);
        for (std::string line; std::getline(in, line);) result.push_back(line);
        return result;
    }
    void fill_everything() {
        config->signals_count = CB_MAX_SIGNALS;
        config->outputs_count = CB_MAX_OUTPUTS;
        config->channels_count = CB_MAX_CHANNELS;
        const char longest[] = "a_name_of_23_characters";
        for (auto &s : config->signals) std::strcpy(s.name, longest);
        for (auto &o : config->outputs) std::strcpy(o.name, longest);
        for (auto &c : config->channels) std::strcpy(c.name, longest);
        constexpr float longest_number = -1.17549435e-38f;
        for (auto &s : row->signals) s = {longest_number, CB_ROW_SIGNAL_FRESH, 0, 0, 0};
        for (float &v : row->outputs) v = longest_number;
        for (auto &c : row->channels) c.output_um = longest_number;
    }
};

TEST(record, rows_are_what_the_header_says) {
    files f;
    ASSERT_EQ(cb_record_start(f.record.get(), f.path.c_str(), f.config.get()), 0);
    f.row->time_us = 5000000;
    f.row->mode = 0, f.row->reason = 1;
    cb_record_add(f.record.get(), f.config.get(), f.row.get());
    f.row->time_us = 5030001;
    f.row->signals[0] = {0.1f, CB_ROW_SIGNAL_STALE, 0, 0, 0};
    f.row->outputs[0] = -3.0f;
    f.row->channels[0].output_um = 3.0f;
    f.row->mode = 1, f.row->reason = 0;
    cb_record_add(f.record.get(), f.config.get(), f.row.get());
    EXPECT_EQ(f.lines().size(), 1u);  // the rest is buffered
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    EXPECT_EQ(f.lines(),
              (std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,mode,reason",
                                        "0.000000,,,0,0,0,1", "0.030001,0.100000001,,-3,3,1,0"}));
}

TEST(record, the_longest_rows_are_whole) {
    files f;
    f.fill_everything();
    ASSERT_EQ(cb_record_start(f.record.get(), f.path.c_str(), f.config.get()), 0);
    for (int i = 0; i < 100; i++) cb_record_add(f.record.get(), f.config.get(), f.row.get());
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    const auto lines = f.lines();
    ASSERT_EQ(lines.size(), 101u);
    const auto commas = std::count(lines[0].begin(), lines[0].end(), ',');
    EXPECT_EQ(commas, CB_MAX_SIGNALS + CB_MAX_OUTPUTS + CB_MAX_CHANNELS + 2);
    for (const auto &line : lines) {
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas);
        EXPECT_LT(line.size(), static_cast<size_t>(CB_RECORD_LINE));
    }
}

TEST(record, a_full_disk_leaves_whole_lines_and_a_count) {
    files f;
    f.row->signals[0].state = f.row->signals[1].state = CB_ROW_SIGNAL_FRESH;
    ASSERT_EQ(cb_record_start(f.record.get(), f.path.c_str(), f.config.get()), 0);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{1000, before.rlim_max};
    std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (int i = 0; i < 100; i++) {
        cb_record_add(f.record.get(), f.config.get(), f.row.get());
        if (i % 7 == 0) cb_record_flush(f.record.get());
    }
    EXPECT_EQ(cb_record_finish(f.record.get()), EFBIG);
    setrlimit(RLIMIT_FSIZE, &before);
    std::ifstream in(f.path);
    std::stringstream text;
    text << in.rdbuf();
    EXPECT_EQ(text.str().back(), '\n');
    EXPECT_EQ(f.lines().size() - 1, f.record->rows);
    EXPECT_EQ(f.record->rows + f.record->lost, 100u);
    EXPECT_GT(f.record->lost, 0u);
    EXPECT_GT(f.record->rows, 0u);
}

// Another channel is another record; the first one stays beside it.
TEST(record, other_columns_begin_another_file) {
    files f;
    const auto now = std::make_unique<cb_config>(*f.config);
    ASSERT_EQ(cb_record_start(f.record.get(), f.path.c_str(), f.config.get()), 0);
    const auto follow = [&] {
        return cb_record_follow(f.record.get(), f.path.c_str(), f.config.get(), now.get());
    };
    const auto moved = [&] { return std::ifstream(f.path + ".1").good(); };
    EXPECT_EQ(follow(), 0);
    EXPECT_FALSE(moved());
    now->channels_count = 2;
    std::strcpy(now->channels[1].name, "Y");
    EXPECT_EQ(follow(), 0);
    EXPECT_TRUE(moved());
    EXPECT_EQ(f.lines(),
              std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,comp_Y_um,mode,reason"});
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
}

TEST(record, a_folder_that_is_not_there_is_reported) {
    files f;
    EXPECT_EQ(cb_record_start(f.record.get(), "/nowhere/at/all.csv", f.config.get()), ENOENT);
}

TEST(record, without_a_path_nothing_is_done) {
    files f;
    EXPECT_EQ(cb_record_start(f.record.get(), nullptr, f.config.get()), 0);
    cb_record_add(f.record.get(), f.config.get(), f.row.get());
    const auto other = std::make_unique<cb_config>();
    EXPECT_EQ(cb_record_follow(f.record.get(), nullptr, f.config.get(), other.get()), 0);
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    EXPECT_EQ(f.record->lost, 0u);
}

}  // namespace
