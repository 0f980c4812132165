// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <string>

extern "C" {
#include "firmware/base/crc32.h"
}

namespace {

uint32_t crc(const std::string &text) {
    return cb_crc32(0, text.data(), text.size());
}

// Values from the catalogue of CRC-32/ISO-HDLC and from `python3 -c "import zlib; …"`.
TEST(crc32, known_values) {
    EXPECT_EQ(crc(""), 0u);
    EXPECT_EQ(crc("123456789"), 0xCBF43926u);
    EXPECT_EQ(crc("The quick brown fox jumps over the lazy dog"), 0x414FA339u);
    EXPECT_EQ(crc(std::string(32, '\xFF')), 0xFF6CAB0Bu);
}

TEST(crc32, pieces_give_the_same_as_the_whole) {
    const std::string text = "compensation of 14 300 mm in pieces of any length";
    for (std::size_t cut = 0; cut <= text.size(); ++cut) {
        const uint32_t first = cb_crc32(0, text.data(), cut);
        EXPECT_EQ(cb_crc32(first, text.data() + cut, text.size() - cut), crc(text)) << cut;
    }
}

TEST(crc32, every_single_bit_counts) {
    std::string text(64, 'x');
    const uint32_t good = crc(text);
    for (std::size_t bit = 0; bit < text.size() * 8; ++bit) {
        text[bit / 8] = static_cast<char>(text[bit / 8] ^ (1 << bit % 8));
        EXPECT_NE(crc(text), good) << bit;
        text[bit / 8] = static_cast<char>(text[bit / 8] ^ (1 << bit % 8));
    }
}

}  // namespace
