// SPDX-License-Identifier: MIT
// The codec against bytes written by hand from the Modbus application protocol specification.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/support/cases.h"

extern "C" {
#include "firmware/wire/modbus.h"
}

namespace modbus_codec {
namespace {

using bytes = std::vector<uint8_t>;

bytes encode(const cb_modbus_request &request) {
    bytes pdu(CB_MODBUS_MAX_PDU);
    pdu.resize(cb_modbus_encode(&request, pdu.data()));
    return pdu;
}

cb_modbus_request read_request(uint16_t start, uint16_t count) {
    cb_modbus_request request{};
    request.function = CB_MODBUS_READ;
    request.read_start = start;
    request.read_count = count;
    return request;
}

cb_modbus_request write_request(uint16_t start, const std::vector<uint16_t> &registers) {
    cb_modbus_request request{};
    request.function = CB_MODBUS_WRITE;
    request.write_start = start;
    request.write_count = static_cast<uint16_t>(registers.size());
    request.write_registers = registers.data();
    return request;
}

struct decoded {
    cb_modbus_answer answer;
    std::vector<uint16_t> registers;
    int exception;
};

// 0xEEEE and 0xEE mark what must not be touched.
decoded decode(const cb_modbus_request &request, const bytes &pdu) {
    decoded result{CB_MODBUS_INVALID, std::vector<uint16_t>(130, 0xEEEE), 0};
    uint8_t exception = 0xEE;
    const bytes exact(pdu);  // its own allocation, so that a sanitizer sees a read beyond it
    result.answer =
        cb_modbus_decode(&request, exact.data(), exact.size(), result.registers.data(), &exception);
    result.exception = exception;
    return result;
}

bool untouched(const decoded &result) {
    for (uint16_t value : result.registers)
        if (value != 0xEEEE) return false;
    return true;
}

// The examples of the specification, §6.3, §6.12 and §6.17.
TEST(modbus, encodes_the_examples_of_the_specification) {
    EXPECT_EQ(encode(read_request(107, 3)), (bytes{0x03, 0x00, 0x6B, 0x00, 0x03}));
    EXPECT_EQ(encode(write_request(1, {0x000A, 0x0102})),
              (bytes{0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02}));
    const std::vector<uint16_t> values{0x00FF, 0x00FF, 0x00FF};
    cb_modbus_request both = write_request(14, values);
    both.function = CB_MODBUS_WRITE_READ;
    both.read_start = 3;
    both.read_count = 6;
    EXPECT_EQ(encode(both), (bytes{0x17, 0x00, 0x03, 0x00, 0x06, 0x00, 0x0E, 0x00, 0x03, 0x06, 0x00,
                                   0xFF, 0x00, 0xFF, 0x00, 0xFF}));
}

TEST(modbus, decodes_the_examples_of_the_specification) {
    const decoded read =
        decode(read_request(107, 3), {0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64});
    EXPECT_EQ(read.answer, CB_MODBUS_OK);
    EXPECT_EQ(read.registers[0], 0x022B);
    EXPECT_EQ(read.registers[1], 0x0000);
    EXPECT_EQ(read.registers[2], 0x0064);
    EXPECT_EQ(read.registers[3], 0xEEEE);
    const decoded write = decode(write_request(1, {10, 258}), {0x10, 0x00, 0x01, 0x00, 0x02});
    EXPECT_EQ(write.answer, CB_MODBUS_OK);
    EXPECT_TRUE(untouched(write));
}

TEST(modbus, refuses_to_encode_counts_the_protocol_forbids) {
    const std::vector<uint16_t> many(200);
    cb_modbus_request request = write_request(0, many);
    for (const uint16_t count : std::vector<uint16_t>{0, 124, 200}) {
        request.function = CB_MODBUS_WRITE;
        request.write_count = count;
        EXPECT_TRUE(encode(request).empty()) << count;
    }
    request.write_count = 123;
    EXPECT_EQ(encode(request).size(), 252u);
    request.function = CB_MODBUS_WRITE_READ;
    request.read_count = 125;
    EXPECT_TRUE(encode(request).empty());
    request.write_count = 121;
    EXPECT_EQ(encode(request).size(), 252u);
    request.read_count = 126;
    EXPECT_TRUE(encode(request).empty());
    EXPECT_TRUE(encode(read_request(0, 126)).empty());
    EXPECT_TRUE(encode(read_request(0, 0)).empty());
    EXPECT_EQ(encode(read_request(0, 125)).size(), 5u);
    request.function = 6;
    EXPECT_TRUE(encode(request).empty());
}

TEST(modbus, an_exception_is_reported_with_its_code) {
    const decoded refused = decode(read_request(0, 2), {0x83, 0x02});
    EXPECT_EQ(refused.answer, CB_MODBUS_EXCEPTION);
    EXPECT_EQ(refused.exception, 2);
    EXPECT_TRUE(untouched(refused));
    EXPECT_EQ(decode(write_request(0, {1}), {0x90, 0x04}).exception, 4);
    EXPECT_EQ(decode(read_request(0, 2), {0x90, 0x02}).answer, CB_MODBUS_INVALID);
    EXPECT_EQ(decode(read_request(0, 2), {0x83, 0x02, 0x00}).answer, CB_MODBUS_INVALID);
    EXPECT_EQ(decode(read_request(0, 2), {0x83}).answer, CB_MODBUS_INVALID);
}

TEST(modbus, a_reply_that_states_another_length_is_invalid_and_copies_nothing) {
    const std::vector<bytes> replies = {
        {},
        {0x03},
        {0x03, 0x04},
        {0x03, 0x04, 0x00, 0x01, 0x00},                    // one byte short
        {0x03, 0x04, 0x00, 0x01, 0x00, 0x02, 0x00},        // one too many
        {0x03, 0x06, 0x00, 0x01, 0x00, 0x02, 0x00, 0x03},  // more registers than requested
        {0x03, 0xFF, 0x00, 0x01, 0x00, 0x02},              // a count beyond the frame
        {0x03, 0x02, 0x00, 0x01, 0x00, 0x02},              // right length, wrong count
        {0x04, 0x04, 0x00, 0x01, 0x00, 0x02},              // another function
    };
    for (const bytes &reply : replies) {
        const decoded result = decode(read_request(0, 2), reply);
        EXPECT_EQ(result.answer, CB_MODBUS_INVALID) << reply.size();
        EXPECT_TRUE(untouched(result));
        EXPECT_EQ(result.exception, 0xEE);
    }
}

TEST(modbus, a_write_echo_must_be_that_of_the_write) {
    const auto request = write_request(100, {1, 2, 3});
    EXPECT_EQ(decode(request, {0x10, 0, 100, 0, 3}).answer, CB_MODBUS_OK);
    EXPECT_EQ(decode(request, {0x10, 0, 101, 0, 3}).answer, CB_MODBUS_INVALID);
    EXPECT_EQ(decode(request, {0x10, 0, 100, 0, 2}).answer, CB_MODBUS_INVALID);
    EXPECT_EQ(decode(request, {0x10, 0, 100, 0}).answer, CB_MODBUS_INVALID);
    EXPECT_EQ(decode(request, {0x10, 0, 100, 0, 3, 0}).answer, CB_MODBUS_INVALID);
}

// Whatever bytes come, only a reply of exactly the requested size may fill registers.
TEST(modbus, random_bytes_never_fill_registers_unless_the_reply_fits) {
    std::mt19937 random(1);
    for (int i = 0; i < compbox_test::cases(200000); i++) {
        bytes pdu(random() % 12);
        for (uint8_t &byte : pdu)
            byte = static_cast<uint8_t>(random() % 4 ? random() % 8 : random());
        if (!pdu.empty() && random() % 2) pdu[0] = 3;
        const auto request = read_request(0, static_cast<uint16_t>(1 + random() % 4));
        const decoded result = decode(request, pdu);
        const size_t size = 2u * request.read_count;
        const bool fits = pdu.size() == 2 + size && pdu[0] == 3 && pdu[1] == size;
        ASSERT_EQ(result.answer == CB_MODBUS_OK, fits);
        ASSERT_EQ(result.registers[request.read_count], 0xEEEE);
        if (!fits) {
            ASSERT_TRUE(untouched(result));
        }
    }
}

}  // namespace
}  // namespace modbus_codec
