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

// in : words stay as long as *options is used
cb_options_result parsed(std::vector<std::string> &words, cb_options *options) {
    std::vector<char *> argv;
    words.insert(words.begin(), "compboxd");
    for (std::string &word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    return cb_options_parse(options, static_cast<int>(words.size()), argv.data());
}

cb_options_result parsed(std::vector<std::string> words) {
    cb_options options;
    return parsed(words, &options);
}

TEST(options, each_value_goes_into_its_field) {
    cb_options o;
    std::vector<std::string> words = {"--config=c",        "--check",
                                      "--most-um=300",     "--most-um-per-s=0.5",
                                      "--allow-older",     "--cycles=1000000000000",
                                      "--snapshot=n",      "--snapshot-every=100",
                                      "--events=e",        "--stats=s",
                                      "--record=r",        "--record-every=3600000",
                                      "--record-most=7",   "--blackbox=b",
                                      "--blackbox-most=8", "--record-inputs=i",
                                      "--state=m",         "--state-every=9",
                                      "--priority=99",     "--cpu-latency=off",
                                      "--cpu=0",           "--clock=boottime",
                                      "--watchdog=w",      "--watchdog-timeout=60"};
    ASSERT_EQ(parsed(words, &o), CB_OPTIONS_RUN);
    EXPECT_EQ(std::string(o.config) + o.snapshot + o.events + o.stats + o.record + o.blackbox +
                  o.inputs + o.state + o.watchdog,
              "cnesrbimw");
    EXPECT_TRUE(o.check && o.allow_older && !o.cpu_latency);
    EXPECT_EQ(o.site.ceiling.um, 300.0f);
    EXPECT_EQ(o.site.ceiling.um_per_s, 0.5f);
    EXPECT_EQ(o.cycles, 1000000000000u);
    EXPECT_EQ((std::vector<int>{o.snapshot_every_ms, o.record_every_ms, o.record_most_mb,
                                o.blackbox_most_mb, o.state_every_s, o.priority, o.cpu,
                                o.watchdog_timeout_s}),
              (std::vector<int>{100, 3600000, 7, 8, 9, 99, 0, 60}));
    EXPECT_EQ(o.clock, CLOCK_BOOTTIME);
}

TEST(options, help_and_version_are_printed_and_end_it) {
    const auto printed = [](const std::string &word) {
        testing::internal::CaptureStdout();
        EXPECT_EQ(parsed({word, "--unknown"}), CB_OPTIONS_DONE);
        return testing::internal::GetCapturedStdout();
    };
    EXPECT_NE(printed("--help").find("usage: compboxd --config FILE [options]\n"),
              std::string::npos);
    EXPECT_EQ(printed("--version").rfind("compboxd 0.", 0), 0u);
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
