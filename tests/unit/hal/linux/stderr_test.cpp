// SPDX-License-Identifier: MIT
// A program that ends says why, and waits for no reader: each end runs in a process of its own.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <string>

extern "C" {
#include "firmware/base/assert.h"
#include "hal/linux/stderr.h"

// Of scripts/report mcdc alone: _exit() leaves without the profile of what ran.
int __llvm_profile_write_file(void) __attribute__((weak));
}

namespace {

[[noreturn]] void end(int code) {
    if (__llvm_profile_write_file) __llvm_profile_write_file();
    _exit(code);
}

struct stderr_end : ::testing::Test {
    stderr_end() { EXPECT_EQ(pipe2(ends, O_NONBLOCK), 0); }
    ~stderr_end() override {
        for (const int fd : ends)
            if (fd >= 0) close(fd);
    }
    void fill() const {
        const std::string full(4096, '.');
        while (write(ends[1], full.data(), full.size()) > 0) continue;
    }
    // in : prepare: in the process, whose stderr is the pipe; out: its exit code, 134 for SIGABRT
    int code_of(const std::function<void()> &work) const {
        const pid_t child = fork();
        if (child == 0) {
            std::signal(SIGABRT, [](int) { end(134); });
            dup2(ends[1], STDERR_FILENO);
            work();
            end(0);
        }
        int status = 0;
        EXPECT_EQ(waitpid(child, &status, 0), child);
        EXPECT_TRUE(WIFEXITED(status));
        return WEXITSTATUS(status);
    }
    std::string text() const {
        char bytes[1 << 16];
        const ssize_t got = read(ends[0], bytes, sizeof bytes);
        return got > 0 ? std::string(bytes, static_cast<std::size_t>(got)) : std::string();
    }
    int ends[2];
};

TEST_F(stderr_end, an_assertion_that_fails_names_program_and_place_and_aborts) {
    EXPECT_EQ(code_of([] { cb_assertion_failed("firmware/box/box.c", 7); }), 134);
    EXPECT_EQ(text(),
              "hal_linux_test: assertion failed at firmware/box/box.c:7: the program has a "
              "mistake, please report it\n");
}

// Before, a name that is too long for the line left the program without a sentence.
TEST_F(stderr_end, an_assertion_in_a_file_with_a_very_long_path_is_reported_too) {
    const std::string path(300, 'x');
    EXPECT_EQ(code_of([&] { cb_assertion_failed(path.c_str(), 7); }), 134);
    EXPECT_EQ(text().find("hal_linux_test: assertion failed at xxx"), 0u);
}

TEST_F(stderr_end, a_reader_that_does_not_read_is_not_waited_for) {
    fill();
    EXPECT_EQ(code_of([] { cb_assertion_failed("firmware/box/box.c", 7); }), 134);
    EXPECT_EQ(text().find("assertion"), std::string::npos);
}

TEST_F(stderr_end, a_stderr_that_is_closed_takes_nothing) {
    EXPECT_EQ(code_of([] {
                  close(STDERR_FILENO);
                  cb_stderr_last_words("nobody reads this");
                  if (cb_stderr_is_ready()) end(1);
              }),
              0);
}

TEST_F(stderr_end, a_reader_that_is_gone_changes_nothing) {
    close(ends[0]);
    ends[0] = -1;
    EXPECT_EQ(code_of([] {
                  std::signal(SIGPIPE, SIG_IGN);
                  cb_stderr_last_words("nobody reads this");
              }),
              0);
}

}  // namespace
