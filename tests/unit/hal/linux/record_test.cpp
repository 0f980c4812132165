// SPDX-License-Identifier: MIT
// The record holds whole lines only, also when the disk is full, and counts what it loses.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary.h"

extern "C" {
#include "firmware/terms/kinds.h"
#include "hal/linux/files/record.h"
#include "hal/linux/files/row_sigma.h"
}

namespace {
std::vector<ino_t> synced;  // files, and their folders
}  // namespace

// In place of the C library's.
extern "C" int fsync(int fd) {
    struct stat of = {};
    fstat(fd, &of);
    synced.push_back(of.st_ino);
    return static_cast<int>(syscall(SYS_fsync, fd));
}

namespace {

struct files {
    std::string path = compbox_test::temporary("record.csv");
    int64_t most_bytes = 0;
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    std::unique_ptr<cb_record> record = std::make_unique<cb_record>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();

    files() {
        for (const char *end : {"", ".1", ".2"}) std::remove((path + end).c_str());
        config->signals_count = 2;
        std::strcpy(config->signals[0].name, "X");
        std::strcpy(config->signals[1].name, "T1");
        config->outputs_count = 1;
        std::strcpy(config->outputs[0].name, "EZX");
        config->channels_count = 1;
        std::strcpy(config->channels[0].name, "Z");
    }
    int start() { return cb_record_start(record.get(), path.c_str(), most_bytes, config.get()); }
    void add(int64_t time_us) {
        row->time_us = time_us;
        cb_record_add(record.get(), config.get(), row.get());
    }
    std::vector<std::string> lines(const std::string &end = "") const {
        std::vector<std::string> result;
        std::ifstream in(path + end);
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
    ASSERT_EQ(f.start(), 0);
    f.record->wall_us = 1700000000000000;
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
              (std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,mode,reason,unix_s",
                                        "0.000000,,,0,0,0,1,1700000005.000",
                                        "0.030001,0.100000001,,-3,3,1,0,1700000005.030"}));
}

TEST(record, a_bit_that_flipped_in_the_configuration_leads_to_no_term_or_bank_beyond_it) {
    files f;
    cb_term_config &term = f.config->terms[0];
    term.type = CB_TERM_LINEAR;
    term.as.linear.has_bank = true;
    f.config->banks[0].model = 7;
    EXPECT_TRUE(cb_row_has_sigma(f.config.get(), 0));
    term.as.linear.bank = CB_MAX_BANKS;
    EXPECT_FALSE(cb_row_has_sigma(f.config.get(), 0));
    term.as.linear.bank = 0;
    f.config->outputs[0].term = CB_MAX_TERMS;
    EXPECT_FALSE(cb_row_has_sigma(f.config.get(), 0));
}

TEST(record, the_longest_rows_are_whole) {
    files f;
    f.fill_everything();
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 100; i++) cb_record_add(f.record.get(), f.config.get(), f.row.get());
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    const auto lines = f.lines();
    ASSERT_EQ(lines.size(), 101u);
    const auto commas = std::count(lines[0].begin(), lines[0].end(), ',');
    EXPECT_EQ(commas, CB_MAX_SIGNALS + CB_MAX_OUTPUTS + CB_MAX_CHANNELS + 3);
    for (const auto &line : lines) {
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas);
        EXPECT_LT(line.size(), static_cast<size_t>(CB_ROW_TEXT));
    }
}

TEST(record, a_full_disk_leaves_whole_lines_and_a_count) {
    files f;
    f.row->signals[0].state = f.row->signals[1].state = CB_ROW_SIGNAL_FRESH;
    ASSERT_EQ(f.start(), 0);
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
    ASSERT_EQ(f.start(), 0);
    const auto follow = [&] { return cb_record_follow(f.record.get(), now.get()); };
    const auto moved = [&] { return std::ifstream(f.path + ".1").good(); };
    EXPECT_EQ(follow(), 0);
    EXPECT_FALSE(moved());
    now->channels_count = 2;
    std::strcpy(now->channels[1].name, "Y");
    EXPECT_EQ(follow(), 0);
    EXPECT_TRUE(moved());
    EXPECT_EQ(f.lines(),
              std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,comp_Y_um,mode,reason,unix_s"});
    std::strcpy(now->channels[1].name, "X");
    EXPECT_EQ(follow(), 0);
    EXPECT_EQ(f.lines(),
              std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,comp_X_um,mode,reason,unix_s"});
    EXPECT_EQ(f.lines(".2").size(), 1u);
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
}

// Rows behind a header that did not fit would be no record.
TEST(record, a_new_file_whose_header_does_not_fit_is_tried_again) {
    files f;
    const auto now = std::make_unique<cb_config>(*f.config);
    ASSERT_EQ(f.start(), 0);
    std::strcpy(now->channels[0].name, "Y");
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{10, before.rlim_max};
    std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    EXPECT_EQ(cb_record_follow(f.record.get(), now.get()), EFBIG);
    setrlimit(RLIMIT_FSIZE, &before);
    f.add(1000000);
    cb_record_flush(f.record.get());
    EXPECT_EQ(f.record->lost, 1u);
    for (const int64_t now_us : {1000000, 10900000, 11000000})
        cb_record_work(f.record.get(), now_us);
    f.add(12000000);
    EXPECT_EQ(cb_record_finish(f.record.get()), EFBIG) << "the first failure stays";
    ASSERT_EQ(f.lines().size(), 2u);
    EXPECT_EQ(f.lines()[0].substr(0, 8), "time_s,X");
}

constexpr int64_t second = 1000000;
constexpr int64_t day_one = 1700000000 * second;  // a wall clock of the past

// A run of one row, at this wall clock.
void run_at(files &f, int64_t unix_us) {
    f.record->wall_us = unix_us - 5 * second;
    f.add(5 * second);
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
}

// The row that finds the buffer full may be the one behind which no file can be begun. It would be
// in the buffer while the next try reads the end of the old file into it.
TEST(record, a_row_at_which_the_next_file_could_not_be_begun_is_lost) {
    files f;
    const std::string folder = compbox_test::temporary("records");
    std::filesystem::create_directory(folder);
    f.path = folder + "/record.csv";
    f.most_bytes = 160000;
    ASSERT_EQ(f.start(), 0);
    int64_t time_us = 0;
    const auto add = [&] { f.add(time_us += 30000); };
    while (f.record->used < 10000) add();
    cb_record_flush(f.record.get());
    std::filesystem::rename(folder, folder + ".away");
    while (f.record->fd >= 0) add();
    std::filesystem::rename(folder + ".away", folder);
    EXPECT_EQ(f.record->used, 0u);
    for (const int64_t now_us : {1000000, 11000000}) cb_record_work(f.record.get(), now_us);
    add();
    cb_record_finish(f.record.get());
    const std::vector<std::string> lines = f.lines();
    for (const std::string &line : lines)
        EXPECT_EQ(std::count(line.begin(), line.end(), ','),
                  std::count(lines[0].begin(), lines[0].end(), ','))
            << line;
    EXPECT_EQ(lines.size() - 1 + f.record->lost, static_cast<std::size_t>(time_us / 30000));
}

TEST(record, a_start_goes_on_behind_the_last_row_by_the_wall_clock) {
    files f;
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one);
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one + 90 * second);
    EXPECT_EQ(f.lines(), (std::vector<std::string>{"time_s,X,T1,EZX,comp_Z_um,mode,reason,unix_s",
                                                   "0.000000,,,0,0,0,0,1700000000.000",
                                                   "90.000000,,,0,0,0,0,1700000090.000"}));
    EXPECT_TRUE(f.lines(".1").empty());
}

TEST(record, an_interval_leaves_rows_out_but_no_change_of_mode_or_reason) {
    files f;
    f.record->every_us = second;
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 100; ++i) {
        f.row->mode = i >= 42 && i < 50 ? 2 : 1;
        f.row->reason = i == 45 ? 5 : 0;
        f.add(7 * second + i * 30000);
    }
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    std::vector<std::string> times;
    for (const auto &line : f.lines()) times.push_back(line.substr(0, line.find(',')));
    EXPECT_EQ(times, (std::vector<std::string>{"time_s", "0.000000", "1.020000", "1.260000",
                                               "1.350000", "1.380000", "1.500000", "2.010000"}));
    EXPECT_EQ(f.record->lost, 0u);
}

TEST(record, a_line_that_a_power_cut_has_torn_is_cut) {
    files f;
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one);
    const auto whole = f.lines();
    std::ofstream(f.path, std::ios::app) << "60.0,1,2,3";
    ASSERT_EQ(f.start(), 0);
    EXPECT_EQ(f.lines(), whole);
    run_at(f, day_one + second);
    EXPECT_EQ(f.lines().back(), "1.000000,,,0,0,0,0,1700000001.000");
}

// A file system may give a file its new size, but not its last bytes. What is read of its end may
// then begin within the last whole row, at any of its digits.
TEST(record, what_a_power_cut_has_lost_hides_no_part_of_the_last_row) {
    const std::size_t row = std::string("20.000000,,,0,0,0,0,1700000020.000\n").size();
    for (std::size_t hidden = 0; hidden <= row; ++hidden) {
        files f;
        ASSERT_EQ(f.start(), 0);
        run_at(f, day_one);
        ASSERT_EQ(f.start(), 0);
        run_at(f, day_one + 20 * second);
        std::ofstream(f.path, std::ios::app)
            << std::string(sizeof f.record->buffer - row - 1 + hidden, '\0');
        ASSERT_EQ(f.start(), 0);
        run_at(f, day_one + 21 * second);
        const std::string time = hidden == 0 ? "21.000000" : "0.000000";
        EXPECT_EQ(f.lines().back(), time + ",,,0,0,0,0,1700000021.000") << hidden;
    }
    files f;
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one);
    std::ofstream(f.path, std::ios::app) << std::string(CB_ROW_TEXT, '\0');
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one + second);
    EXPECT_EQ(f.lines().back(), "1.000000,,,0,0,0,0,1700000001.000");
}

TEST(record, a_header_without_rows_goes_on) {
    files f;
    for (int i = 0; i < 2; ++i) {
        ASSERT_EQ(f.start(), 0);
        EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    }
    EXPECT_EQ(f.lines().size(), 1u);
    EXPECT_TRUE(f.lines(".1").empty());
}

// A clock that steps back behind the last row would let the time of the rows fall.
TEST(record, a_last_row_that_is_later_than_the_clock_begins_another_file) {
    files f;
    ASSERT_EQ(f.start(), 0);
    run_at(f, 4000000000 * second);
    const auto before = f.lines();
    ASSERT_EQ(f.start(), 0);
    run_at(f, day_one);
    EXPECT_EQ(f.lines(".1"), before);
    EXPECT_EQ(f.lines().at(1), "0.000000,,,0,0,0,0,1700000000.000");
}

TEST(record, what_is_no_record_of_these_columns_is_kept_beside_it) {
    files f;
    const std::string head = "time_s,X,T1,EZX,comp_Z_um,mode,reason,unix_s\n";
    for (const std::string &text :
         {std::string("x"), std::string("time_s,X,mode,reason\n0,1,2,3\n"), head + "words\n",
          head + "1,2\n", head + "nan,,,0,0,0,0,nan\n", head + "0,,,0,0,0,0,1e300\n",
          head + "-1,,,0,0,0,0,5\n", head + "torn", head + std::string(70000, '1')}) {
        files fresh;
        std::ofstream(fresh.path) << text;
        ASSERT_EQ(fresh.start(), 0);
        EXPECT_EQ(cb_record_finish(fresh.record.get()), 0);
        EXPECT_EQ(fresh.lines(), std::vector<std::string>{head.substr(0, head.size() - 1)}) << text;
        const bool cut = text == head + "torn";
        EXPECT_EQ(fresh.lines(".1").empty(), cut) << text.substr(0, 99);
    }
}

TEST(record, a_pipe_gets_the_header_of_other_columns_and_keeps_its_place) {
    files f;
    ASSERT_EQ(mkfifo(f.path.c_str(), 0600), 0);
    const int reader = open(f.path.c_str(), O_RDONLY | O_NONBLOCK);
    ASSERT_EQ(f.start(), 0);
    f.config->channels_count = 0;
    EXPECT_EQ(cb_record_follow(f.record.get(), f.config.get()), 0);
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    char text[200] = "";
    EXPECT_GT(read(reader, text, sizeof text - 1), 0);
    EXPECT_STREQ(text,
                 "time_s,X,T1,EZX,comp_Z_um,mode,reason,unix_s\n"
                 "time_s,X,T1,EZX,mode,reason,unix_s\n");
    EXPECT_TRUE(std::filesystem::is_fifo(f.path));
    close(reader);
}

TEST(record, a_pipe_keeps_its_place_whatever_its_limit) {
    files f;
    f.most_bytes = 8;
    ASSERT_EQ(mkfifo(f.path.c_str(), 0600), 0);
    const int reader = open(f.path.c_str(), O_RDONLY | O_NONBLOCK);
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 3; ++i) {
        f.add(i * second);
        cb_record_flush(f.record.get());
    }
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    char text[400] = "";
    EXPECT_GT(read(reader, text, sizeof text - 1), 0);
    EXPECT_EQ(std::count(text, text + sizeof text, '\n'), 4);
    EXPECT_TRUE(std::filesystem::is_fifo(f.path));
    close(reader);
}

// The reader of the pipe was slow: the end of a row found no room.
TEST(record, a_row_behind_a_torn_one_begins_a_line_of_a_pipe) {
    files f;
    ASSERT_EQ(mkfifo(f.path.c_str(), 0600), 0);
    const int reader = open(f.path.c_str(), O_RDONLY | O_NONBLOCK);
    ASSERT_EQ(fcntl(reader, F_SETPIPE_SZ, 4096), 4096);
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 150; ++i) f.add(second);
    cb_record_flush(f.record.get());
    EXPECT_EQ(f.record->lost, 150u);
    char part[5000];
    std::string text(part, static_cast<std::size_t>(read(reader, part, sizeof part)));
    f.add(2 * second);
    EXPECT_EQ(cb_record_finish(f.record.get()), EAGAIN);
    text.append(part, static_cast<std::size_t>(read(reader, part, sizeof part)));
    EXPECT_EQ(text.substr(text.rfind('\n', text.size() - 2), 10), "\n1.000000,");
    close(reader);
}

// Without rows a start behind a power cut would begin at 0.
TEST(record, the_first_rows_of_a_file_are_on_the_disk) {
    files f;
    f.most_bytes = 1600;  // a file has 200 bytes: four rows
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 10; ++i) {
        synced.clear();
        f.add(i * second);
        cb_record_flush(f.record.get());
        struct stat file = {}, folder = {};
        ASSERT_EQ(stat(f.path.c_str(), &file), 0);
        ASSERT_EQ(stat(std::filesystem::path(f.path).parent_path().c_str(), &folder), 0);
        EXPECT_EQ(std::count(synced.begin(), synced.end(), file.st_ino), i % 4 == 0) << i;
        EXPECT_EQ(!synced.empty() && synced.back() == folder.st_ino, i % 4 == 0) << i;
    }
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    EXPECT_EQ(f.lines(".1").size(), 5u);
}

TEST(record, rows_behind_a_file_that_cannot_follow_are_lost) {
    files f;
    const std::string folder = f.path + "-folder";
    std::filesystem::create_directory(folder);
    f.path = folder + "/record.csv";
    f.most_bytes = 800;  // a file has 100 bytes
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 3; ++i) f.add(i * second);
    std::filesystem::remove_all(folder);
    cb_record_flush(f.record.get());
    EXPECT_EQ(f.record->lost, 3u);
    EXPECT_EQ(f.record->rows, 0u);
    f.add(3 * second);
    EXPECT_EQ(cb_record_finish(f.record.get()), ENOENT);
    EXPECT_EQ(f.record->lost, 4u);
}

// A reload comes while the disk is away.
TEST(record, a_file_that_is_begun_late_has_the_columns_of_its_rows) {
    files f;
    const std::string folder = f.path + "-folder";
    std::filesystem::create_directory(folder);
    f.path = folder + "/record.csv";
    f.most_bytes = 800;
    ASSERT_EQ(f.start(), 0);
    for (int i = 0; i < 3; ++i) f.add(i * second);
    std::filesystem::remove_all(folder);
    cb_record_flush(f.record.get());
    ASSERT_LT(f.record->fd, 0);
    f.config->channels_count = 2;
    std::strcpy(f.config->channels[1].name, "Y");
    EXPECT_EQ(cb_record_follow(f.record.get(), f.config.get()), 0);
    std::filesystem::create_directory(folder);
    for (const int64_t now_us : {1 * second, 11 * second}) cb_record_work(f.record.get(), now_us);
    f.add(12 * second);
    cb_record_finish(f.record.get());
    const std::vector<std::string> lines = f.lines();
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0], "time_s,X,T1,EZX,comp_Z_um,comp_Y_um,mode,reason,unix_s");
    EXPECT_EQ(std::count(lines[1].begin(), lines[1].end(), ','), 8);
}

TEST(record, a_folder_that_is_not_there_is_reported) {
    files f;
    EXPECT_EQ(cb_record_start(f.record.get(), "/nowhere/at/all.csv", 0, f.config.get()), ENOENT);
}

TEST(record, without_a_path_nothing_is_done) {
    files f;
    EXPECT_EQ(cb_record_start(f.record.get(), nullptr, 0, f.config.get()), 0);
    cb_record_add(f.record.get(), f.config.get(), f.row.get());
    const auto other = std::make_unique<cb_config>();
    EXPECT_EQ(cb_record_follow(f.record.get(), other.get()), 0);
    EXPECT_EQ(cb_record_finish(f.record.get()), 0);
    EXPECT_EQ(f.record->lost, 0u);
}

}  // namespace
