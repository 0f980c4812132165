// SPDX-License-Identifier: MIT
// When a coefficient file counts as changed: every way in which editors, people and machines put
// another one in its place.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/unit/temporary.h"

extern "C" {
#include "hal/linux/daemon/reload.h"
#include "hal/linux/realtime.h"
}

namespace {

namespace fs = std::filesystem;

struct reload_file : ::testing::Test {
    reload_file() {
        folder = compbox_test::temporary("reload");
        fs::remove_all(folder);
        fs::create_directories(folder);
        path = (folder / "c.json").string();
        write(path, "first");
    }
    static void write(const fs::path &to, const std::string &text) { std::ofstream(to) << text; }
    // As cb_reload_offer() does before it reads.
    void start() { cb_reload_start(&reload, path.c_str()); }
    // One look, a second after the last one.
    bool look() { return cb_reload_file_changed(&reload, now_us += CB_RELOAD_LOOK_US); }
    // How many looks it takes; 9: it never counts as changed.
    int looks() {
        for (int n = 1; n < 9; ++n)
            if (look()) return n;
        return 9;
    }
    fs::path folder;
    std::string path;
    cb_reload reload;
    int64_t now_us = 1000000000;
};

TEST_F(reload_file, that_stays_is_never_read_again) {
    start();
    EXPECT_EQ(looks(), 9);
}

TEST_F(reload_file, is_looked_at_once_a_second) {
    start();
    EXPECT_FALSE(look());
    write(path, "another one");
    EXPECT_FALSE(look()) << "it may still be changing";
    EXPECT_FALSE(cb_reload_file_changed(&reload, now_us + CB_RELOAD_LOOK_US - 1));
    EXPECT_TRUE(look());
}

TEST_F(reload_file, renamed_over_is_seen_also_with_the_old_ones_size_and_time) {
    start();
    const auto time = fs::last_write_time(path);
    write(folder / "new", "other");
    fs::last_write_time(folder / "new", time);
    fs::rename(folder / "new", path);
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_grows_is_read_when_it_stopped) {
    start();
    std::ofstream file(path, std::ios::trunc);
    for (int i = 0; i < 4; ++i) {
        file << "piece" << std::flush;
        EXPECT_FALSE(look()) << i;
    }
    EXPECT_TRUE(look());
}

TEST_F(reload_file, written_in_place_with_the_same_size_and_time_is_seen) {
    start();
    const auto time = fs::last_write_time(path);
    usleep(20000);  // the kernel's clock of files is that coarse
    write(path, "other");
    fs::last_write_time(path, time);
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, touched_is_read) {
    start();
    usleep(20000);
    ASSERT_EQ(utimensat(AT_FDCWD, path.c_str(), nullptr, 0), 0);
    EXPECT_EQ(looks(), 2);
}

// As Kubernetes does it: c.json -> ..data/c.json, ..data -> a folder; ..data is replaced.
TEST_F(reload_file, behind_a_link_to_a_folder_that_is_replaced_is_seen) {
    for (const char *version : {"v1", "v2"}) {
        fs::create_directories(folder / version);
        write(folder / version / "c.json", "first");
    }
    fs::create_directory_symlink("v1", folder / "data");
    fs::remove(path);
    fs::create_symlink("data/c.json", path);
    start();
    EXPECT_EQ(looks(), 9);
    fs::create_directory_symlink("v2", folder / "data.new");
    fs::rename(folder / "data.new", folder / "data");
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_is_away_did_not_change_and_another_in_its_place_did) {
    start();
    fs::remove(path);
    EXPECT_EQ(looks(), 9);
    write(path, "second");
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_was_not_there_at_the_start_is_read_when_it_comes) {
    fs::remove(path);
    start();
    EXPECT_EQ(looks(), 9);
    write(path, "first");
    EXPECT_EQ(looks(), 2);
}

void *nothing(void *) {
    return nullptr;
}

TEST(realtime, a_processor_that_is_not_there_starts_no_thread) {
    pthread_t thread;
    const cb_schedule schedule = {0, CPU_SETSIZE - 1};
    EXPECT_EQ(cb_start_thread(&thread, &schedule, nothing, nullptr), EINVAL);
}

}  // namespace
