// SPDX-License-Identifier: MIT
#include "tests/world/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>

namespace compbox::world {
namespace {

struct disk {
    file_tree tree{[] { return time_ns{0}; }};
    disk() { tree.make_folder("/d"); }
    std::shared_ptr<open_file> open(const std::string &path, int flags) {
        std::shared_ptr<open_file> file;
        EXPECT_EQ(tree.open(path, flags, &file), 0);
        return file;
    }
    void write(const std::string &path, const std::string &text, bool synchronised) {
        const auto file = open(path, O_WRONLY | O_CREAT | O_TRUNC);
        EXPECT_EQ(file->write(text.data(), text.size()), static_cast<long>(text.size()));
        if (synchronised) {
            EXPECT_EQ(file->sync(), 0);
        }
    }
};

TEST(files, what_is_synchronised_with_its_folder_survives_a_power_cut) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        disk of;
        dice chance(seed, "test");
        of.write("/d/a", "whole", true);
        of.open("/d", O_RDONLY | O_DIRECTORY)->sync();
        of.tree.cut_power(chance);
        EXPECT_EQ(of.tree.text("/d/a"), "whole");
    }
}

TEST(files, a_power_cut_keeps_or_loses_or_tears_what_is_not_synchronised) {
    bool kept = false, lost = false, torn = false, unnamed = false;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        disk of;
        dice chance(seed, "test");
        of.write("/d/a", "old", true);
        of.open("/d", O_RDONLY | O_DIRECTORY)->sync();
        of.write("/d/a", "newer", false);
        of.write("/d/b", "b", true);
        of.tree.cut_power(chance);
        const std::string text = of.tree.text("/d/a");
        kept = kept || text == "newer";
        lost = lost || text == "old";
        torn = torn || (text != "newer" && text != "old");
        unnamed = unnamed || !of.tree.has("/d/b");
    }
    EXPECT_TRUE(kept && lost && torn && unnamed);
}

TEST(files, a_full_disk_takes_what_there_is_room_for) {
    disk of;
    of.tree.capacity_bytes = 3;
    const auto file = of.open("/d/a", O_WRONLY | O_CREAT);
    EXPECT_EQ(file->write("12345", 5), 3);
    EXPECT_EQ(file->write("45", 2), -ENOSPC);
    EXPECT_EQ(of.tree.unlink("/d/a"), 0);
    EXPECT_EQ(of.tree.used_bytes(), 0);
}

TEST(files, links_are_followed_unless_the_caller_forbids_it) {
    disk of;
    of.write("/d/a", "text", true);
    of.tree.make_link("/d/link", "/d/a");
    std::shared_ptr<open_file> file;
    EXPECT_EQ(of.tree.open("/d/link", O_RDONLY | O_NOFOLLOW, &file), -ELOOP);
    EXPECT_EQ(of.tree.open("/d/link", O_RDONLY, &file), 0);
    EXPECT_EQ(of.tree.open("/d/none", O_RDONLY, &file), -ENOENT);
    EXPECT_EQ(of.tree.open("/d/a", O_WRONLY | O_CREAT | O_EXCL, &file), -EEXIST);
}

}  // namespace
}  // namespace compbox::world
