// SPDX-License-Identifier: MIT
// The codec against registers and bytes written by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

extern "C" {
#include "firmware/wire/number.h"
}

namespace {

struct known {
    cb_number_type type;
    float number;
    std::vector<uint16_t> registers;  // as they stand on the wire, first register first
};

// 0x12345678 = 305419896 is no float32; 0x12345680 = 305419904 is the nearest that is.
const std::vector<known> by_hand = {
    {CB_NUMBER_UINT16, 0, {0x0000}},
    {CB_NUMBER_UINT16, 4660, {0x1234}},
    {CB_NUMBER_UINT16, 65535, {0xFFFF}},
    {CB_NUMBER_INT16, -1, {0xFFFF}},
    {CB_NUMBER_INT16, -32768, {0x8000}},
    {CB_NUMBER_INT16, 32767, {0x7FFF}},
    {CB_NUMBER_UINT32, 305419904, {0x1234, 0x5680}},
    {CB_NUMBER_UINT32, 4294967040.0f, {0xFFFF, 0xFF00}},
    {CB_NUMBER_INT32, 305419904, {0x1234, 0x5680}},
    {CB_NUMBER_INT32, -2, {0xFFFF, 0xFFFE}},
    {CB_NUMBER_INT32, -2147483648.0f, {0x8000, 0x0000}},
    {CB_NUMBER_FLOAT32, 1.0f, {0x3F80, 0x0000}},
    {CB_NUMBER_FLOAT32, -118.625f, {0xC2ED, 0x4000}},
    {CB_NUMBER_UINT32_CDAB, 305419904, {0x5680, 0x1234}},
    {CB_NUMBER_INT32_CDAB, -2, {0xFFFE, 0xFFFF}},
    {CB_NUMBER_FLOAT32_CDAB, -118.625f, {0x4000, 0xC2ED}},
    {CB_NUMBER_UINT16_LE, 4660, {0x3412}},
    {CB_NUMBER_INT16_LE, -2, {0xFEFF}},
    {CB_NUMBER_UINT32_LE, 305419904, {0x8056, 0x3412}},
    {CB_NUMBER_INT32_LE, -2, {0xFEFF, 0xFFFF}},
    {CB_NUMBER_FLOAT32_LE, -118.625f, {0x0040, 0xEDC2}},
};

TEST(registers, numbers_written_by_hand_both_ways) {
    for (const known &k : by_hand) {
        SCOPED_TRACE(testing::Message() << "type " << k.type << " number " << k.number);
        ASSERT_EQ(cb_number_registers(k.type), k.registers.size());
        EXPECT_EQ(cb_number_decode(k.type, k.registers.data()), k.number);
        std::vector<uint16_t> registers(k.registers.size(), 0xAAAA);
        ASSERT_TRUE(cb_number_encode(k.type, k.number, registers.data()));
        EXPECT_EQ(registers, k.registers);
    }
}

TEST(registers, bytes_of_a_frame_are_registers_high_byte_first) {
    const uint8_t pt100_le[2] = {0x2C, 0x01};  // 300, as CAN modules send it
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_INT16_LE, pt100_le), 300);
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_INT16, pt100_le), 0x2C01);
    const uint8_t float_le[4] = {0x00, 0x40, 0xED, 0xC2};
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_FLOAT32_LE, float_le), -118.625f);
    const uint8_t bytes[2] = {0xFE, 0x11};
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_UINT8, bytes), 254);
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_INT8, bytes), -2);
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_INT8, bytes + 1), 17);
    const uint8_t int32_be[4] = {0xFF, 0xFF, 0xFF, 0x38};
    EXPECT_EQ(cb_number_decode_bytes(CB_NUMBER_INT32, int32_be), -200);
}

TEST(registers, integers_round_half_away_from_zero) {
    uint16_t r[2] = {0, 0};
    const std::vector<std::pair<float, int>> rounded = {
        {0.49999997f, 0}, {0.5f, 1},   {-0.5f, -1},           {-0.49999997f, 0}, {1.5f, 2},
        {2.5f, 3},        {-2.5f, -3}, {8388607.5f, 8388608}, {-1.4999999f, -1}};
    for (const auto &[number, expected] : rounded) {
        EXPECT_EQ(cb_round(number), expected) << number;
        ASSERT_TRUE(cb_number_encode(CB_NUMBER_INT32, number, r));
        EXPECT_EQ(static_cast<int32_t>(r[0] * 65536u + r[1]), expected) << number;
    }
}

TEST(registers, what_does_not_fit_is_refused_and_leaves_the_registers) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<std::pair<cb_number_type, float>> bad = {
        {CB_NUMBER_UINT16, -1},          {CB_NUMBER_UINT16, 65536},
        {CB_NUMBER_UINT16_LE, 65536},    {CB_NUMBER_INT16, 32768},
        {CB_NUMBER_INT16, -32769},       {CB_NUMBER_INT16_LE, 1e30f},
        {CB_NUMBER_UINT32, -1},          {CB_NUMBER_UINT32, 4294967296.0f},
        {CB_NUMBER_INT32, 2147483648.f}, {CB_NUMBER_INT32, -2147483904.0f},
        {CB_NUMBER_INT32_CDAB, inf},     {CB_NUMBER_INT32_LE, -inf},
        {CB_NUMBER_UINT32_CDAB, nan},    {CB_NUMBER_INT16, nan},
        {CB_NUMBER_FLOAT32, nan},        {CB_NUMBER_FLOAT32_CDAB, inf},
        {CB_NUMBER_FLOAT32_LE, -inf}};
    for (const auto &[type, number] : bad) {
        uint16_t r[2] = {0x1111, 0x2222};
        EXPECT_FALSE(cb_number_encode(type, number, r)) << type << " " << number;
        EXPECT_EQ(r[0], 0x1111);
        EXPECT_EQ(r[1], 0x2222);
    }
}

TEST(registers, a_one_register_number_leaves_its_neighbour) {
    uint16_t r[2] = {0, 0x2222};
    ASSERT_TRUE(cb_number_encode(CB_NUMBER_INT16, -5, r));
    EXPECT_EQ(r[1], 0x2222);
}

TEST(registers, the_range_is_what_encodes) {
    for (int t = CB_NUMBER_UINT16; t <= CB_NUMBER_INT8; ++t) {
        const auto type = static_cast<cb_number_type>(t);
        const cb_range range = cb_number_range(type);
        uint16_t r[2];
        for (float number : {range.min, range.max}) {
            ASSERT_TRUE(cb_number_encode(type, number, r)) << t;
            EXPECT_EQ(cb_number_decode(type, r), number) << t;
        }
        const float above = std::nextafter(range.max, std::numeric_limits<float>::infinity());
        EXPECT_FALSE(cb_number_encode(type, above, r)) << t;
    }
}

TEST(registers, every_16_bit_pattern_comes_back) {
    for (cb_number_type type :
         {CB_NUMBER_UINT16, CB_NUMBER_INT16, CB_NUMBER_UINT16_LE, CB_NUMBER_INT16_LE}) {
        for (unsigned bits = 0; bits <= 0xFFFF; ++bits) {
            const uint16_t in = static_cast<uint16_t>(bits);
            uint16_t out = 0;
            ASSERT_TRUE(cb_number_encode(type, cb_number_decode(type, &in), &out));
            ASSERT_EQ(out, in);
        }
    }
}

TEST(registers, any_float_bits_are_given_as_they_are) {
    const uint16_t nan_bits[2] = {0x7FC0, 0x0001};
    EXPECT_TRUE(std::isnan(cb_number_decode(CB_NUMBER_FLOAT32, nan_bits)));
    const uint16_t inf_bits[2] = {0x0000, 0xFF80};
    EXPECT_EQ(cb_number_decode(CB_NUMBER_FLOAT32_CDAB, inf_bits),
              -std::numeric_limits<float>::infinity());
}

}  // namespace
