// SPDX-License-Identifier: MIT
// A flash slot: what is whole is found, whatever else is in the memory is not.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

extern "C" {
#include "firmware/base/crc32.h"
#include "firmware/load/slot.h"
}

namespace {

constexpr std::size_t slot_size = 4096;

std::vector<uint8_t> slot_of(uint32_t revision, const std::string &text) {
    std::vector<uint8_t> bytes(slot_size, 0xFF);
    cb_slot_header(revision, text.data(), static_cast<uint32_t>(text.size()), bytes.data());
    std::copy(text.begin(), text.end(), bytes.begin() + CB_SLOT_HEADER_BYTES);
    return bytes;
}

cb_slot_state state_of(const std::vector<uint8_t> &bytes) {
    cb_slot slot{};
    return cb_slot_read(bytes.data(), bytes.size(), &slot);
}

// The header of this text as Python's struct and zlib make it:
// struct.pack("<4sIII12x", b"CBX1", 7, 13, zlib.crc32(text)) and zlib.crc32 of that.
TEST(slot, bytes_are_as_documented) {
    const std::string text = "{\"format\": 1}";
    const std::vector<uint8_t> expected = {'C', 'B',  'X',  '1',  7,    0, 0,    0,    13,   0,   0,
                                           0,   0x89, 0xBD, 0x34, 0xE2, 0, 0,    0,    0,    0,   0,
                                           0,   0,    0,    0,    0,    0, 0x79, 0x32, 0x27, 0xE2};
    const auto bytes = slot_of(7, text);
    EXPECT_EQ(std::vector<uint8_t>(bytes.begin(), bytes.begin() + CB_SLOT_HEADER_BYTES), expected);
}

TEST(slot, what_was_packed_is_read_back) {
    const auto bytes = slot_of(4000000000u, "text of a coefficient file");
    cb_slot slot{};
    ASSERT_EQ(cb_slot_read(bytes.data(), bytes.size(), &slot), CB_SLOT_WHOLE);
    EXPECT_EQ(slot.revision, 4000000000u);
    EXPECT_EQ(std::string(slot.text, slot.length), "text of a coefficient file");
    EXPECT_EQ(slot.crc, cb_crc32(0, slot.text, slot.length));
}

TEST(slot, erased_memory_is_empty) {
    EXPECT_EQ(state_of(std::vector<uint8_t>(slot_size, 0xFF)), CB_SLOT_EMPTY);
    EXPECT_EQ(state_of(std::vector<uint8_t>(CB_SLOT_HEADER_BYTES - 1, 'C')), CB_SLOT_EMPTY);
    EXPECT_EQ(state_of({}), CB_SLOT_EMPTY);
    EXPECT_EQ(state_of(std::vector<uint8_t>(slot_size, 0)), CB_SLOT_BROKEN);
}

// Status register 0x1234 of unit 17 at 115 200 baud, even parity, one stop bit; read back where the
// text is broken, nowhere else.
TEST(slot, place_of_the_report) {
    auto bytes = slot_of(7, "some text");
    cb_slot_report report{}, read{};
    EXPECT_FALSE(cb_slot_read_report(bytes.data(), bytes.size(), &read));
    report = {115200, 0x1234, 17, 1, 1};
    cb_slot_set_report(bytes.data(), &report);
    const std::vector<uint8_t> expected = {0x34, 0x12, 17, 0x11, 0x00, 0xC2, 0x01, 0};
    EXPECT_EQ(std::vector<uint8_t>(bytes.begin() + 16, bytes.begin() + 24), expected);
    EXPECT_EQ(state_of(bytes), CB_SLOT_WHOLE);
    bytes[CB_SLOT_HEADER_BYTES] ^= 1;
    EXPECT_EQ(state_of(bytes), CB_SLOT_BROKEN);
    ASSERT_TRUE(cb_slot_read_report(bytes.data(), bytes.size(), &read));
    EXPECT_EQ(read.baud, 115200u);
    EXPECT_EQ(read.status, 0x1234);
    EXPECT_EQ(read.unit, 17);
    EXPECT_EQ(read.parity, 1);
    EXPECT_EQ(read.stop_bits, 1);
    bytes[20] ^= 1;
    EXPECT_FALSE(cb_slot_read_report(bytes.data(), bytes.size(), &read));
    EXPECT_FALSE(cb_slot_read_report(bytes.data(), CB_SLOT_HEADER_BYTES - 1, &read));
}

TEST(slot, a_report_that_no_line_can_be_set_to_is_none) {
    const cb_slot_report wrong[] = {{0, 1, 1, 1, 1},    {1199, 1, 1, 1, 1},   {1000000, 1, 1, 1, 1},
                                    {9600, 1, 0, 1, 1}, {9600, 1, 248, 1, 1}, {9600, 1, 1, 3, 1},
                                    {9600, 1, 1, 1, 0}, {9600, 1, 1, 1, 3}};
    for (const cb_slot_report &report : wrong) {
        auto bytes = slot_of(7, "some text");
        cb_slot_set_report(bytes.data(), &report);
        cb_slot_report read{};
        EXPECT_FALSE(cb_slot_read_report(bytes.data(), bytes.size(), &read));
    }
}

// Every single bit of header and text, turned: never taken for whole, and nothing is written out.
TEST(slot, a_wrong_bit_is_found) {
    const std::string text = "some text that flash may lose";
    for (std::size_t bit = 0; bit < 8 * (CB_SLOT_HEADER_BYTES + text.size()); ++bit) {
        auto bytes = slot_of(3, text);
        bytes[bit / 8] ^= static_cast<uint8_t>(1u << bit % 8);
        cb_slot slot{99, 99, 99, nullptr};
        EXPECT_EQ(cb_slot_read(bytes.data(), bytes.size(), &slot), CB_SLOT_BROKEN) << bit;
        EXPECT_EQ(slot.revision, 99u);
        EXPECT_EQ(slot.text, nullptr);
    }
}

// The power goes at every byte of the writing, header first or last.
TEST(slot, a_cut_during_writing_never_makes_a_whole_slot) {
    const std::string text = "a text that is written byte by byte";
    const auto whole = slot_of(3, text);
    const std::size_t end = CB_SLOT_HEADER_BYTES + text.size();
    for (std::size_t written = 0; written < end; ++written) {
        std::vector<uint8_t> first(slot_size, 0xFF), last = first;
        std::copy_n(whole.begin(), written, first.begin());
        EXPECT_NE(state_of(first), CB_SLOT_WHOLE) << written;
        for (std::size_t k = 0; k < written; ++k) {
            const std::size_t at = (CB_SLOT_HEADER_BYTES + k) % end;
            last[at] = whole[at];
        }
        EXPECT_NE(state_of(last), CB_SLOT_WHOLE) << written;
    }
}

TEST(slot, a_length_beyond_the_memory_is_broken) {
    const std::string text(100, 'x');
    auto bytes = slot_of(1, text);
    bytes.resize(CB_SLOT_HEADER_BYTES + 99);  // exactly: the sanitizer sees a read beyond
    bytes.shrink_to_fit();
    EXPECT_EQ(state_of(bytes), CB_SLOT_BROKEN);
    std::vector<uint8_t> header(CB_SLOT_HEADER_BYTES);
    for (const uint32_t length : {0u, 1u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
        cb_slot_header(1, text.data(), 0, header.data());
        // a header that is right in itself but for its length: made by hand
        std::vector<uint8_t> forged(header);
        for (unsigned i = 0; i < 4; ++i) forged[8 + i] = static_cast<uint8_t>(length >> 8 * i);
        EXPECT_EQ(state_of(forged), CB_SLOT_BROKEN) << length;
    }
}

TEST(slot, a_text_longer_than_the_box_reads_is_broken) {
    const std::size_t most = CB_MAX_TEXT_BYTES;
    for (const std::size_t length : {most, most + 1}) {
        const std::string text(length, 'x');
        std::vector<uint8_t> bytes(CB_SLOT_HEADER_BYTES + length + 1, 0xFF);
        cb_slot_header(1, text.data(), static_cast<uint32_t>(length), bytes.data());
        std::copy(text.begin(), text.end(), bytes.begin() + CB_SLOT_HEADER_BYTES);
        EXPECT_EQ(state_of(bytes), length > most ? CB_SLOT_BROKEN : CB_SLOT_WHOLE);
    }
}

TEST(slot, noise_is_never_whole) {
    std::mt19937 dice(1);
    for (int round = 0; round < 20000; ++round) {
        std::vector<uint8_t> bytes(64);
        for (auto &byte : bytes) byte = static_cast<uint8_t>(dice());
        if (round % 2) std::copy_n("CBX1", 4, bytes.begin());
        EXPECT_NE(state_of(bytes), CB_SLOT_WHOLE);
    }
}

TEST(slot, the_newest_whole_slot_wins) {
    const std::vector<uint8_t> empty(slot_size, 0xFF);
    auto broken = slot_of(9, "nine");
    broken[33] = 0;
    const auto old = slot_of(5, "five"), fresh = slot_of(6, "six"), twin = slot_of(5, "FIVE");
    const auto newest = [](const std::vector<uint8_t> &a, const std::vector<uint8_t> &b) {
        cb_slot slots[CB_SLOTS] = {};
        const cb_slot_state states[CB_SLOTS] = {cb_slot_read(a.data(), slot_size, &slots[0]),
                                                cb_slot_read(b.data(), slot_size, &slots[1])};
        const int index = cb_slot_newest(states, slots);
        return std::make_pair(index,
                              index < 0 ? "" : std::string(slots[index].text, slots[index].length));
    };
    using answer = std::pair<int, std::string>;
    EXPECT_EQ(newest(old, fresh), answer(1, "six"));
    EXPECT_EQ(newest(fresh, old), answer(0, "six"));
    EXPECT_EQ(newest(old, twin), answer(0, "five"));
    EXPECT_EQ(newest(old, broken), answer(0, "five"));
    EXPECT_EQ(newest(broken, old), answer(1, "five"));
    EXPECT_EQ(newest(empty, old), answer(1, "five"));
    EXPECT_EQ(newest(empty, broken), answer(-1, ""));
}

}  // namespace
