// SPDX-License-Identifier: MIT
// What the log says of the files that get the rows.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>

#include "tests/support/temporary.h"

extern "C" {
#include "firmware/box/mode.h"
#include "hal/linux/daemon/row_files.h"
}

namespace {

struct row_files : testing::Test {
    static constexpr int64_t second = 1000000;
    std::string folder = compbox_test::temporary("row_files");
    std::unique_ptr<cb_options> options = std::make_unique<cb_options>();
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    std::unique_ptr<cb_row_files> files = std::make_unique<cb_row_files>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();
    cb_log log{};
    int64_t now_us = 1000 * second;

    row_files() {
        std::filesystem::remove_all(folder);
        std::filesystem::create_directory(folder);
        config->period_us = 100000;
        config->signals_count = 1;
        std::strcpy(config->signals[0].name, "X");
        options->blackbox_most_mb = 100;
        testing::internal::CaptureStderr();
    }
    ~row_files() override { testing::internal::GetCapturedStderr(); }
    void start() {
        cb_log_start(&log, "192.0.2.7:502", now_us);
        ASSERT_TRUE(cb_row_files_start(files.get(), options.get(), &log, config.get()));
    }
    void add(int count, int mode) {
        for (; count > 0; --count) {
            row->time_us = now_us += config->period_us;
            row->mode = static_cast<uint8_t>(mode);
            cb_row_files_add(files.get(), config.get(), row.get());
            cb_row_files_work(files.get(), now_us);
        }
    }
    // out: how often the log has the words
    static unsigned logged(const std::string &words) {
        const std::string text = testing::internal::GetCapturedStderr();
        testing::internal::CaptureStderr();
        unsigned n = 0;
        for (size_t at = 0; (at = text.find(words, at)) != std::string::npos; at += 1) ++n;
        return n;
    }
};

TEST_F(row_files, a_black_box_is_named_once_whatever_ends_it) {
    options->blackbox = folder.c_str();
    start();
    add(20, CB_MODE_ACTIVE);
    add(120, CB_MODE_HOLD);
    EXPECT_EQ(logged("black box: " + folder + "/000001-"), 1u) << "by its time";
    add(600, CB_MODE_ACTIVE);
    add(1, CB_MODE_HOLD);
    std::strcpy(config->signals[0].name, "Y");
    cb_row_files_follow(files.get(), config.get());
    EXPECT_EQ(logged("black box: " + folder + "/000002-"), 1u) << "by other columns";
    add(20, CB_MODE_ACTIVE);
    EXPECT_EQ(logged("black box"), 0u);
    cb_blackbox_request(&files->blackbox, now_us);
    EXPECT_TRUE(cb_row_files_finish(files.get(), now_us));
    EXPECT_EQ(logged("black box: " + folder + "/000003-"), 1u) << "by the end";
}

TEST_F(row_files, a_record_of_inputs_that_fails_is_logged_at_once) {
    options->inputs = "/dev/full";
    start();
    add(1000, CB_MODE_ACTIVE);
    EXPECT_EQ(logged("/dev/full: cannot be written: No space left on device"), 1u);
    EXPECT_FALSE(cb_row_files_finish(files.get(), now_us));
}

}  // namespace
