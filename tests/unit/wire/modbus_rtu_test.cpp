// SPDX-License-Identifier: MIT
// RTU frames and their reception against bytes made by an independent CRC and by hand, with every
// kind of damage that a line does.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/support/cases.h"

extern "C" {
#include "firmware/wire/rtu_receiver.h"
}

namespace {

using bytes = std::vector<uint8_t>;

// As the standard describes it: bit by bit.
bytes with_crc(bytes frame) {
    unsigned crc = 0xFFFF;
    for (uint8_t byte : frame) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1;
    }
    frame.push_back(static_cast<uint8_t>(crc & 0xFF));
    frame.push_back(static_cast<uint8_t>(crc >> 8));
    return frame;
}

cb_modbus_request read_request(uint16_t start, uint16_t count) {
    cb_modbus_request request{};
    request.function = CB_MODBUS_READ;
    request.read_start = start;
    request.read_count = count;
    return request;
}

const uint16_t written[] = {0x000A, 0x0102, 0xFFFE};

cb_modbus_request write_request() {
    cb_modbus_request request{};
    request.function = CB_MODBUS_WRITE;
    request.write_start = 0x0164;
    request.write_count = 3;
    request.write_registers = written;
    return request;
}

cb_modbus_request both_request() {
    cb_modbus_request request = write_request();
    request.function = CB_MODBUS_WRITE_READ;
    request.read_count = 2;
    return request;
}

bytes encode(uint8_t unit, const cb_modbus_request &request) {
    bytes frame(CB_RTU_MAX_FRAME);
    frame.resize(cb_rtu_encode(unit, &request, frame.data()));
    return frame;
}

// The reply of a server that holds `start + address` in each register.
bytes reply_to(uint8_t unit, const cb_modbus_request &request) {
    bytes frame{unit, request.function};
    if (request.function == CB_MODBUS_WRITE) {
        const bytes whole = encode(unit, request);
        frame.insert(frame.end(), whole.begin() + 2, whole.begin() + 6);
        return with_crc(frame);
    }
    frame.push_back(static_cast<uint8_t>(2 * request.read_count));
    for (unsigned i = 0; i < request.read_count; ++i) {
        const unsigned value = 0x4000u + request.read_start + i;
        frame.push_back(static_cast<uint8_t>(value >> 8));
        frame.push_back(static_cast<uint8_t>(value & 0xFF));
    }
    return with_crc(frame);
}

bytes joined(bytes a, const bytes &b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

// ---- frames ----

// The most quoted frames there are, from the specification's and vendors' manuals.
TEST(modbus_rtu, encodes_known_frames) {
    EXPECT_EQ(encode(1, read_request(0, 10)),
              (bytes{0x01, 0x03, 0x00, 0x00, 0x00, 0x0A, 0xC5, 0xCD}));
    EXPECT_EQ(encode(0x11, read_request(0x6B, 3)),
              (bytes{0x11, 0x03, 0x00, 0x6B, 0x00, 0x03, 0x76, 0x87}));
    const uint16_t values[] = {0x000A, 0x0102};
    cb_modbus_request write = write_request();
    write.write_start = 1;
    write.write_count = 2;
    write.write_registers = values;
    EXPECT_EQ(encode(0x11, write), (bytes{0x11, 0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A,
                                          0x01, 0x02, 0xC6, 0xF0}));
}

TEST(modbus_rtu, every_frame_ends_with_the_crc_of_the_bitwise_definition) {
    for (const auto &request : {read_request(7, 125), write_request(), both_request()})
        for (unsigned unit = 1; unit <= 247; ++unit) {
            const bytes frame = encode(static_cast<uint8_t>(unit), request);
            EXPECT_EQ(frame, with_crc(bytes(frame.begin(), frame.end() - 2)));
            EXPECT_EQ(frame.size(), cb_rtu_request_bytes(&request));
        }
}

TEST(modbus_rtu, refuses_units_that_answer_nothing_and_requests_out_of_range) {
    EXPECT_TRUE(encode(0, read_request(0, 1)).empty());
    EXPECT_TRUE(encode(248, read_request(0, 1)).empty());
    EXPECT_TRUE(encode(1, read_request(0, 0)).empty());
    EXPECT_TRUE(encode(1, read_request(0, 126)).empty());
}

struct decoded {
    cb_rtu_answer answer;
    std::vector<uint16_t> registers;
    uint8_t exception;
};

decoded decode(uint8_t unit, const cb_modbus_request &request, const bytes &frame) {
    decoded result{CB_RTU_INVALID, std::vector<uint16_t>(130, 0xEEEE), 0xEE};
    const bytes exact(frame);  // its own allocation, so that a sanitizer sees a read beyond it
    result.answer = cb_rtu_check(unit, exact.data(), exact.size());
    if (result.answer != CB_RTU_OK) return result;
    result.answer = cb_rtu_decode_sound(&request, exact.data(), exact.size(),
                                        result.registers.data(), &result.exception);
    return result;
}

TEST(modbus_rtu, decodes_replies) {
    const decoded read = decode(17, read_request(5, 2), reply_to(17, read_request(5, 2)));
    EXPECT_EQ(read.answer, CB_RTU_OK);
    EXPECT_EQ(read.registers[0], 0x4005);
    EXPECT_EQ(read.registers[1], 0x4006);
    EXPECT_EQ(read.registers[2], 0xEEEE);
    EXPECT_EQ(decode(17, write_request(), reply_to(17, write_request())).answer, CB_RTU_OK);
    EXPECT_EQ(decode(17, both_request(), reply_to(17, both_request())).registers[1], 0x4001);
    const decoded refused = decode(17, read_request(5, 2), with_crc({17, 0x83, 2}));
    EXPECT_EQ(refused.answer, CB_RTU_EXCEPTION);
    EXPECT_EQ(refused.exception, 2);
}

TEST(modbus_rtu, tells_what_is_wrong_with_a_reply) {
    const auto request = read_request(5, 2);
    const bytes good = reply_to(17, request);
    EXPECT_EQ(decode(17, request, {}).answer, CB_RTU_LENGTH);
    EXPECT_EQ(decode(17, request, {17, 3, 0}).answer, CB_RTU_LENGTH);
    EXPECT_EQ(decode(17, request, bytes(257, 3)).answer, CB_RTU_LENGTH);
    EXPECT_EQ(decode(17, request, bytes(good.begin(), good.end() - 1)).answer, CB_RTU_CRC);
    EXPECT_EQ(decode(18, request, good).answer, CB_RTU_UNIT);
    EXPECT_EQ(decode(17, read_request(5, 3), good).answer, CB_RTU_INVALID);
    EXPECT_EQ(decode(17, write_request(), good).answer, CB_RTU_INVALID);
}

// A CRC-16 finds every single and double bit error in frames this short.
TEST(modbus_rtu, finds_every_flipped_bit_and_pair_of_bits) {
    const auto request = read_request(5, 4);
    const bytes good = reply_to(17, request);
    const size_t bits = 8 * good.size();
    for (size_t a = 0; a < bits; ++a)
        for (size_t b = a; b < bits; ++b) {
            bytes bad = good;
            bad[a / 8] ^= static_cast<uint8_t>(1u << a % 8);
            if (b != a) bad[b / 8] ^= static_cast<uint8_t>(1u << b % 8);
            const decoded got = decode(17, request, bad);
            ASSERT_EQ(got.answer, CB_RTU_CRC) << a << ' ' << b;
            ASSERT_EQ(got.registers[0], 0xEEEE);
        }
}

// ---- the line ----

// 40 read and 10 written, 8E1: the times that were measured on lines of that speed.
TEST(rtu_line, exchange_times_are_those_of_the_wire) {
    auto read = read_request(0, 40);
    auto write = write_request();
    write.write_count = 10;
    const auto both_us = [&](uint32_t baud) {
        const cb_rtu_line line{baud, CB_PARITY_EVEN, 1};
        return cb_rtu_exchange_us(&line, &read, 0) + cb_rtu_exchange_us(&line, &write, 0);
    };
    EXPECT_NEAR(both_us(19200), 82500, 100);
    EXPECT_NEAR(both_us(38400), 44240, 100);
    EXPECT_NEAR(both_us(115200), 19410, 100);
    const cb_rtu_line line{115200, CB_PARITY_EVEN, 1};
    EXPECT_EQ(cb_rtu_exchange_us(&line, &read, 4000), cb_rtu_exchange_us(&line, &read, 0) + 4000);
}

TEST(rtu_line, characters_and_silences) {
    const cb_rtu_line even{19200, CB_PARITY_EVEN, 1}, none{19200, CB_PARITY_NONE, 1},
        two{9600, CB_PARITY_NONE, 2}, fast{38400, CB_PARITY_EVEN, 1};
    EXPECT_EQ(cb_rtu_character_bits(&even), 11u);
    EXPECT_EQ(cb_rtu_character_bits(&none), 10u);
    EXPECT_EQ(cb_rtu_character_bits(&two), 11u);
    EXPECT_EQ(cb_rtu_silences(&even).between_us, 2006u);  // 3.5 · 11 / 19 200
    EXPECT_EQ(cb_rtu_silences(&even).inside_us, 860u);
    EXPECT_EQ(cb_rtu_silences(&fast).between_us, 1750u);
    EXPECT_EQ(cb_rtu_silences(&fast).inside_us, 750u);
    const cb_rtu_line slowest{CB_RTU_LEAST_BAUD, CB_PARITY_EVEN, 2};
    EXPECT_EQ(cb_rtu_frame_us(&slowest, CB_RTU_MAX_FRAME), 2560000u);
}

// ---- reception ----

constexpr cb_rtu_silence SILENCE{750, 1750};
constexpr int CHARACTER_US = 96;

struct line {
    cb_rtu_receiver receiver{};
    int64_t now_us = 1000000;

    explicit line(const cb_modbus_request &request, uint8_t unit = 17) {
        cb_rtu_receiver_start(&receiver, SILENCE);
        cb_rtu_receiver_expect(&receiver, unit, &request, now_us);
        now_us += 3000;
    }
    cb_rtu_reception feed(const bytes &some) {
        cb_rtu_reception state = cb_rtu_receiver_look(&receiver, now_us);
        for (uint8_t byte : some)
            state = cb_rtu_receiver_byte(&receiver, byte, now_us += CHARACTER_US);
        return state;
    }
    cb_rtu_reception wait(int us) { return cb_rtu_receiver_look(&receiver, now_us += us); }
    decoded take() const {
        decoded result{CB_RTU_INVALID, std::vector<uint16_t>(130, 0xEEEE), 0xEE};
        result.answer = cb_rtu_receiver_take(&receiver, result.registers.data(), &result.exception);
        return result;
    }
};

TEST(rtu_receiver, takes_each_kind_of_reply_with_its_last_byte) {
    for (const auto &request : {read_request(5, 2), write_request(), both_request()}) {
        line wire(request);
        bytes reply = reply_to(17, request);
        const uint8_t last = reply.back();
        reply.pop_back();
        EXPECT_EQ(wire.feed(reply), CB_RTU_INSIDE);
        EXPECT_EQ(wire.feed({last}), CB_RTU_REPLY);
        EXPECT_EQ(wire.take().answer, CB_RTU_OK);
    }
}

TEST(rtu_receiver, takes_an_exception_though_it_is_shorter) {
    line wire(read_request(5, 20));
    EXPECT_EQ(wire.feed(with_crc({17, 0x83, 2})), CB_RTU_REPLY);
    EXPECT_EQ(wire.take().answer, CB_RTU_EXCEPTION);
    EXPECT_EQ(wire.take().exception, 2);
}

TEST(rtu_receiver, skips_noise_before_a_reply) {
    const auto request = read_request(5, 2);
    for (const bytes &noise : {bytes{0}, bytes{17}, bytes{17, 3}, bytes{17, 3, 4}, bytes{17, 0x83},
                               bytes{0xFF, 0, 0x80}, bytes(200, 17), bytes(300, 0x55)}) {
        line wire(request);
        wire.feed(noise);
        EXPECT_EQ(wire.feed(reply_to(17, request)), CB_RTU_REPLY);
        EXPECT_EQ(wire.take().answer, CB_RTU_OK);
        EXPECT_EQ(wire.receiver.noise, noise.size());
    }
}

TEST(rtu_receiver, noise_that_promised_a_long_reply_does_not_hide_an_exception) {
    line wire(read_request(5, 20));
    EXPECT_EQ(wire.feed(joined({17, 3, 40, 1, 2}, with_crc({17, 0x83, 4}))), CB_RTU_INSIDE);
    bytes rest(40, 0);
    EXPECT_EQ(wire.feed(rest), CB_RTU_REPLY);
    EXPECT_EQ(wire.take().exception, 4);
}

TEST(rtu_receiver, noise_that_ends_leaves_the_wait_as_it_was) {
    line wire(read_request(5, 2));
    EXPECT_EQ(wire.feed({17, 3}), CB_RTU_INSIDE);
    EXPECT_EQ(wire.wait(1749), CB_RTU_INSIDE);
    EXPECT_EQ(wire.wait(1), CB_RTU_WAITING);
    EXPECT_EQ(wire.feed(reply_to(17, read_request(5, 2))), CB_RTU_REPLY);
}

TEST(rtu_receiver, a_cut_reply_is_spoilt_once_it_is_silent) {
    line wire(read_request(5, 2));
    bytes cut = reply_to(17, read_request(5, 2));
    cut.resize(6);
    EXPECT_EQ(wire.feed(cut), CB_RTU_INSIDE);
    EXPECT_EQ(wire.wait(1750), CB_RTU_SPOILT);
    EXPECT_EQ(wire.take().answer, CB_RTU_CRC);
    EXPECT_EQ(wire.feed(reply_to(17, read_request(5, 2))), CB_RTU_SPOILT);  // too late for this one
}

// Then the slave has had its say. Anything else may be followed by more.
TEST(rtu_receiver, a_damaged_reply_is_distinguished_from_other_rubbish) {
    const auto request = read_request(5, 2);
    const bytes reply = reply_to(17, request);
    const auto damaged = [&](const bytes &came) {
        line wire(request);
        wire.feed(came);
        return cb_rtu_receiver_damaged(&wire.receiver);
    };
    EXPECT_FALSE(damaged(reply));
    EXPECT_FALSE(damaged({}));
    for (size_t at = 0; at < reply.size(); ++at) {
        bytes wrong = reply;
        wrong[at] ^= 1;
        EXPECT_EQ(damaged(wrong), at >= 3) << at;  // unit, function, count
        wrong.pop_back();
        EXPECT_FALSE(damaged(wrong)) << at;
    }
    bytes longer = reply;
    longer[4] ^= 1;
    longer.push_back(0);
    EXPECT_FALSE(damaged(longer));
    EXPECT_FALSE(damaged(reply_to(17, read_request(5, 3))));
}

TEST(rtu_receiver, a_reply_with_a_hole_is_none) {
    line wire(read_request(5, 2));
    const bytes reply = reply_to(17, read_request(5, 2));
    wire.feed(bytes(reply.begin(), reply.begin() + 5));
    wire.now_us += 750;
    EXPECT_EQ(wire.feed(bytes(reply.begin() + 5, reply.end())), CB_RTU_INSIDE);
    EXPECT_EQ(wire.wait(1750), CB_RTU_SPOILT);
    EXPECT_EQ(wire.take().answer, CB_RTU_INVALID);
    EXPECT_EQ(wire.take().registers[0], 0xEEEE);
    EXPECT_FALSE(cb_rtu_receiver_damaged(&wire.receiver)) << "its bytes are right";
}

TEST(rtu_receiver, says_why_something_is_no_reply) {
    const auto why = [](const bytes &came) {
        line wire(read_request(5, 2));
        EXPECT_EQ(wire.feed(came), CB_RTU_INSIDE);
        EXPECT_EQ(wire.wait(2000), CB_RTU_SPOILT);
        return wire.take().answer;
    };
    bytes bad = reply_to(17, read_request(5, 2));
    bad[4] ^= 4;
    EXPECT_EQ(why(bad), CB_RTU_CRC);
    EXPECT_EQ(why(reply_to(18, read_request(5, 2))), CB_RTU_UNIT);
    EXPECT_EQ(why(reply_to(17, read_request(5, 3))), CB_RTU_INVALID);
    EXPECT_EQ(why(reply_to(17, write_request())), CB_RTU_INVALID);
    EXPECT_EQ(line(read_request(5, 2)).take().answer, CB_RTU_LENGTH);
}

// An echo of our own request (two-wire RS-485 whose receiver stays on) is no reply, the reply is.
TEST(rtu_receiver, an_echo_of_the_request_is_skipped) {
    for (const auto &request : {read_request(5, 2), write_request(), both_request()}) {
        line wire(request);
        EXPECT_EQ(wire.feed(joined(encode(17, request), reply_to(17, request))), CB_RTU_REPLY);
        EXPECT_EQ(wire.take().answer, CB_RTU_OK);
    }
}

// Any bytes: no reply is ever made of them that the decoder would not take, and time moves on.
TEST(rtu_receiver, random_bytes_never_make_a_wrong_reply) {
    std::mt19937 dice(6);
    for (int run = 0; run < compbox_test::cases(2000); ++run) {
        const auto request = run % 2 ? read_request(5, 2) : write_request();
        line wire(request);
        for (int i = 0; i < 300; ++i) {
            const bytes head = encode(17, request);
            const uint8_t byte = dice() % 4 ? head[dice() % 6] : static_cast<uint8_t>(dice());
            if (wire.feed({byte}) == CB_RTU_REPLY) {
                const auto answer = wire.take().answer;
                ASSERT_TRUE(answer == CB_RTU_OK || answer == CB_RTU_EXCEPTION);
                break;
            }
            ASSERT_LE(wire.receiver.have, CB_RTU_MAX_FRAME);
            ASSERT_LE(wire.receiver.from, wire.receiver.have);
            if (dice() % 50 == 0) wire.wait(static_cast<int>(dice() % 3000));
        }
    }
}

}  // namespace
