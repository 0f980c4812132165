// SPDX-License-Identifier: MIT
// The daemon's files in a folder of another user: no symbolic link makes it write elsewhere.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "tests/support/box_fixture.h"
#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/files/input_record.h"
#include "hal/linux/files/output_file.h"
#include "hal/linux/files/record.h"
#include "hal/linux/files/state.h"
#include "hal/linux/files/stats.h"
}

namespace compbox {
namespace {

namespace fs = std::filesystem;

struct output : testing::Test {
    fs::path folder = compbox_test::temporary("outputs");
    fs::path victim = folder / "victim", path = folder / "out";
    box_rig rig{config_builder()};

    output() {
        fs::remove_all(folder);
        fs::create_directory(folder);
        std::ofstream(victim) << "precious";
    }
    static std::string text_of(const fs::path &file) {
        std::ifstream in(file);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    const cb_config *config() const { return &rig.box->config; }
    int write_stats() const {
        const auto stats = std::make_unique<cb_stats>();
        stats->run.config_file = stats->run.plc = "x";
        return cb_stats_write(stats.get(), config(), path.c_str());
    }
    int write_state() const {
        cb_state state{};
        const cb_state_clock now{};
        return cb_state_write(&state, config(), path.c_str(), &now);
    }
    int start_record() const {
        const auto record = std::make_unique<cb_record>();
        const int error = cb_record_start(record.get(), path.c_str(), 0, config());
        return error != 0 ? error : cb_record_finish(record.get());
    }
    int start_inputs() const {
        cb_input_record record;
        const int error = cb_input_record_start(&record, path.c_str());
        return error != 0 ? error : cb_input_record_finish(&record);
    }
    void refused_at_a_link(int (output::*write)() const) {
        fs::create_symlink("victim", path);
        EXPECT_EQ((this->*write)(), ELOOP);
        EXPECT_TRUE(fs::is_symlink(path));
        fs::remove(path);
        fs::create_symlink("missing", path);
        EXPECT_EQ((this->*write)(), ELOOP) << "a link to nothing would create a file elsewhere";
        EXPECT_FALSE(fs::exists(folder / "missing"));
        fs::remove(path);
        EXPECT_EQ((this->*write)(), 0);
        EXPECT_TRUE(fs::is_regular_file(path));
        EXPECT_EQ(text_of(victim), "precious");
    }
    // The name of the temporary file can be guessed: a link waits there.
    void replaces_a_planted_temporary(int (output::*write)() const) {
        fs::create_symlink("victim", path.string() + ".new");
        EXPECT_EQ((this->*write)(), 0);
        EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(path)));
        EXPECT_GT(fs::file_size(path), 0u);
        EXPECT_EQ(text_of(victim), "precious");
    }
};

TEST_F(output, statistics_follow_no_link) {
    refused_at_a_link(&output::write_stats);
    replaces_a_planted_temporary(&output::write_stats);
}

TEST_F(output, state_follows_no_link) {
    refused_at_a_link(&output::write_state);
    replaces_a_planted_temporary(&output::write_state);
}

TEST_F(output, state_is_not_read_through_a_link) {
    ASSERT_EQ(write_state(), 0);
    fs::rename(path, folder / "real");
    fs::create_symlink("real", path);
    cb_state state;
    char printed[512];
    const cb_state_clock now{};
    EXPECT_FALSE(cb_state_read(&state, config(), path.c_str(), &now, printed, sizeof printed));
    EXPECT_NE(std::string(printed).find("is a symbolic link"), std::string::npos) << printed;
}

TEST_F(output, record_follows_no_link) {
    refused_at_a_link(&output::start_record);
}

TEST_F(output, inputs_follow_no_link) {
    refused_at_a_link(&output::start_inputs);
}

TEST_F(output, a_pipe_without_a_reader_is_not_waited_for) {
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    EXPECT_EQ(start_record(), ENXIO);
    EXPECT_EQ(start_inputs(), ENXIO);
    EXPECT_EQ(write_stats(), ENOTSUP);
}

TEST_F(output, a_device_loses_nothing) {
    path = "/dev/null";
    EXPECT_EQ(start_record(), 0);
    EXPECT_EQ(start_inputs(), 0);
}

TEST_F(output, inputs_replace_those_of_an_earlier_run) {
    std::ofstream(path) << "of an earlier run";
    EXPECT_EQ(start_inputs(), 0);
    EXPECT_EQ(text_of(path), "");
}

TEST_F(output, without_a_path_no_inputs_are_recorded) {
    cb_input_record record;
    const auto row = std::make_unique<cb_row>();
    const cb_ceiling none{0, 0};
    const cb_state state{};
    ASSERT_EQ(cb_input_record_start(&record, nullptr), 0);
    cb_input_record_begin(&record, &none, &state);
    cb_input_record_add(&record, config(), row.get());
    EXPECT_EQ(cb_input_record_finish(&record), 0);
}

TEST_F(output, a_path_that_is_too_long_is_reported) {
    path = "/" + std::string(4100, 'x');
    EXPECT_EQ(write_stats(), ENAMETOOLONG);
    EXPECT_EQ(write_state(), ENAMETOOLONG);
}

TEST_F(output, statistics_list_channels_that_were_limited_or_excessive) {
    const auto stats = std::make_unique<cb_stats>();
    const auto one = std::make_unique<cb_config>();
    stats->run.config_file = stats->run.plc = "x";
    one->channels_count = 1;
    std::strcpy(one->channels[0].name, "Z");
    const auto listed = [&](unsigned limited, unsigned excessive) {
        stats->last.channels[0].limited = limited;
        stats->last.channels[0].excessive = excessive;
        EXPECT_EQ(cb_stats_write(stats.get(), one.get(), path.c_str()), 0);
        return text_of(path).find("\"limited\": " + std::to_string(limited) + ", \"excessive\": " +
                                  std::to_string(excessive)) != std::string::npos;
    };
    EXPECT_FALSE(listed(0, 0));
    EXPECT_TRUE(listed(0, 3));
    EXPECT_TRUE(listed(2, 0));
}

TEST_F(output, links_on_the_way_are_followed) {
    fs::create_directory(folder / "private");
    fs::create_directory_symlink("private", folder / "public");  // as systemd's state folder
    path = folder / "public/out";
    EXPECT_EQ(write_state(), 0);
    EXPECT_EQ(start_record(), 0);
    EXPECT_TRUE(fs::exists(folder / "private/out"));
}

}  // namespace
}  // namespace compbox
