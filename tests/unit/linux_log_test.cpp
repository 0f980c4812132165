// SPDX-License-Identifier: MIT
// What a person reads: every kind of line has its own limit, and what is left out is said.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <string>

extern "C" {
#include "firmware/canopen.h"
#include "firmware/mode.h"
#include "hal/linux/daemon/log.h"
}

namespace {

constexpr int64_t s = 1000000;

// stderr is a pipe meanwhile; its reader is said().
struct log_lines : ::testing::Test {
    log_lines() {
        EXPECT_EQ(pipe(ends), 0);
        kept = dup(STDERR_FILENO);
        dup2(ends[1], STDERR_FILENO);
        cb_canopen_start(row->can.nodes);
        config->nodes_count = 1;
        config->nodes[0] = {5, false, 300};
    }
    ~log_lines() override {
        dup2(kept, STDERR_FILENO);
        for (int fd : {ends[0], ends[1], kept}) close(fd);
        unsetenv("JOURNAL_STREAM");
    }
    void start() { cb_log_start(log.get(), "192.0.2.7:502", 0); }
    void step(int64_t time_us) {
        row->time_us = time_us;
        cb_log_row(log.get(), row.get());
        cb_log_can(log.get(), config.get(), row.get());
        cb_log_catch_up(log.get(), time_us, false);
    }
    // Everything since the last call.
    std::string said() {
        fflush(stderr);
        const char end = '\0';
        EXPECT_EQ(write(ends[1], &end, 1), 1);
        std::string text;
        for (char c; read(ends[0], &c, 1) == 1 && c != end;) text += c;
        return text;
    }
    static unsigned count(const std::string &text, const std::string &what) {
        unsigned n = 0;
        for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++n;
        return n;
    }
    int ends[2], kept;
    std::unique_ptr<cb_log> log = std::make_unique<cb_log>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();
    std::unique_ptr<cb_can_config> config = std::make_unique<cb_can_config>();
};

// A node that flickers for ten seconds; in the middle the box changes its mode.
TEST_F(log_lines, a_bus_that_flickers_hides_no_change_of_mode) {
    start();
    for (int i = 0; i < 333; ++i) {
        row->can.nodes[0].state = i % 2 ? CB_CANOPEN_STOPPED : CB_CANOPEN_OPERATIONAL;
        row->mode = i < 150 ? CB_MODE_ACTIVE : CB_MODE_HOLD;
        step(i * 30000);
    }
    const std::string text = said();
    EXPECT_EQ(count(text, "ACTIVE: "), 1u);
    EXPECT_EQ(count(text, "HOLD: "), 1u) << text;
    const unsigned lines = count(text, "node 5 is ");
    EXPECT_GE(lines, 30u);
    EXPECT_LE(lines, 41u);
    EXPECT_NE(text.find("about the CAN bus left out)"), std::string::npos);
    EXPECT_EQ(text.find("about the mode"), std::string::npos);
}

TEST_F(log_lines, what_was_left_out_is_said_by_itself_and_once) {
    start();
    for (int i = 0; i < 100; ++i) cb_log_limited(log.get(), CB_LOG_FILES, 0, "line %d", i);
    EXPECT_EQ(count(said(), "line"), 20u);
    cb_log_catch_up(log.get(), s, false);
    EXPECT_EQ(said(), "") << "it may go on";
    cb_log_catch_up(log.get(), 2 * s, false);
    EXPECT_EQ(said(), "compboxd:     2.000 s: (80 lines about files left out)\n");
    cb_log_catch_up(log.get(), 9 * s, true);
    EXPECT_EQ(said(), "");
}

TEST_F(log_lines, the_end_says_what_was_left_out) {
    start();
    for (int i = 0; i < 21; ++i) cb_log_limited(log.get(), CB_LOG_MODE, 0, "line");
    said();
    cb_log_catch_up(log.get(), 1, true);
    EXPECT_EQ(said(), "compboxd:     0.000 s: (1 line about the mode left out)\n");
}

TEST_F(log_lines, a_reader_that_does_not_read_keeps_nobody_and_is_told_later) {
    start();
    const std::string full(4096, '.');
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    while (write(ends[1], full.data(), full.size()) > 0) continue;
    fcntl(ends[1], F_SETFL, 0);
    cb_log_say(log.get(), 0, "nobody reads this");
    std::string dots(1 << 16, ' ');
    EXPECT_GT(read(ends[0], dots.data(), dots.size()), 0);
    cb_log_say(log.get(), s, "but this");
    const std::string text = said();
    EXPECT_EQ(text,
              "compboxd:     1.000 s: (1 line about start and end left out)\n"
              "compboxd:     1.000 s: but this\n");
}

TEST_F(log_lines, a_long_sentence_comes_whole) {
    start();
    const std::string sentence(560, 'x');
    cb_log_say(log.get(), 0, "%s", sentence.c_str());
    EXPECT_NE(said().find(sentence + "\n"), std::string::npos);
}

// systemd says which device and file its journal is; another stderr is not it.
TEST_F(log_lines, the_journal_has_time_and_name_already) {
    struct stat there;
    fstat(ends[1], &there);
    const std::string device = std::to_string(there.st_dev) + ":";
    setenv("JOURNAL_STREAM", (device + std::to_string(there.st_ino)).c_str(), 1);
    start();
    cb_log_say(log.get(), 0, "a line");
    EXPECT_EQ(said(), "a line\n");
    setenv("JOURNAL_STREAM", (device + std::to_string(there.st_ino + 1)).c_str(), 1);
    start();
    cb_log_say(log.get(), 0, "a line");
    EXPECT_EQ(said(), "compboxd:     0.000 s: a line\n");
}

}  // namespace
