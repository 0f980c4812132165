// SPDX-License-Identifier: MIT
// Measurements by hand: what the file may be, what counts as a measurement, what the box gets.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/config_fixture.h"
#include "tests/support/short_reads.h"
#include "tests/support/temporary.h"

extern "C" {
#include "firmware/config/config.h"
#include "hal/linux/hand.h"
}

namespace {

namespace fs = std::filesystem;
constexpr int64_t now_unix_s = 1790000000;

struct Hand : ::testing::Test {
    Hand() : config(std::make_unique<cb_config>()) {
        path = compbox_test::temporary("measured");
        fs::remove_all(path);
        add("probe_x", "X", CB_HAND_VALUE);
        add("probe_x_n", "X", CB_HAND_COUNT);
        cb_sample_ring_start(&ring);
        start();
    }
    void add(const char *name, const char *axis, uint8_t part) {
        cb_signal_config &signal = config->signals[config->signals_count++];
        std::snprintf(signal.name, sizeof signal.name, "%s", name);
        signal.source = CB_SOURCE_HAND;
        signal.can_id = cb_hand_key(axis);
        signal.bus = part;
    }
    void start() {
        cb_hand_start(&hand, path.c_str(), geteuid());
        cb_hand_follow(&hand, config.get());
    }
    // As compbox measured does.
    void replace(const std::string &text) {
        std::ofstream(path + ".new") << text;
        fs::rename(path + ".new", path);
    }
    // out: the sentence of a look, half a second after the one before; "" if there is none
    std::string look() {
        char message[512] = "";
        now_us += CB_HAND_LOOK_US;
        const bool any = cb_hand_look(&hand, config.get(), now_us, now_unix_s * 1000000, message,
                                      sizeof message);
        EXPECT_EQ(any, message[0] != '\0');
        return message;
    }
    // out: the samples that the box gets
    std::vector<cb_sample> samples() {
        cb_sample list[CB_MAX_SAMPLES];
        cb_hand_put(&hand, config.get(), 7, &ring, now_us);
        const std::size_t count = cb_sample_ring_take(&ring, 7, list, CB_MAX_SAMPLES);
        return {list, list + count};
    }
    std::unique_ptr<cb_config> config;
    cb_hand hand;
    cb_sample_ring ring;
    std::string path;
    int64_t now_us = 1000000000;
};

TEST_F(Hand, NothingIsMeasuredBeforeAPersonDoes) {
    EXPECT_EQ(look(), "");
    const auto got = samples();
    ASSERT_EQ(got.size(), 2u);
    EXPECT_EQ(got[0].signal, 0);
    EXPECT_EQ(got[0].raw, 0.0f);
    EXPECT_EQ(got[1].raw, 0.0f) << "the count that the first measurement is compared with";
    EXPECT_EQ(got[1].time_us, now_us);
}

TEST_F(Hand, ALineIsOneMeasurement) {
    look();
    samples();
    replace("X 4.2 1 1790000000\n");
    EXPECT_EQ(look(), "measured by hand: X 4.2 um is taken");
    auto got = samples();
    ASSERT_EQ(got.size(), 2u) << "at once";
    EXPECT_EQ(got[0].raw, 4.2f);
    EXPECT_EQ(got[1].raw, 1.0f);
    EXPECT_TRUE(samples().empty());
    EXPECT_EQ(look(), "");
    got = samples();
    ASSERT_EQ(got.size(), 2u) << "twice a second, so that they stay fresh";
    EXPECT_EQ(got[1].raw, 1.0f);
    replace("X 4.2 1 1790000000\n");
    EXPECT_EQ(look(), "") << "another file with the same line";
    replace("X 4.2 2 1790000000\n");
    EXPECT_NE(look(), "") << "the same value again";
    EXPECT_EQ(samples()[1].raw, 2.0f);
    replace("X 4.3 2 1790000001\n");
    EXPECT_NE(look(), "") << "the same count at another time";
    EXPECT_EQ(samples()[1].raw, 3.0f);
}

// A count tells the box that there is another value.
TEST_F(Hand, ACountComesBehindItsValueWhateverTheOrderOfTheSignals) {
    std::swap(config->signals[0], config->signals[1]);
    const auto got = samples();
    ASSERT_EQ(got.size(), 2u);
    EXPECT_EQ(got[0].signal, 1) << "the value";
    EXPECT_EQ(got[1].signal, 0);
}

TEST_F(Hand, ACountWhoseValueFindsNoRoomWaitsForIt) {
    std::swap(config->signals[0], config->signals[1]);
    for (int i = 1; i < CB_RING_SAMPLES; ++i) cb_sample_ring_put(&ring, {9, 0.0f, 0}, 7);
    cb_hand_put(&hand, config.get(), 7, &ring, now_us);
    cb_sample list[CB_RING_SAMPLES];
    ASSERT_EQ(cb_sample_ring_take(&ring, 7, list, CB_RING_SAMPLES), std::size_t{CB_RING_SAMPLES});
    EXPECT_EQ(list[CB_RING_SAMPLES - 1].signal, 1) << "the value";
}

TEST_F(Hand, AFileThatComesInPartsIsWhole) {
    look();
    replace("X 4.2 1 1790000000\n");
    short_reads::most = 5;
    EXPECT_EQ(look(), "measured by hand: X 4.2 um is taken");
    short_reads::most = SIZE_MAX;
}

TEST_F(Hand, WhatTheFileHasAtTheStartIsNoMeasurement) {
    replace("X 4.2 1 1790000000\n");
    EXPECT_EQ(look(), "");
    EXPECT_EQ(samples()[1].raw, 0.0f);
    replace("X 5 2 1790000000\n");
    EXPECT_NE(look(), "");
    EXPECT_EQ(samples()[0].raw, 5.0f);
}

TEST_F(Hand, AnotherNameIsKeptApart) {
    add("probe_z", "Z", CB_HAND_VALUE);
    start();
    look();
    replace("X 4.2 1 1790000000\nZ -3.5 1 1790000000\n");
    EXPECT_EQ(look(), "measured by hand: X 4.2 um is taken; measured by hand: Z -3.5 um is taken");
    const auto got = samples();
    ASSERT_EQ(got.size(), 3u);
    EXPECT_EQ(got[1].raw, -3.5f);
    replace("X 4.2 1 1790000000\nQ 1 1 1790000000\n");
    EXPECT_EQ(
        look(),
        "measured by hand: Q 1 um is refused: no signal of the file has this name under hand");
}

TEST_F(Hand, AnOldOneAndOneFromTheFutureAreRefusedOnce) {
    look();
    replace("X 4 1 1789999700\n");
    EXPECT_EQ(look(), "measured by hand: X 4 um is taken") << "five minutes";
    replace("X 5 2 1789999699\n");
    EXPECT_EQ(look(),
              "measured by hand: X 5 um is refused: it is older than 5 minutes; measure again");
    replace("X 6 3 1790000061\n");
    EXPECT_EQ(look(), "measured by hand: X 6 um is refused: it is from the future by the clock");
    replace("X 6 3 1790000061\n");
    EXPECT_EQ(look(), "");
    const auto got = samples();
    EXPECT_EQ(got[0].raw, 4.0f);
    EXPECT_EQ(got[1].raw, 1.0f);
}

TEST_F(Hand, AWrongLineRefusesTheWholeFile) {
    look();
    for (const char *line :
         {"X", "X 4", "X 4 1", "X 4 1 2 3", "X nan 1 1790000000", "X 0x10 1 1790000000",
          "X inf 1 1790000000", "X 1e7 1 1790000000", "X 4 65536 1790000000", "X 4 -1 1790000000",
          "X 4 1.5 1790000000", "XXXXX 4 1 1790000000", " ", "X 4 1 17900000000000",
          "X 4um 1 1790000000", "X,4,1,1790000000", "X 4-1 1 1790000000", "X 1e39 1 1790000000",
          "X 4 1 00000000000000000000000000000000001790000000"}) {
        replace("X 9 8 1790000000\n" + std::string(line) + "\n");
        EXPECT_EQ(look(), path +
                              ": line 2 is not NAME UM COUNT TIME; nothing of it is taken: use "
                              "compbox measured")
            << line;
    }
    EXPECT_EQ(samples()[1].raw, 0.0f);
    std::string many;
    for (int i = 0; i < 17; ++i) many += "A" + std::to_string(i) + " 1 1 1790000000\n";
    replace(many);
    EXPECT_NE(look().find("line 17 is not"), std::string::npos);
}

TEST_F(Hand, AFileThatIsNoFileIsRefused) {
    look();
    fs::create_directory(path);
    EXPECT_EQ(look(), path + ": is not a regular file, so no measurement is taken");
    EXPECT_EQ(look(), "") << "once";
    fs::remove(path);
    std::ofstream(path + ".real") << "X 4 1 1790000000\n";
    fs::create_symlink(path + ".real", path);
    EXPECT_EQ(look(), path + ": cannot be read, so no measurement is taken");
    fs::remove(path + ".real");
    replace(std::string(CB_HAND_BYTES + 1, 'X'));
    EXPECT_EQ(look(), path + ": is too long, so no measurement is taken");
    EXPECT_EQ(samples()[1].raw, 0.0f);
}

// Files whose size does not tell what can be read of them.
TEST_F(Hand, AFileThatCannotBeReadOrGrowsMeanwhileIsRefused) {
    for (const char *file : {"/proc/self/mem", "/proc/self/maps"}) {
        path = file;
        start();
        EXPECT_EQ(look(), path + ": cannot be read, so no measurement is taken");
    }
}

TEST_F(Hand, TheOwnerIsThisUserOrRoot) {
    struct stat file = {};
    file.st_mode = S_IFREG | 0644;
    file.st_uid = 1000;
    EXPECT_EQ(cb_hand_fault(&file, 1000), nullptr);
    EXPECT_STREQ(cb_hand_fault(&file, 1001), "belongs to another user");
    file.st_uid = 0;
    EXPECT_EQ(cb_hand_fault(&file, 1001), nullptr);
    for (const mode_t bit : {mode_t{S_IWGRP}, mode_t{S_IWOTH}}) {
        file.st_mode = S_IFREG | 0644 | bit;
        EXPECT_STREQ(cb_hand_fault(&file, 1000), "can be written by other users");
    }
    for (const mode_t kind : {mode_t{S_IFIFO}, mode_t{S_IFDIR}, mode_t{S_IFLNK}, mode_t{S_IFCHR}}) {
        file.st_mode = kind | 0600;
        EXPECT_STREQ(cb_hand_fault(&file, 1000), "is not a regular file");
    }
}

TEST_F(Hand, AFileWithoutSuchSignalsIsLeftAlone) {
    config->signals_count = 0;
    start();
    replace("X 4 1 1790000000\n");
    EXPECT_EQ(look(), "");
    EXPECT_TRUE(samples().empty());
}

TEST_F(Hand, ACountGoesOnWithAnotherCoefficientFile) {
    look();
    replace("X 4 1 1790000000\n");
    look();
    config->signals[0].can_id = cb_hand_key("Z");
    cb_hand_follow(&hand, config.get());
    const auto got = samples();
    ASSERT_EQ(got.size(), 2u);
    EXPECT_EQ(got[0].raw, 0.0f);
    EXPECT_EQ(got[1].raw, 1.0f);
}

TEST_F(Hand, TheCountWraps) {
    look();
    hand.measured[0] = {{cb_hand_key("X"), 0.0f, 9, 1}, 0.0f, 65535};
    hand.names = 1;
    replace("X 4 10 1790000000\n");
    EXPECT_NE(look(), "");
    EXPECT_EQ(samples()[1].raw, 0.0f);
}

}  // namespace
