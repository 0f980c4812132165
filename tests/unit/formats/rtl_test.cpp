// SPDX-License-Identifier: MIT
// Laser files: written by hand, round trip, broken in every way, cut at every byte.
#include "host-tools/formats/rtl.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "host-tools/formats/error.h"
#include "host-tools/formats/table_text.h"
#include "tests/support/cases.h"
#include "tests/support/temporary.h"

namespace {

using namespace compbox;
using namespace compbox::formats;

const char *const by_hand =
    "HEADER::\r\nFile Type: Linear\r\nTARGET DATA::\r\nFiletype : ISO\r\nTarget-count: 3\r\n"
    "Targets :\r\n 0.00000 100.00000 200.00000\r\nFlags: 0 0 0\r\nUSER-TEXT::\r\nMachine:gantry\r\n"
    "Serial No:7\r\nDate:2026-01-02\r\nBy:me\r\nAxis:X\r\nLocation:hall\r\nTITLE:EXX\r\n"
    "RUNS::\r\nRun-count: 2\r\nDEVIATIONS::\r\nRun Target Data:\r\n"
    "1 1 0.1\r\n1 2 -1.5\r\n1 3 2.25\r\n2 3 2.5\r\n2 2 -1\r\n2 1 0\r\n"
    "ENVIRONMENT::\r\nanything: 20\r\nEOF::\r\n";

std::string laser_path(const std::string &ending = ".rtl") {
    return compbox_test::temporary("figures" + ending);
}

// Without write_file, which syncs: thousands of broken files need not survive a power cut.
laser_file parse(const std::string &text, const std::string &ending = ".rtl") {
    std::ofstream(laser_path(ending), std::ios::binary) << text;
    return read_laser_text(laser_path(ending), read_table_text(laser_path(ending)));
}

std::string message_of(const std::string &text) {
    try {
        parse(text);
    } catch (const input_error &error) {
        const std::string what = error.what();
        return what.substr(what.find(".rtl:") + 5);
    }
    return "no error";
}

std::string with(const std::string &from, const std::string &to) {
    std::string text = by_hand;
    return text.replace(text.find(from), from.size(), to);
}

TEST(rtl, reads_a_file_written_by_hand) {
    const auto file = parse(by_hand);
    EXPECT_EQ(file.targets_mm, (std::vector<double>{0, 100, 200}));
    EXPECT_EQ(file.machine, "gantry");
    EXPECT_EQ(file.axis, "X");
    EXPECT_EQ(file.title, "EXX");
    ASSERT_EQ(file.runs.size(), 2u);
    EXPECT_EQ(file.runs[0].direction, 1);
    EXPECT_EQ(file.runs[1].direction, -1);
    EXPECT_TRUE(file.bidirectional);
    EXPECT_EQ(file.runs[1].target, (std::vector<std::size_t>{2, 1, 0}));
    EXPECT_EQ(file.runs[1].deviation, (std::vector<double>{2.5, -1, 0}));
    EXPECT_EQ(file.runs[1].line[0], 24);
}

TEST(rtl, the_environment_is_read_where_an_instrument_measured_it) {
    const auto file = parse(with("anything: 20\r\n",
                                 "Air temp   : 20.337280 20.384956 0\r\n"
                                 "Air press  : 99.039005 99.049346 1\r\n"
                                 "Air humid  : 46.954897 46.893887\r\n"
                                 "Mat temp 1 : 20.203292 20.321342 0\r\n"
                                 "Mat temp 2 : -10.000000 -10.000000 0\r\n"
                                 "Exp coeff  : 8.000000 8.000000 0\r\n"
                                 "Date Time  : \"10:46 Dec 12 2016\" \"11:01 Dec 12 2016\"\r\n"));
    ASSERT_TRUE(file.environment);
    EXPECT_DOUBLE_EQ(file.environment->air_degC->end, 20.384956);
    ASSERT_EQ(file.environment->material_degC.size(), 1u);
    EXPECT_TRUE(file.environment->material_compensated());
    EXPECT_EQ(file.environment->times, "10:46 Dec 12 2016 11:01 Dec 12 2016");
    EXPECT_EQ(environment_text(*file.environment),
              "air 20.3 to 20.4 °C, 99.0 kPa, 47.0 to 46.9 % humidity, material 20.2 to 20.3 °C, "
              "readings converted to 20 °C by 8 um/m per K");
}

TEST(rtl, without_an_expansion_coefficient_nothing_was_compensated) {
    for (const char *line :
         {"Exp coeff : 0.000000 0.000000 0\r\n", "Mat temp 1 : 20 20 0\r\n", ""}) {
        const auto file = parse(with("anything: 20\r\n", line));
        ASSERT_TRUE(file.environment.has_value() == !std::string(line).empty());
        if (!file.environment) continue;
        EXPECT_FALSE(file.environment->material_compensated());
    }
}

TEST(rtl, angles_are_milliradians_in_the_file) {
    const auto file = parse(with("Type: Linear", "Type: Angular"), ".rta");
    EXPECT_TRUE(file.angular);
    EXPECT_DOUBLE_EQ(file.runs[0].deviation[1], -1500.0);
}

TEST(rtl, round_trip) {
    std::mt19937 random(3);
    std::uniform_int_distribution<int> micro(-2000000, 2000000);
    for (const bool angular : {false, true}) {
        laser_file file;
        file.angular = angular;
        file.title = "café 定位";
        for (int i = 0; i < 61; ++i) file.targets_mm.push_back(240.0 * i - 0.12345);
        for (int run = 0; run < 6; ++run) {
            laser_run readings;
            for (std::size_t i = 0; i < file.targets_mm.size(); ++i) {
                readings.target.push_back(run % 2 ? file.targets_mm.size() - 1 - i : i);
                readings.deviation.push_back(micro(random) / 1000.0);
            }
            file.runs.push_back(readings);
        }
        const auto back = parse(laser_text(file), angular ? ".rta" : ".rtl");
        EXPECT_EQ(back.title, file.title);
        EXPECT_EQ(laser_text(back), laser_text(file));
        for (std::size_t run = 0; run < 6; ++run) {
            EXPECT_EQ(back.runs[run].target, file.runs[run].target);
            EXPECT_EQ(back.runs[run].direction, run % 2 ? -1 : 1);
            for (std::size_t i = 0; i < file.targets_mm.size(); ++i) {
                EXPECT_NEAR(back.runs[run].deviation[i], file.runs[run].deviation[i], 1e-9);
            }
        }
    }
}

TEST(rtl, the_first_target_once_more_at_the_end_is_in_no_run) {
    const auto file = parse(with("2 1 0\r\n", "2 1 0\r\n2 1 0.75\r\n"));
    ASSERT_TRUE(file.repeated);
    EXPECT_DOUBLE_EQ(file.repeated->position_mm, 0.0);
    EXPECT_DOUBLE_EQ(file.repeated->first, 0.1);
    EXPECT_DOUBLE_EQ(file.repeated->again, 0.75);
    EXPECT_EQ(file.runs[1].deviation.size(), 3u);
    EXPECT_FALSE(parse(by_hand).repeated);
    std::string angles = with("2 1 0\r\n", "2 1 0\r\n2 1 0.75\r\n");
    angles.replace(angles.find("Linear"), 6, "Angular");
    EXPECT_DOUBLE_EQ(parse(angles, ".rta").repeated->again, 750.0);
}

TEST(rtl, mistakes_name_their_line) {
    EXPECT_EQ(message_of(with("Target-count: 3", "Target-count: 4")),
              "29: Target-count is 4, but there are 3 targets");
    EXPECT_EQ(message_of(with("Run-count: 2", "Run-count: 3")),
              "29: Run-count is 3, but there are 2 runs");
    EXPECT_EQ(message_of(with("1 2 -1.5", "1 2 x")), "22: 'x' is not a number");
    EXPECT_EQ(message_of(with("1 2 -1.5", "1 2 nan")), "22: 'nan' is not a number");
    EXPECT_EQ(message_of(with("1 2 -1.5", "1 2")), "22: expected run, target and deviation");
    EXPECT_EQ(message_of(with("1 2 -1.5", "1 4 1")), "22: the target must be a number from 1 to 3");
    EXPECT_EQ(message_of(with("1 2 -1.5", "9 2 1")), "22: the run must be a number from 1 to 2");
    EXPECT_EQ(message_of(with("1 2 -1.5", "1 1 1")), "22: target 1 is there twice in run 1");
    EXPECT_EQ(
        message_of(with("1 3 2.25", "1 3 2.25\r\n1 1 0.3")),
        "24: the first target is there twice in run 1; only the last run may repeat it, for the "
        "drift");
    EXPECT_EQ(message_of(with("2 1 0\r\n", "2 1 0\r\n2 1 1\r\n2 1 1\r\n")),
              "28: target 1 is there twice in run 2");
    EXPECT_EQ(message_of(with("2 1 0\r\n", "2 1 0\r\n2 3 1\r\n")),
              "27: target 3 is there twice in run 2");
    EXPECT_EQ(message_of(with("100.00000", "0.00000")),
              "7: the targets must ascend (or descend), and one of them does not");
    EXPECT_EQ(message_of(with("Target-count: 3", "Target-count: 0")),
              "5: expected a count from 1 to 100000");
    EXPECT_EQ(message_of("1 2 3\n"), "1: a section such as HEADER:: must come first");
    EXPECT_EQ(message_of(with("2 2 -1\r\n2 1 0", "2 1 0\r\n2 2 -1")),
              "24: run 2 goes through its targets neither upward nor downward");
}

// Whatever part of a file is left, the answer is a file or a sentence.
TEST(rtl, cut_or_mutated_files_never_crash) {
    const std::string whole = by_hand;
    for (std::size_t length = 0; length < whole.size(); length += 3) {
        message_of(whole.substr(0, length));
    }
    std::mt19937 random(11);
    for (int round = 0; round < compbox_test::cases(2000); ++round) {
        std::string text = whole;
        for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random());
        try {
            const auto file = parse(text);
            for (const auto &run : file.runs) {
                for (const auto target : run.target) ASSERT_LT(target, file.targets_mm.size());
            }
        } catch (const input_error &) {
        }
    }
}

}  // namespace
