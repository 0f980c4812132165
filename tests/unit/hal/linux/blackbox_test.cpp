// SPDX-License-Identifier: MIT
// The black box: files around events, no row twice, limits of files and bytes.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary.h"

extern "C" {
#include "firmware/box/mode.h"
#include "hal/linux/clock.h"
#include "hal/linux/files/blackbox.h"
}

namespace {
bool is_faster = false;  // whoever else removes files
}  // namespace

// In place of the C library's.
extern "C" int unlink(const char *path) noexcept {
    if (is_faster) syscall(SYS_unlink, path);
    return static_cast<int>(syscall(SYS_unlink, path));
}

namespace {

namespace fs = std::filesystem;
constexpr int64_t period = 100000;

struct blackbox : testing::Test {
    static constexpr int64_t second = 1000000;
    std::string folder = compbox_test::temporary("blackbox");
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    std::unique_ptr<cb_blackbox> box = std::make_unique<cb_blackbox>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();
    int64_t now_us = 1000 * second;

    blackbox() {
        fs::remove_all(folder);
        fs::create_directory(folder);
        config->period_us = period;
        config->signals_count = 1;
        std::strcpy(config->signals[0].name, "X");
    }
    ~blackbox() override { finish(); }
    int start(int64_t most_bytes = 100 << 20) {
        return cb_blackbox_start(box.get(), folder.c_str(), most_bytes, config.get());
    }
    int finish() { return cb_blackbox_finish(box.get(), now_us); }
    // Rows of a mode, each with its number as X; the normal thread works behind each.
    void run(double duration_s, int mode) {
        for (auto n = static_cast<int64_t>(duration_s * 1e6) / period; n > 0; --n) {
            now_us += period;
            row->time_us = now_us;
            row->mode = static_cast<uint8_t>(mode);
            row->signals[0] = {static_cast<float>(now_us / period), CB_ROW_SIGNAL_FRESH, 0, 0, 0};
            cb_blackbox_add(box.get(), config.get(), row.get());
            cb_blackbox_work(box.get(), now_us);
        }
    }
    std::vector<std::string> names() const {
        std::set<std::string> all;
        for (const auto &entry : fs::directory_iterator(folder))
            all.insert(entry.path().filename());
        return {all.begin(), all.end()};
    }
    // Seconds of the rows of a file, as X has them.
    std::vector<double> times(const std::string &name) const {
        std::ifstream in(folder + "/" + name);
        std::vector<double> all;
        std::string line;
        std::getline(in, line);
        EXPECT_EQ(line, "time_s,X,mode,reason,unix_s");
        while (std::getline(in, line))
            all.push_back(std::stod(line.substr(line.find(',') + 1)) * period / second);
        return all;
    }
};

TEST_F(blackbox, a_hold_becomes_a_file_of_ten_minutes_before_and_ten_seconds_after) {
    ASSERT_EQ(start(), 0);
    run(900, CB_MODE_ACTIVE);
    EXPECT_TRUE(names().empty());
    const double event_s = 1e-6 * static_cast<double>(now_us + period);
    run(30, CB_MODE_HOLD);
    EXPECT_EQ(box->files, 1u);
    ASSERT_EQ(names().size(), 1u);
    const std::string name = names()[0];
    EXPECT_EQ(name.substr(0, 7), "000001-");
    EXPECT_EQ(name.substr(name.size() - 10), "Z-HOLD.csv");
    const auto found = times(name);
    EXPECT_LE(found.front(), event_s - 600);
    EXPECT_NEAR(found.back(), event_s + 10, 0.11);
    for (std::size_t i = 1; i < found.size(); ++i) EXPECT_NEAR(found[i] - found[i - 1], 0.1, 1e-3);
}

TEST_F(blackbox, no_row_is_written_twice_and_a_storm_has_a_file_a_minute) {
    ASSERT_EQ(start(), 0);
    run(120, CB_MODE_ACTIVE);
    for (int i = 0; i < 300; ++i) {
        run(1, CB_MODE_HOLD);
        run(1, CB_MODE_ACTIVE);
    }
    EXPECT_EQ(finish(), 0);
    EXPECT_LE(names().size(), 11u);
    EXPECT_GE(names().size(), 9u);
    std::vector<double> all;
    for (const auto &name : names())
        for (const double time_s : times(name)) all.push_back(time_s);
    for (std::size_t i = 1; i < all.size(); ++i) EXPECT_NEAR(all[i] - all[i - 1], 0.1, 1e-3);
}

TEST_F(blackbox, a_fault_behind_a_hold_names_the_file_of_the_hold_and_extends_it) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(5, CB_MODE_HOLD);
    const double event_s = 1e-6 * static_cast<double>(now_us + period);
    run(30, CB_MODE_FAULT);
    ASSERT_EQ(names().size(), 1u);
    EXPECT_NEAR(times(names()[0]).back(), event_s + 10, 0.11);
}

TEST_F(blackbox, a_request_ends_the_pause_of_an_event_that_waits_for_its_file) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(12, CB_MODE_HOLD);
    run(1, CB_MODE_ACTIVE);
    run(10, CB_MODE_HOLD);
    ASSERT_EQ(names().size(), 1u) << "the second HOLD waits";
    cb_blackbox_request(box.get(), now_us);
    run(12, CB_MODE_HOLD);
    ASSERT_EQ(names().size(), 2u);
    EXPECT_NE(names()[1].find("Z-REQUEST.csv"), std::string::npos) << names()[1];
    EXPECT_NEAR(times(names()[1]).front() - times(names()[0]).back(), 0.1, 1e-3);
}

TEST_F(blackbox, a_request_waits_for_no_pause_and_holds_what_is_new) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    cb_blackbox_request(box.get(), now_us);
    run(15, CB_MODE_ACTIVE);
    cb_blackbox_request(box.get(), now_us);
    run(15, CB_MODE_ACTIVE);
    ASSERT_EQ(names().size(), 2u);
    EXPECT_NE(names()[0].find("Z-REQUEST.csv"), std::string::npos);
    EXPECT_NEAR(times(names()[1]).front() - times(names()[0]).back(), 0.1, 1e-3);
}

TEST_F(blackbox, an_end_writes_what_is_pending) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(0.1, CB_MODE_FAULT);
    EXPECT_EQ(finish(), 0);
    ASSERT_EQ(names().size(), 1u);
    EXPECT_EQ(times(names()[0]).size(), 201u);
}

TEST_F(blackbox, other_columns_end_the_file_and_begin_another_ring) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(1, CB_MODE_HOLD);
    EXPECT_EQ(cb_blackbox_follow(box.get(), config.get()), 0);
    run(1, CB_MODE_HOLD);
    EXPECT_EQ(box->files, 0u) << "the same columns";
    config->channels_count = 1;
    std::strcpy(config->channels[0].name, "Z");
    EXPECT_EQ(cb_blackbox_follow(box.get(), config.get()), 0);
    ASSERT_EQ(names().size(), 1u);
    EXPECT_EQ(times(names()[0]).size(), 220u);
    run(100, CB_MODE_ACTIVE);
    cb_blackbox_request(box.get(), now_us);
    EXPECT_EQ(finish(), 0);
    ASSERT_EQ(names().size(), 2u);
    std::ifstream in(folder + "/" + names()[1]);
    std::string header;
    std::getline(in, header);
    EXPECT_EQ(header, "time_s,X,comp_Z_um,mode,reason,unix_s");
}

TEST_F(blackbox, other_columns_end_the_event_however_late) {
    now_us = cb_boottime_us() - 91 * second;
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(1, CB_MODE_HOLD);
    std::strcpy(config->signals[0].name, "Y");
    EXPECT_EQ(cb_blackbox_follow(box.get(), config.get()), 0);
    run(80, CB_MODE_HOLD);
    EXPECT_EQ(names().size(), 1u);
}

TEST_F(blackbox, another_name_of_the_same_length_begins_another_ring) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    std::strcpy(config->signals[0].name, "Y");
    EXPECT_EQ(cb_blackbox_follow(box.get(), config.get()), 0);
    run(1, CB_MODE_HOLD);
    EXPECT_EQ(finish(), 0);
    ASSERT_EQ(names().size(), 1u);
    std::ifstream in(folder + "/" + names()[0]);
    std::string header;
    std::getline(in, header);
    EXPECT_EQ(header, "time_s,Y,mode,reason,unix_s");
    std::size_t rows = 0;
    for (std::string line; std::getline(in, line);) ++rows;
    EXPECT_EQ(rows, 10u) << "those of Y";
}

TEST_F(blackbox, an_end_without_its_folder_is_reported) {
    ASSERT_EQ(start(), 0);
    run(1, CB_MODE_ACTIVE);
    cb_blackbox_request(box.get(), now_us);
    fs::remove_all(folder);
    EXPECT_EQ(finish(), ENOENT);
}

TEST_F(blackbox, a_loop_without_rows_ends_the_file_by_the_time) {
    ASSERT_EQ(start(), 0);
    run(20, CB_MODE_ACTIVE);
    run(1, CB_MODE_HOLD);
    for (int i = 0; i < 150; ++i) cb_blackbox_work(box.get(), now_us += period);
    EXPECT_EQ(box->files, 1u);
}

TEST_F(blackbox, the_lowest_numbers_are_removed_within_the_limits_and_other_files_stay) {
    for (const char *name :
         {"000007-20200101T000000Z-HOLD.csv", "000009-19700101T000000Z-FAULT.csv",
          "000010-19700101T000000Z-FAULT.csv.new", "notes.csv", "000001-x.csv",
          "000002-20200101T000000Z-HOLD.csv-copy", "  0003-20200101T000000Z-HOLD.csv"})
        std::ofstream(folder + "/" + name) << std::string(1000000, 'x');
    ASSERT_EQ(start(2 << 20), 0);
    run(20, CB_MODE_ACTIVE);
    run(0.1, CB_MODE_HOLD);
    EXPECT_EQ(finish(), 0);
    const auto found = names();
    ASSERT_EQ(found.size(), 6u);
    EXPECT_EQ(found[3], "000009-19700101T000000Z-FAULT.csv");
    EXPECT_EQ(found[4].substr(0, 7), "000010-") << "the next number, whatever the clock says";
    EXPECT_EQ(found[0], "  0003-20200101T000000Z-HOLD.csv");
    EXPECT_EQ(found[1] + found[5], "000001-x.csvnotes.csv");
    EXPECT_EQ(found[2], "000002-20200101T000000Z-HOLD.csv-copy");
}

TEST_F(blackbox, so_many_files_at_most) {
    for (int n = 1; n <= 120; ++n) {
        char name[64];
        std::snprintf(name, sizeof name, "%06d-20200101T000000Z-HOLD.csv", n);
        std::ofstream(folder + "/" + name) << "x";
    }
    ASSERT_EQ(start(), 0);
    EXPECT_EQ(names().size(), static_cast<std::size_t>(CB_BLACKBOX_FILES));
    run(1, CB_MODE_HOLD);
    EXPECT_EQ(finish(), 0);
    EXPECT_EQ(names().size(), static_cast<std::size_t>(CB_BLACKBOX_FILES));
    EXPECT_EQ(names().back().substr(0, 7), "000121-");
}

TEST_F(blackbox, a_file_that_someone_else_removes_first_costs_no_event) {
    for (const char *name :
         {"000001-20200101T000000Z-HOLD.csv", "000002-20200101T000000Z-HOLD.csv"})
        std::ofstream(folder + "/" + name) << std::string(1000000, 'x');
    ASSERT_EQ(start(2 << 20), 0);
    run(20, CB_MODE_ACTIVE);
    is_faster = true;
    run(20, CB_MODE_HOLD);
    is_faster = false;
    EXPECT_EQ(box->error, 0);
    EXPECT_EQ(box->files, 1u);
}

TEST_F(blackbox, a_full_disk_leaves_no_part_of_a_file_and_the_rows_for_the_next) {
    ASSERT_EQ(start(), 0);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1000, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    run(20, CB_MODE_ACTIVE);
    run(20, CB_MODE_HOLD);
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(box->error, EFBIG);
    EXPECT_TRUE(names().empty());
    run(60, CB_MODE_ACTIVE);
    run(20, CB_MODE_HOLD);
    EXPECT_EQ(box->error, 0);
    ASSERT_EQ(names().size(), 1u);
    EXPECT_GT(times(names()[0]).size(), 1000u);
}

TEST_F(blackbox, many_columns_have_fewer_minutes_of_memory) {
    config->period_us = 1000;
    config->signals_count = CB_MAX_SIGNALS;
    config->outputs_count = CB_MAX_OUTPUTS;
    ASSERT_EQ(start(), 0);
    const std::size_t bytes = 16 + 4 * (CB_MAX_SIGNALS + CB_MAX_OUTPUTS);
    EXPECT_EQ(box->capacity, CB_BLACKBOX_MEMORY / bytes);
    for (unsigned i = 0; i < box->capacity + 1000; ++i) {
        row->time_us = now_us += 1000;
        cb_blackbox_add(box.get(), config.get(), row.get());
    }
    cb_blackbox_request(box.get(), now_us);
    EXPECT_EQ(finish(), 0);
    EXPECT_EQ(names().size(), 1u);
}

TEST_F(blackbox, a_folder_that_is_not_there_is_reported) {
    EXPECT_EQ(cb_blackbox_start(box.get(), "/nowhere", 1, config.get()), ENOENT);
}

TEST_F(blackbox, a_folder_whose_files_have_too_long_names_is_reported) {
    const std::string longest = folder + std::string(4096 - 70 - folder.size(), '/');
    const std::string too_long = longest + "/";
    EXPECT_EQ(cb_blackbox_start(box.get(), too_long.c_str(), 1 << 20, config.get()), ENAMETOOLONG);
    ASSERT_EQ(cb_blackbox_start(box.get(), longest.c_str(), 1 << 20, config.get()), 0);
    run(1, CB_MODE_HOLD);
    EXPECT_EQ(finish(), 0);
    EXPECT_EQ(names().size(), 1u);
}

TEST_F(blackbox, without_a_folder_nothing_is_done) {
    EXPECT_EQ(cb_blackbox_start(box.get(), nullptr, 0, config.get()), 0);
    run(1, CB_MODE_HOLD);
    cb_blackbox_request(box.get(), now_us);
    EXPECT_EQ(cb_blackbox_follow(box.get(), config.get()), 0);
    EXPECT_EQ(finish(), 0);
}

}  // namespace
