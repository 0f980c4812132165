// SPDX-License-Identifier: MIT
// Against strtof of glibc, which is correctly rounded, bit for bit.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

#include "tests/support/cases.h"
#include "tests/support/dice.h"

extern "C" {
#include "firmware/json/decimal.h"
}

namespace {

uint32_t bits_of(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

float float_of(uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

// Compares one text; the text is copied to exactly its size, so that ASan sees any byte too many.
::testing::AssertionResult same_as_strtof(const std::string &text) {
    const std::unique_ptr<char[]> exact(new char[text.size()]);
    text.copy(exact.get(), text.size());
    const float expected = std::strtof(text.c_str(), nullptr);
    float got = 123.0f;
    const bool finite = cb_decimal_to_float(exact.get(), static_cast<uint32_t>(text.size()), &got);
    if (std::isinf(expected)) {
        if (finite) return ::testing::AssertionFailure() << text << " is " << got << ", not inf";
        if (got != 123.0f) return ::testing::AssertionFailure() << text << " changed the output";
        return ::testing::AssertionSuccess();
    }
    if (finite && bits_of(got) == bits_of(expected)) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure()
           << text << ": " << std::hexfloat << got << " (" << finite << ") instead of " << expected;
}

std::string exact_decimal(double value) {
    char text[256];
    std::snprintf(text, sizeof text, "%.160g", value);
    return text;
}

TEST(decimal, plain_numbers) {
    for (const char *text : {"0",
                             "-0",
                             "0.0",
                             "-0.0",
                             "0e5",
                             "1",
                             "-1",
                             "0.1",
                             "1.25",
                             "1.30",
                             "14300",
                             "0.0001",
                             "1e0",
                             "1E+2",
                             "1e-2",
                             "123456789",
                             "16777217",
                             "16777219",
                             "3.14159265358979323846",
                             "2147483647",
                             "4294967295",
                             "1e10",
                             "9.999999e9",
                             "0.30000001192092896",
                             "5e-324"}) {
        EXPECT_TRUE(same_as_strtof(text));
    }
}

TEST(decimal, ends_of_the_range) {
    for (const char *text : {"3.4028234663852886e38",
                             "3.4028235e38",
                             "3.4028235677973366e38",
                             "3.40282356779733e38",
                             "340282356779733661637539395458142568447",
                             "340282356779733661637539395458142568448",
                             "340282346638528859811704183484516925440",
                             "1e39",
                             "1e400",
                             "-1e400",
                             "1e99999999999999",
                             "1e-45",
                             "1.4e-45",
                             "7.006492321624085e-46",
                             "7.0064923216240854e-46",
                             "7.0064923216240862e-46",
                             "7e-46",
                             "1e-46",
                             "1e-400",
                             "-1e-400",
                             "1e-99999999999999",
                             "1.1754943508222875e-38",
                             "1.1754942807573643e-38",
                             "1.17549431e-38",
                             "1.1754943157898258e-38",
                             "1.1754943157898259e-38",
                             "0e99999999999999"}) {
        EXPECT_TRUE(same_as_strtof(text));
    }
}

// Half-way between neighbours, written out exactly, and the numbers a hair beside it, far beyond
// the digits that are kept.
TEST(decimal, half_way_points_and_their_neighbours) {
    compbox_test::dice random(1);
    for (int i = 0; i < compbox_test::cases(20000); ++i) {
        uint32_t bits = random() & 0x7fffffffu;
        if (i % 4 == 0) bits &= 0x00ffffffu;  // subnormals and the smallest normals
        if (bits >= 0x7f7fffffu) continue;
        const double half =
            (static_cast<double>(float_of(bits)) + static_cast<double>(float_of(bits + 1))) / 2;
        std::string text = exact_decimal(half);
        ASSERT_TRUE(same_as_strtof(text));
        const auto e = text.find('e');
        std::string mantissa = text.substr(0, e);
        const std::string exponent = e == std::string::npos ? "" : text.substr(e);
        if (mantissa.find('.') == std::string::npos) mantissa += ".0";
        ASSERT_TRUE(same_as_strtof(mantissa + std::string(300, '0') + exponent));
        ASSERT_TRUE(same_as_strtof(mantissa + std::string(300, '0') + "1" + exponent));
        char &last = mantissa.back();  // one unit less in the last place, then 9s
        if (last == '0') continue;
        --last;
        ASSERT_TRUE(same_as_strtof(mantissa + std::string(300, '9') + exponent));
    }
}

TEST(decimal, shortest_and_longer_forms_of_random_floats) {
    compbox_test::dice random(2);
    char text[64];
    for (int i = 0; i < compbox_test::cases(300000); ++i) {
        const float value = float_of(random());
        if (!std::isfinite(value)) continue;
        std::snprintf(text, sizeof text, "%.*g", 1 + i % 20, static_cast<double>(value));
        ASSERT_TRUE(same_as_strtof(text));
    }
}

TEST(decimal, random_texts) {
    compbox_test::dice random(3);
    const auto digits = [&](unsigned count) {
        std::string text;
        while (text.size() < count) text += static_cast<char>('0' + random(10));
        return text;
    };
    for (int i = 0; i < compbox_test::cases(300000); ++i) {
        std::string text = random(2) ? "-" : "";
        text += random(3) ? digits(1 + random(12)) : "0";
        if (random(2)) text += "." + digits(1 + random(i % 100 == 0 ? 400 : 15));
        if (random(2)) text += "e" + std::to_string(static_cast<int>(random(100)) - 55);
        ASSERT_TRUE(same_as_strtof(text));
    }
}

TEST(decimal, zeros_in_front_and_behind_do_not_matter) {
    const std::string zeros(5000, '0');
    EXPECT_TRUE(same_as_strtof("0." + zeros + "125e5001"));
    EXPECT_TRUE(same_as_strtof("125" + zeros + "e-5000"));
    EXPECT_TRUE(same_as_strtof("0." + zeros + "125"));
    EXPECT_TRUE(same_as_strtof("1" + zeros));
    EXPECT_TRUE(same_as_strtof(zeros + "1." + zeros + "1"));
    EXPECT_TRUE(same_as_strtof("0." + zeros + "e99999"));
}

// Where the number of kept digits ends, a later digit still decides a tie.
TEST(decimal, the_last_of_many_digits_decides) {
    for (const size_t length : {90u, 110u, 118u, 119u, 120u, 121u, 122u, 500u, 130000u}) {
        const std::string tie = "16777217";  // half-way between 2^24 and 2^24 + 2
        EXPECT_TRUE(same_as_strtof(tie + "." + std::string(length, '0') + "1"));
        EXPECT_TRUE(same_as_strtof("16777216." + std::string(length, '9')));
        EXPECT_TRUE(
            same_as_strtof(tie + std::string(length, '0') + "1e-" + std::to_string(length + 1)));
    }
}

TEST(decimal, whole_numbers) {
    const auto whole = [](const std::string &text) {
        uint32_t value = 77;
        return cb_decimal_to_uint32(text.data(), static_cast<uint32_t>(text.size()), &value)
                   ? std::to_string(value)
               : value == 77 ? "refused"
                             : "refused, but changed";
    };
    EXPECT_EQ(whole("0"), "0");
    EXPECT_EQ(whole("65536"), "65536");
    EXPECT_EQ(whole("4294967295"), "4294967295");
    for (const char *text : {"4294967296", "99999999999999999999999", "-1", "1.0", "1e2", "", "1x"})
        EXPECT_EQ(whole(text), "refused") << text;
}

}  // namespace
