// SPDX-License-Identifier: MIT
// Files that are kept beside the one that is written: none is lost before the last number.
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/files/rotate.h"
}

namespace {

namespace fs = std::filesystem;

struct rotate : testing::Test {
    std::string folder = compbox_test::temporary("rotated");
    std::string path = folder + "/f";

    rotate() {
        fs::remove_all(folder);
        fs::create_directory(folder);
    }
    void put(const std::string &end, const std::string &text) const {
        std::ofstream(path + end) << text;
    }
    std::string all() const {
        std::string found;
        for (const char *end : {"", ".1", ".1.gz", ".2", ".2.gz", ".3", ".3.gz", ".4", ".5"}) {
            std::ifstream in(path + end);
            std::ostringstream text;
            text << in.rdbuf();
            if (in.good()) found += std::string(end) + "=" + text.str() + " ";
        }
        return found;
    }
};

TEST_F(rotate, each_file_gets_the_next_number) {
    put("", "now"), put(".1", "b"), put(".2.gz", "a");
    EXPECT_EQ(cb_rotate(path.c_str(), 9, false), 0);
    EXPECT_EQ(all(), ".1=now .2=b .3.gz=a ");
}

TEST_F(rotate, a_free_number_ends_it) {
    put("", "now"), put(".1", "b"), put(".3", "a");
    EXPECT_EQ(cb_rotate(path.c_str(), 9, false), 0);
    EXPECT_EQ(all(), ".1=now .2=b .3=a ");
}

TEST_F(rotate, both_forms_of_a_number_stay_together) {
    put("", "now"), put(".1", "b"), put(".1.gz", "B");
    EXPECT_EQ(cb_rotate(path.c_str(), 9, false), 0);
    EXPECT_EQ(all(), ".1=now .2=b .2.gz=B ");
}

TEST_F(rotate, the_last_number_is_removed_only_where_it_may_be) {
    put("", "now"), put(".1", "b"), put(".2.gz", "a");
    EXPECT_EQ(cb_rotate(path.c_str(), 2, false), EEXIST);
    EXPECT_EQ(all(), "=now .1=b .2.gz=a ");
    EXPECT_EQ(cb_rotate(path.c_str(), 2, true), 0);
    EXPECT_EQ(all(), ".1=now .2=b ");
}

TEST_F(rotate, a_last_number_that_cannot_be_removed_changes_nothing) {
    put("", "now"), put(".1", "b");
    fs::create_directory(path + ".2");
    EXPECT_EQ(cb_rotate(path.c_str(), 2, true), EISDIR);
    EXPECT_EQ(all(), "=now .1=b .2= ") << "the folder too";
}

TEST_F(rotate, a_removed_file_leaves_its_number_free) {
    put(".1", "b"), put(".2.gz", "a");
    EXPECT_EQ(cb_rotate(path.c_str(), 9, false), 0);
    EXPECT_EQ(all(), ".2=b .3.gz=a ");
}

TEST_F(rotate, a_name_that_is_too_long_changes_nothing) {
    const std::string longest = folder + "/" + std::string(4090, 'x');
    EXPECT_EQ(cb_rotate(longest.c_str(), 9, true), ENAMETOOLONG);
}

}  // namespace
