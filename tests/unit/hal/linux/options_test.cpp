// SPDX-License-Identifier: MIT
// What tests/daemon/test_options.py cannot make: files on two disks.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/daemon/options.h"
}

namespace {

cb_options_result parsed(std::vector<std::string> words) {
    std::vector<char *> argv;
    words.insert(words.begin(), "compboxd");
    for (std::string &word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    cb_options options;
    return cb_options_parse(&options, static_cast<int>(words.size()), argv.data());
}

TEST(options, files_on_two_disks_are_two_files_and_a_link_to_one_is_not) {
    const std::string config = compbox_test::temporary("options.json"), other = "/proc/version";
    const std::string link = compbox_test::temporary("options-link.json");
    std::ofstream(config) << "{}";
    std::ofstream(link + ".2") << "{}";
    struct stat one, two;
    ASSERT_EQ(stat(config.c_str(), &one), 0);
    ASSERT_EQ(stat(other.c_str(), &two), 0);
    ASSERT_TRUE(S_ISREG(two.st_mode) && one.st_dev != two.st_dev);
    EXPECT_EQ(parsed({"--config", config, "--stats", other}), CB_OPTIONS_RUN);
    EXPECT_EQ(parsed({"--config", config, "--state", other}), CB_OPTIONS_RUN);
    EXPECT_EQ(parsed({"--config", config, "--stats", link + ".2"}), CB_OPTIONS_RUN);
    ASSERT_EQ(::link(config.c_str(), link.c_str()), 0);
    EXPECT_EQ(parsed({"--config", config, "--stats", link}), CB_OPTIONS_WRONG);
}

TEST(options, a_number_beyond_64_bits_is_refused) {
    const std::vector<std::string> words = {"--config", "c.json", "--cycles"};
    for (const std::string number : {"18446744073709551616", "99999999999999999999999"}) {
        std::vector<std::string> all = words;
        all.push_back(number);
        EXPECT_EQ(parsed(all), CB_OPTIONS_WRONG) << number;
    }
}

}  // namespace
