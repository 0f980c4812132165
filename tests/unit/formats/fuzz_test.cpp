// SPDX-License-Identifier: MIT
// Files that were cut, mutated or mixed: the answer is finite figures or one sentence, never a
// crash.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include "host-tools/fitting/columns.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/text.h"
#include "tests/support/cases.h"
#include "tests/support/temporary.h"

namespace {

using namespace compbox;
using namespace compbox::formats;
using namespace std::string_literals;

const char *const rtl_text =
    "HEADER::\r\nFile Type: Linear\r\nTARGET DATA::\r\nFiletype : ISO\r\nTarget-count: 6\r\n"
    "Targets :\r\n 0.0 100.0 200.0 300.0 400.0\r\n 500.0\r\nFlags: 0 0 0\r\nUSER-TEXT::\r\n"
    "Machine:\xc1\xfa\xc3\xc5\r\nDate:2026-01-02\r\nAxis:X\r\nRUNS::\r\nRun-count: 2\r\n"
    "DEVIATIONS::\r\nRun Target Data:\r\n1 1 0.1\r\n1 2 -1.5\r\n1 3 2.25\r\n1 4 2,25\r\n"
    "1 5 2.5\r\n1 6 3\r\n2 6 3.5\r\n2 5 2.5\r\n2 4 2.5\r\n2 3 2.5\r\n2 2 -1\r\n2 1 0\r\nEOF::\r\n";
const std::string csv_texts[] = {
    ("position_mm,error_um,run,direction,sigma\n0,1,a,+1,0.5\n10,2,a,+1,0.5\n20,1e1,a,+1,0.5\n"
     "20,3,b,-1,0.5\n10,2,b,-1,0.5\n0,-1,b,-1,0.5\n"),
    "Position [mm];Abweichung (\xb5m);Lauf\r\n0;1,25;1\r\n50,5;-2,5;1\r\n100;3,0;1\r\n;;\r\n",
    "\xce\xbb\xd6\xc3(mm)\t\xce\xf3\xb2\xee(um)\n0\t1\n1\t2\n2\t3\n",
    "\"Target (mm)\",\"Run 1 forward (um)\",\"Run 1 backward (um)\"\n0,1,2\n10,\"3,5\",4\n20,5,6\n",
    "# a comment\nposition_mm  error_urad\n 0   1\n 10  2\n 20  3\n",
    "\xff\xfep\0o\0s\0_\0m\0m\0,\0e\0r\0r\0_\0u\0m\0\n\0"s,
};

std::string path_of(const std::string &ending) {
    return compbox_test::temporary("figures" + ending);
}

// true for figures, false for a sentence; everything else fails the test.
bool reads(const std::string &text, const std::string &ending) {
    const std::string path = path_of(ending);
    std::ofstream(path, std::ios::binary) << text;  // write_file would sync each of thousands
    try {
        const fitting::measurement data = fitting::read_measurement(path);
        EXPECT_FALSE(data.position.empty());
        EXPECT_EQ(data.position.size(), data.mean.size());
        for (std::size_t i = 0; i < data.position.size(); ++i) {
            EXPECT_TRUE(std::isfinite(data.position[i]) && std::isfinite(data.mean[i]));
            if (i > 0) {
                EXPECT_LT(data.position[i - 1], data.position[i]);
            }
        }
        return true;
    } catch (const input_error &error) {
        const std::string what = error.what();
        EXPECT_EQ(what.compare(0, path.size(), path), 0) << what;
        EXPECT_GT(what.size(), path.size() + 10);
        return false;
    }
}

std::string mutated(std::string text, std::mt19937 &dice) {
    static const std::string pieces[] = {"nan",      "inf", "1e999", "-",
                                         ",",        ";",   "\t",    "\n",
                                         "\r",       "\"",  "::",    "99999999999999999999",
                                         "\xff\xfe", "\0"s, "0x1p3", "é"};
    const int changes = 1 + static_cast<int>(dice() % 4);
    for (int k = 0; k < changes && !text.empty(); ++k) {
        const std::size_t at = dice() % text.size();
        switch (dice() % 5) {
            case 0:
                text[at] = static_cast<char>(dice());
                break;
            case 1:
                text.erase(at, 1 + dice() % 8);
                break;
            case 2:
                text.insert(at, pieces[dice() % std::size(pieces)]);
                break;
            case 3:
                text.insert(at, text.substr(dice() % text.size(), dice() % 40));
                break;
            default:
                text.resize(at);
                break;
        }
    }
    return text;
}

TEST(formats_fuzz, the_seeds_themselves_are_read) {
    EXPECT_TRUE(reads(rtl_text, ".rtl"));
    EXPECT_TRUE(reads(rtl_text, ".rts"));
    for (std::size_t k = 0; k + 1 < std::size(csv_texts); ++k) {
        EXPECT_TRUE(reads(csv_texts[k], ".csv")) << k;
    }
}

TEST(formats_fuzz, cut_anywhere) {
    for (std::size_t length = 0; length < std::string(rtl_text).size(); ++length) {
        reads(std::string(rtl_text).substr(0, length), ".rtl");
    }
    for (const std::string &text : csv_texts) {
        for (std::size_t length = 0; length < text.size(); ++length) {
            reads(text.substr(0, length), ".csv");
        }
    }
}

TEST(formats_fuzz, mutated) {
    std::mt19937 dice(2026);
    int read = 0, refused = 0;
    for (int round = 0; round < compbox_test::cases(2000); ++round) {
        const std::string seed = round % 3 ? csv_texts[dice() % std::size(csv_texts)] : rtl_text;
        const bool figures = reads(mutated(seed, dice), round % 3 ? ".csv" : ".rtl");
        ++(figures ? read : refused);
    }
    EXPECT_GT(read, compbox_test::cases(100));  // the mutations are small enough to matter
    EXPECT_GT(refused, compbox_test::cases(100));
}

TEST(formats_fuzz, noise_becomes_utf8) {
    std::mt19937 dice(3);
    for (int round = 0; round < 3000; ++round) {
        std::string bytes(dice() % 64, '\0');
        for (char &byte : bytes) byte = static_cast<char>(dice());
        const std::string text = to_utf8(bytes);
        EXPECT_EQ(to_utf8(text), text);  // valid, so it stays as it is
    }
}

// What compbox writes it reads back bit for bit, whatever the numbers.
TEST(csv, round_trip) {
    std::mt19937_64 dice(8);
    std::vector<std::vector<double>> rows;
    while (rows.size() < 2000) {
        std::vector<double> row;
        while (row.size() < 3) {
            const std::uint64_t bits = dice();
            double value;
            std::memcpy(&value, &bits, sizeof value);
            if (std::isfinite(value)) row.push_back(value);
        }
        rows.push_back(row);
    }
    rows.push_back({0.0, 5e-324, -1.7976931348623157e308});
    const std::string path = path_of(".csv");
    std::ofstream(path, std::ios::binary) << csv_text({"a", "b", "c"}, rows);
    const csv_table table = read_csv(path);
    EXPECT_EQ(table.names, (std::vector<std::string>{"a", "b", "c"}));
    EXPECT_EQ(table.rows, rows);
}

TEST(text, code_pages) {
    EXPECT_EQ(to_utf8("plain"), "plain");
    EXPECT_EQ(to_utf8("µm, 误差"), "µm, 误差");
    EXPECT_EQ(to_utf8("\xEF\xBB\xBF"
                      "a"),
              "a");
    EXPECT_EQ(to_utf8("\xce\xbb\xd6\xc3,\xce\xf3\xb2\xee"), "位置,误差");  // GBK
    EXPECT_EQ(to_utf8("\xb5m \xb0"
                      "C \xb1"),
              "µm °C ±");  // Windows-1252
    EXPECT_EQ(to_utf8(std::string("\xff\xfe"
                                  "a\0\xb5\0",
                                  6)),
              "aµ");  // UTF-16LE
    EXPECT_EQ(to_utf8(std::string("\xfe\xff\0a\0\xb5", 6)), "aµ");
    EXPECT_EQ(to_utf8("\xc0\xaf").find('\xc0'), std::string::npos);  // overlong is not UTF-8
}

TEST(columns, names_of_other_programs) {
    const std::pair<const char *, const char *> names[] = {
        {"position_mm", "position_mm"},
        {"Target [mm]", "nominal_mm"},
        {"Pos. (mm)", "position_mm"},
        {"位置(毫米)", "position_mm"},
        {"目标位置（mm）", "nominal_mm"},
        {"Position/m", "position_m"},
        {"error_um", "error_um"},
        {"Deviation (µm)", "error_um"},
        {"Deviation (μm)", "error_um"},
        {"偏差(微米)", "error_um"},
        {"Error, mm", "error_mm"},
        {"Err [arc sec]", "error_arcsec"},
        {"Abweichung mrad", "error_mrad"},
        {"Run No.", "run"},
        {"次数", "run"},
        {"Richtung", "direction"},
        {"方向", "direction"},
        {"Run 1 (um)", "error_um@1"},
        {"run3forward (um)", "error_um@3+"},
        {"Run 2 backward [µm]", "error_um@2-"},
        {"第2次反向(um)", "error_um@2-"},
        // no unit, or no meaning: left alone, so that the reader says what is missing
        {"Position", "Position"},
        {"error", "error"},
        {"temperature (C)", "temperature (C)"},
        {"Run 1", "Run 1"},
        {"sigma_um", "sigma_um"},
        {"", ""}};
    for (const auto &[name, expected] : names) EXPECT_EQ(fitting::canonical_column(name), expected);
}

}  // namespace
