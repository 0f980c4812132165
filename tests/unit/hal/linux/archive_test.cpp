// SPDX-License-Identifier: MIT
// What is kept of a file: compressed with the same content, within a limit, and never lost.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/files/archive.h"
#include "hal/linux/files/compress.h"
}

namespace {

namespace fs = std::filesystem;

std::string content(const std::string &path) {
    std::ifstream in(path);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

// Content of a compressed or a plain file.
std::string unpacked(const std::string &path) {
    const gzFile file = gzopen(path.c_str(), "rb");
    std::string all(4 << 20, ' ');
    const int bytes = gzread(file, all.data(), static_cast<unsigned>(all.size()));
    EXPECT_EQ(gzclose(file), Z_OK);
    all.resize(bytes < 0 ? 0 : static_cast<std::size_t>(bytes));
    return all;
}

struct archive : testing::Test {
    std::string folder = compbox_test::temporary("archive");
    std::string path = folder + "/f";
    cb_archive of{};

    archive() {
        fs::remove_all(folder);
        fs::create_directory(folder);
    }
    void start(int64_t most_bytes) { cb_archive_start(&of, path.c_str(), most_bytes); }
    void put(const std::string &end, const std::string &text) const {
        std::ofstream(path + end) << text;
    }
    void work() {
        for (int i = 0; i < 1000 && of.number != 0; ++i) cb_archive_work(&of);
    }
    // Lines that differ.
    static std::string lines(std::size_t bytes) {
        std::string text;
        for (unsigned i = 1; text.size() < bytes; ++i)
            text += std::to_string(i * 2654435761u) + "\n";
        return text;
    }
    // A path of so many letters, in the folder.
    std::string long_path(std::size_t letters) const {
        std::string long_one = folder;
        while (long_one.size() + 256 < letters) {
            long_one += "/" + std::string(200, 'd');
            fs::create_directory(long_one);
        }
        return long_one + "/" + std::string(letters - long_one.size() - 1, 'f');
    }
    std::uintmax_t all_bytes() const {
        std::uintmax_t all = 0;
        for (const auto &entry : fs::directory_iterator(folder)) all += entry.file_size();
        return all;
    }
};

TEST_F(archive, what_is_kept_is_compressed_with_the_same_content) {
    const std::string text = lines(10 * CB_COMPRESS_SLICE + 17);
    start(10 << 20);
    put("", text);
    EXPECT_EQ(cb_archive_keep(&of), 0);
    EXPECT_EQ(content(path + ".1"), text);
    work();
    EXPECT_EQ(of.error, 0);
    EXPECT_FALSE(fs::exists(path + ".1"));
    EXPECT_EQ(unpacked(path + ".1.gz"), text);
    EXPECT_LT(fs::file_size(path + ".1.gz"), text.size() * 6 / 10);
}

TEST_F(archive, an_empty_file_and_one_of_a_slice_are_whole) {
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{CB_COMPRESS_SLICE}}) {
        start(1 << 20);
        put("", std::string(bytes, 'x'));
        EXPECT_EQ(cb_archive_keep(&of), 0);
        work();
        EXPECT_EQ(unpacked(path + ".1.gz"), std::string(bytes, 'x'));
    }
}

TEST_F(archive, the_oldest_are_removed_within_the_limit) {
    start(800000);
    EXPECT_EQ(cb_archive_piece(&of), 100000);
    for (int i = 0; i < 60; ++i) {
        put("", std::to_string(i) + "\n" + lines(99000));
        EXPECT_LE(all_bytes(), 800000u) << i;
        EXPECT_EQ(cb_archive_keep(&of), 0);
        EXPECT_LE(all_bytes(), 600000u) << i << ": room for the next file and its compression";
        while (of.number != 0) {
            cb_archive_work(&of);
            EXPECT_LE(all_bytes(), 700000u) << i;
        }
    }
    int n = 1;
    for (; fs::exists(path + "." + std::to_string(n) + ".gz"); ++n)
        EXPECT_EQ(unpacked(path + "." + std::to_string(n) + ".gz").substr(0, 3),
                  std::to_string(60 - n) + "\n");
    EXPECT_GT(n, 8);
}

TEST_F(archive, the_newest_stays_even_if_it_alone_is_larger_than_the_limit) {
    start(80000);
    put("", lines(1000000));
    put(".1", "old");
    EXPECT_EQ(cb_archive_keep(&of), 0);
    EXPECT_EQ(content(path + ".1").size(), lines(1000000).size());
    EXPECT_FALSE(fs::exists(path + ".2"));
}

TEST_F(archive, a_start_goes_on_behind_a_crash) {
    put(".gz.new", "half");
    put(".1", "one"), put(".2", "two"), put(".2.gz", "whole"), put(".3", "three");
    start(1 << 20);
    EXPECT_FALSE(fs::exists(path + ".gz.new"));
    work();
    EXPECT_EQ(unpacked(path + ".1.gz"), "one");
    EXPECT_EQ(content(path + ".2.gz"), "whole");
    EXPECT_EQ(unpacked(path + ".3.gz"), "three");
    for (const char *end : {".1", ".2", ".3"}) EXPECT_FALSE(fs::exists(path + end));
}

TEST_F(archive, a_file_that_is_kept_meanwhile_ends_a_compression) {
    start(10 << 20);
    put("", lines(5 * CB_COMPRESS_SLICE));
    EXPECT_EQ(cb_archive_keep(&of), 0);
    cb_archive_work(&of), cb_archive_work(&of);
    EXPECT_TRUE(fs::exists(path + ".gz.new"));
    put("", "next");
    EXPECT_EQ(cb_archive_keep(&of), 0);
    EXPECT_FALSE(fs::exists(path + ".gz.new"));
    work();
    EXPECT_EQ(unpacked(path + ".1.gz"), "next");
    EXPECT_EQ(unpacked(path + ".2.gz"), lines(5 * CB_COMPRESS_SLICE));
}

TEST_F(archive, an_end_leaves_the_plain_file) {
    start(10 << 20);
    put("", lines(5 * CB_COMPRESS_SLICE));
    EXPECT_EQ(cb_archive_keep(&of), 0);
    cb_archive_work(&of), cb_archive_work(&of);
    cb_archive_finish(&of);
    EXPECT_FALSE(fs::exists(path + ".gz.new"));
    EXPECT_EQ(content(path + ".1"), lines(5 * CB_COMPRESS_SLICE));
}

TEST_F(archive, a_full_disk_leaves_the_plain_file) {
    start(10 << 20);
    put("", lines(5 * CB_COMPRESS_SLICE));
    EXPECT_EQ(cb_archive_keep(&of), 0);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1000, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    work();
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(of.error, EFBIG);
    EXPECT_EQ(content(path + ".1"), lines(5 * CB_COMPRESS_SLICE));
    EXPECT_FALSE(fs::exists(path + ".gz.new") || fs::exists(path + ".1.gz"));
    put("", "next");
    EXPECT_EQ(cb_archive_keep(&of), 0);
    work();
    EXPECT_EQ(of.error, 0);
    EXPECT_EQ(unpacked(path + ".2.gz"), lines(5 * CB_COMPRESS_SLICE));
}

TEST_F(archive, what_cannot_be_begun_leaves_the_plain_file) {
    start(10 << 20);
    put("", "text");
    EXPECT_EQ(cb_archive_keep(&of), 0);
    fs::create_directory(path + ".gz.new");
    work();
    EXPECT_EQ(of.error, EISDIR);
    EXPECT_EQ(content(path + ".1"), "text");
}

// PATH.gz.new does not fit. Of the longest path it would be cut to PATH.
TEST_F(archive, a_path_that_is_too_long_is_left_alone) {
    const std::size_t longest = CB_ROTATE_NAME - 1;
    for (const std::size_t letters : {longest, longest - 6}) {
        path = long_path(letters);
        put("", "text");
        start(1 << 20);
        EXPECT_EQ(of.number, 0u);
        EXPECT_EQ(cb_archive_keep(&of), ENAMETOOLONG);
        work();
        EXPECT_EQ(content(path), "text");
    }
    path = long_path(longest - 7);
    put("", "text");
    start(1 << 20);
    EXPECT_EQ(cb_archive_keep(&of), 0);
    work();
    EXPECT_EQ(unpacked(path + ".1.gz"), "text");
}

TEST_F(archive, without_a_limit_nothing_is_removed_or_compressed) {
    start(0);
    EXPECT_EQ(cb_archive_piece(&of), INT64_MAX);
    for (int i = 0; i < 20; ++i) {
        put("", std::to_string(i));
        EXPECT_EQ(cb_archive_keep(&of), 0);
        cb_archive_work(&of);
    }
    EXPECT_EQ(content(path + ".20"), "0");
}

TEST_F(archive, a_folder_in_the_place_of_an_old_file_is_reported) {
    fs::create_directory(path + ".1");
    start(1 << 20);
    work();
    EXPECT_EQ(of.error, EISDIR);
    EXPECT_TRUE(fs::is_directory(path + ".1"));
}

}  // namespace
