// SPDX-License-Identifier: MIT
// The log of events: appended to, rotated by size, whole lines only.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/temporary.h"

extern "C" {
#include "firmware/box/mode.h"
#include "hal/linux/files/events.h"
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct events : testing::Test {
    fs::path path = compbox_test::temporary("events.jsonl");
    cb_events of{};

    events() {
        for (int n = 0; n <= CB_EVENTS_FILES; ++n) fs::remove(file(n));
        EXPECT_EQ(cb_events_start(&of, path.c_str()), 0);
    }
    ~events() override { cb_events_finish(&of); }
    fs::path file(int n) const { return path.string() + (n == 0 ? "" : "." + std::to_string(n)); }
    json first_of(int n) const {
        std::ifstream in(file(n));
        std::string line;
        std::getline(in, line);
        return json::parse(line);
    }
    std::vector<json> lines() const {
        std::vector<json> all;
        std::ifstream in(path);
        for (std::string line; std::getline(in, line);)
            all.push_back(json::parse(line, nullptr, false));
        return all;
    }
    void restart() {
        EXPECT_EQ(cb_events_finish(&of), 0);
        EXPECT_EQ(cb_events_start(&of, path.c_str()), 0);
    }
};

TEST_F(events, a_line_has_the_clocks_the_file_and_the_mode) {
    const auto row = std::make_unique<cb_row>();
    row->mode = CB_MODE_HOLD;
    row->reason = CB_REASON_SIGNAL;
    row->cause = {{CB_CAUSE_STALE, 0, 180, 90}, "X", ""};
    of.revision = 7, of.crc32 = 0x1a2b;
    cb_events_add(&of, "mode", "HOLD: \"why\"", row.get());
    const json line = lines().at(0);
    EXPECT_EQ(line["kind"], "mode");
    EXPECT_EQ(line["text"], "HOLD: \"why\"");
    EXPECT_EQ(line["mode"], "HOLD");
    EXPECT_EQ(line["cause"], "signal X is 180 ms old and its max_age_ms is 90");
    EXPECT_EQ(line["revision"], 7);
    EXPECT_EQ(line["crc"], "00001a2b");
    EXPECT_GT(line["unix_s"].get<double>(), 1.7e9);
    EXPECT_GT(line["boot_s"].get<double>(), 0);
}

TEST_F(events, a_restart_appends) {
    cb_events_add(&of, "run", "first", nullptr);
    restart();
    cb_events_add(&of, "run", "second", nullptr);
    ASSERT_EQ(lines().size(), 2u);
    EXPECT_EQ(lines()[1]["text"], "second");
}

TEST_F(events, a_line_that_a_power_cut_has_torn_stays_alone) {
    cb_events_add(&of, "run", "first", nullptr);
    std::ofstream(path, std::ios::app) << R"({"unix_s": 17)";
    restart();
    cb_events_add(&of, "run", "second", nullptr);
    ASSERT_EQ(lines().size(), 3u);
    EXPECT_TRUE(lines()[1].is_discarded());
    EXPECT_EQ(lines()[2]["text"], "second");
}

TEST_F(events, all_files_together_have_a_limit) {
    const std::string filler(CB_EVENTS_BYTES - 1000, ' ');
    for (int i = 0; i < 2 * CB_EVENTS_FILES; ++i) {
        cb_events_add(&of, "run", std::to_string(i).c_str(), nullptr);
        std::ofstream(path, std::ios::app) << filler << "{}\n";
        restart();
        while (fs::file_size(path) > filler.size())
            cb_events_add(&of, "run", std::to_string(i).c_str(), nullptr);
    }
    for (int n = 0; n < CB_EVENTS_FILES; ++n) {
        EXPECT_LE(fs::file_size(file(n)), static_cast<std::uintmax_t>(CB_EVENTS_BYTES)) << n;
        EXPECT_EQ(first_of(n)["text"], std::to_string(2 * CB_EVENTS_FILES - 1 - n));
    }
    EXPECT_FALSE(fs::exists(file(CB_EVENTS_FILES)));
}

TEST_F(events, a_full_disk_loses_whole_lines_and_the_next_one_counts_them) {
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, SIG_IGN);
    cb_events_add(&of, "run", "before", nullptr);
    const rlimit small{fs::file_size(path) + 40, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (int i = 0; i < 3; ++i) cb_events_add(&of, "run", "lost", nullptr);
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(of.error, EFBIG);
    EXPECT_EQ(lines().size(), 1u);
    cb_events_add(&of, "run", "after", nullptr);
    ASSERT_EQ(lines().size(), 2u);
    EXPECT_EQ(of.error, 0);
    EXPECT_EQ(lines()[1]["lost_before"], 3);
}

TEST_F(events, a_link_in_its_place_is_not_followed) {
    cb_events_finish(&of);
    fs::remove(path);
    fs::create_symlink("/dev/null", path);
    EXPECT_EQ(cb_events_start(&of, path.c_str()), ELOOP);
}

TEST_F(events, without_a_path_nothing_is_done) {
    cb_events none{};
    EXPECT_EQ(cb_events_start(&none, nullptr), 0);
    cb_events_add(&none, "run", "nothing", nullptr);
    EXPECT_EQ(cb_events_finish(&none), 0);
}

}  // namespace
