// SPDX-License-Identifier: MIT
// fakeplc's bytes against bytes written by hand from the Modbus specification.
#include "host-tools/fakeplc/modbus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host-tools/fakeplc/fault.h"
#include "host-tools/fakeplc/number.h"
#include "host-tools/twin/random.h"
#include "tests/support/cases.h"
#include "tests/support/fakeplc_rig.h"

namespace compbox::fakeplc {
namespace {

using word_list = std::vector<std::uint16_t>;

// ---- numbers

TEST(Number, LiesInRegistersAsItsTypeSays) {
    EXPECT_EQ(format("int16").encode(-2.0), (word_list{0xFFFE}));
    EXPECT_EQ(format("uint16").encode(0x1234), (word_list{0x1234}));
    EXPECT_EQ(format("int16le").encode(0x1234), (word_list{0x3412}));
    EXPECT_EQ(format("uint32").encode(0x12345678), (word_list{0x1234, 0x5678}));
    EXPECT_EQ(format("uint32cdab").encode(0x12345678), (word_list{0x5678, 0x1234}));
    EXPECT_EQ(format("uint32le").encode(0x12345678), (word_list{0x7856, 0x3412}));
    EXPECT_EQ(format("int32").encode(-1000.0), (word_list{0xFFFF, 0xFC18}));
    EXPECT_EQ(format("int32le").encode(-1000.0), (word_list{0x18FC, 0xFFFF}));
    EXPECT_EQ(format("float32").encode(-1.5), (word_list{0xBFC0, 0x0000}));
    EXPECT_EQ(format("float32cdab").encode(-1.5), (word_list{0x0000, 0xBFC0}));
    EXPECT_EQ(format("float32le").encode(-1.5), (word_list{0x0000, 0xC0BF}));
}

TEST(Number, IsRoundedAndHeldInsideItsRange) {
    EXPECT_EQ(format("int16").encode(1.5), (word_list{2}));
    EXPECT_EQ(format("int16").encode(-1.5), (word_list{0xFFFE}));
    EXPECT_EQ(format("int16").encode(1e9), (word_list{0x7FFF}));
    EXPECT_EQ(format("int16").encode(-1e9), (word_list{0x8000}));
    EXPECT_EQ(format("uint16").encode(-1.0), (word_list{0}));
    EXPECT_EQ(format("int32").encode(-1e300), (word_list{0x8000, 0x0000}));
    EXPECT_EQ(format("uint32").encode(1e300), (word_list{0xFFFF, 0xFFFF}));
    EXPECT_EQ(format("int32").encode(std::nan("")), (word_list{0, 0}));
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(format("float32").encode(infinity), (word_list{0x7F7F, 0xFFFF}));
}

TEST(Number, ComesBackFromEveryType) {
    twin::random_stream random(3, "numbers");
    for (const char *base : {"int16", "uint16", "int32", "uint32", "float32"}) {
        for (const char *order : {"", "le", "cdab"}) {
            const auto found = number_format::parse(std::string(base) + order);
            if (!found) continue;
            const double span = found->registers == 1 ? 70000.0 : 5e9;
            for (int i = 0; i < 200; ++i) {
                double number = std::round(random.symmetric(span));
                number = std::max(found->lowest(), std::min(number, found->highest()));
                if (found->what == number_format::kind::floating) {
                    number = static_cast<double>(static_cast<float>(number));
                }
                EXPECT_EQ(found->decode(found->encode(number).data()), number) << base << order;
            }
        }
    }
}

TEST(Number, UnknownTypesAreNotTaken) {
    for (const char *name : {"", "int", "int8", "int16cdab", "float16", "int32abcd", "le", "cdab",
                             "int32lele", "float64", "INT16"}) {
        EXPECT_FALSE(number_format::parse(name)) << name;
    }
}

// ---- requests

const plc_profile generic = plc_profile::find("generic").value();
const plc_profile sinumerik = plc_profile::find("sinumerik-840d").value();
const plc_profile fanuc = plc_profile::find("fanuc").value();

modbus::bank bank_of(word_list registers) {
    return {registers, registers};
}

byte_string reply_to(const byte_string &request, modbus::bank &bank,
                     const plc_profile &profile = generic) {
    return modbus::answer(request, profile, bank);
}

TEST(Modbus, ExamplesOfTheSpecification) {
    modbus::bank bank = bank_of(word_list(200, 0));
    bank.now[107] = 0x022B, bank.now[108] = 0x0000, bank.now[109] = 0x0064;
    EXPECT_EQ(reply_to({0x03, 0x00, 0x6B, 0x00, 0x03}, bank),
              (byte_string{0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64}));
    EXPECT_EQ(reply_to({0x06, 0x00, 0x01, 0x00, 0x03}, bank),
              (byte_string{0x06, 0x00, 0x01, 0x00, 0x03}));
    EXPECT_EQ(bank.now[1], 3);
    EXPECT_EQ(reply_to({0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02}, bank),
              (byte_string{0x10, 0x00, 0x01, 0x00, 0x02}));
    EXPECT_EQ(bank.now[1], 0x000A);
    EXPECT_EQ(bank.now[2], 0x0102);
}

TEST(Modbus, WriteAndReadInOneRequestWritesFirst) {
    modbus::bank bank = bank_of({1, 2, 3, 4, 5, 6, 7, 8});
    EXPECT_EQ(reply_to({0x17, 0x00, 0x02, 0x00, 0x03, 0x00, 0x03, 0x00, 0x02, 0x04, 0xAA, 0xBB,
                        0xCC, 0xDD},
                       bank),
              (byte_string{0x17, 0x06, 0x00, 0x03, 0xAA, 0xBB, 0xCC, 0xDD}));
    EXPECT_EQ(bank.now, (word_list{1, 2, 3, 0xAABB, 0xCCDD, 6, 7, 8}));
}

TEST(Modbus, RefusesWithTheRightCodeAndChangesNothing) {
    const word_list before = {1, 2, 3, 4, 5, 6, 7, 8};
    const std::pair<byte_string, byte_string> cases[] = {
        {{0x03, 0, 0, 0, 0}, {0x83, 3}},          // no register
        {{0x03, 0, 0, 0, 126}, {0x83, 3}},        // too many
        {{0x03, 0, 7, 0, 2}, {0x83, 2}},          // past the end
        {{0x03, 0xFF, 0xFF, 0, 125}, {0x83, 2}},  // no wrap-around
        {{0x03, 0, 0, 0}, {0x83, 3}},             // cut off
        {{0x03, 0, 0, 0, 1, 0}, {0x83, 3}},       // too long
        {{0x03}, {0x83, 3}},
        {{0x04, 0, 7, 0, 2}, {0x84, 2}},
        {{0x06, 0, 8, 0, 1}, {0x86, 2}},
        {{0x06, 0, 0, 1}, {0x86, 3}},
        {{0x10, 0, 0, 0, 1, 4, 0, 1, 0, 2}, {0x90, 3}},  // byte count ≠ 2 × count
        {{0x10, 0, 0, 0, 2, 4, 0, 1, 0}, {0x90, 3}},     // fewer bytes than stated
        {{0x10, 0, 0, 0, 1, 2, 0, 1, 0}, {0x90, 3}},     // more bytes than stated
        {{0x10, 0, 0, 0, 0, 0}, {0x90, 3}},
        {{0x10, 0, 7, 0, 2, 4, 0, 1, 0, 2}, {0x90, 2}},
        {{0x17, 0, 0, 0, 1, 0, 7, 0, 2, 4, 0, 1, 0, 2}, {0x97, 2}},  // write past the end
        {{0x17, 0, 7, 0, 2, 0, 0, 0, 1, 2, 9, 9}, {0x97, 2}},        // read past the end
        {{0x17, 0, 0, 0, 1, 0, 0, 0, 1, 1, 9}, {0x97, 3}},
        {{0x17, 0, 0, 0, 126, 0, 0, 0, 1, 2, 9, 9}, {0x97, 3}},
        {{0x01, 0, 0, 0, 1}, {0x81, 1}},
        {{0x2B, 0x0E, 1, 0}, {0xAB, 1}},
        {{}, {0x80, 1}},
    };
    for (const auto &[request, reply] : cases) {
        modbus::bank bank = bank_of(before);
        EXPECT_EQ(reply_to(request, bank), reply) << testing::PrintToString(request);
        EXPECT_EQ(bank.now, before) << testing::PrintToString(request);
    }
}

TEST(Modbus, EachProfileServesItsFunctionCodesOnly) {
    const byte_string read = {3, 0, 0, 0, 1}, input = {4, 0, 0, 0, 1}, one = {6, 0, 0, 0, 1},
                      many = {16, 0, 0, 0, 1, 2, 0, 1},
                      both = {23, 0, 0, 0, 1, 0, 0, 0, 1, 2, 0, 1}, coils = {1, 0, 0, 0, 1},
                      identify = {43, 14, 1, 0};
    const std::tuple<plc_profile, byte_string, int> cases[] = {
        {generic, read, 0},   {generic, input, 0},  {generic, one, 0},     {generic, many, 0},
        {generic, both, 0},   {generic, coils, 1},  {sinumerik, read, 0},  {sinumerik, one, 0},
        {sinumerik, many, 0}, {sinumerik, both, 1}, {sinumerik, coils, 2}, {sinumerik, identify, 1},
        {fanuc, read, 0},     {fanuc, input, 1},    {fanuc, one, 1},       {fanuc, many, 0},
        {fanuc, both, 0},     {fanuc, coils, 1},
    };
    for (const auto &[profile, request, code] : cases) {
        modbus::bank bank = bank_of({0, 0});
        const byte_string reply = reply_to(request, bank, profile);
        const int got = reply[0] & 0x80 ? reply[1] : 0;
        EXPECT_EQ(got, code) << profile.name << " " << int{request[0]};
    }
}

TEST(Modbus, LongestReadingFillsAWholePdu) {
    modbus::bank bank = bank_of(word_list(200, 0xABCD));
    EXPECT_EQ(reply_to({3, 0, 0, 0, 125}, bank).size(), 252u);
}

TEST(Modbus, ATornReadingShowsTwoUpdates) {
    modbus::bank bank{{1, 1, 1, 1, 1}, {0, 0, 0, 0, 0}};
    EXPECT_EQ(modbus::answer({3, 0, 0, 0, 5}, generic, bank, true),
              (byte_string{3, 10, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0}));
}

// ---- frames

TEST(Frame, IsFoundOnlyWhenWhole) {
    const byte_string frame = {0x12, 0x34, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
    for (std::size_t size = 0; size < frame.size(); ++size) {
        const byte_string part(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_EQ(modbus::frame_at_start(part).what, modbus::frame_state::incomplete) << size;
    }
    byte_string two = frame;
    two.insert(two.end(), frame.begin(), frame.end());
    EXPECT_EQ(modbus::frame_at_start(two).what, modbus::frame_state::complete);
    EXPECT_EQ(modbus::frame_at_start(two).size, 12u);
    EXPECT_EQ(modbus::frame(frame, {3, 2, 0xAB, 0xCD}),
              (byte_string{0x12, 0x34, 0, 0, 0, 5, 1, 3, 2, 0xAB, 0xCD}));
}

TEST(Frame, IsBrokenWhenItsHeaderCannotBeRight) {
    for (const byte_string &bad : {byte_string{0, 1, 0, 1, 0, 6}, byte_string{0, 1, 0, 0, 0, 1},
                                   byte_string{0, 1, 0, 0, 0, 0}, byte_string{0, 1, 0, 0, 0, 255},
                                   byte_string{0, 1, 0, 0, 0xFF, 0xFF}}) {
        EXPECT_EQ(modbus::frame_at_start(bad).what, modbus::frame_state::broken);
    }
}

// Any bytes: an answer, never a read or write outside, and exceptions change nothing.
TEST(Frame, RandomRequestsAlwaysGetAProperReply) {
    twin::random_stream random(11, "requests");
    const std::uint8_t codes[] = {1, 3, 4, 6, 16, 23, 43};
    for (int i = 0; i < compbox_test::cases(200000); ++i) {
        byte_string request;
        const auto size = 1 + random.next() % 24;
        for (std::size_t b = 0; b < size; ++b) {
            // Small numbers are the interesting ones.
            const bool small = random.next() % 2;
            request.push_back(static_cast<std::uint8_t>(random.next() % (small ? 4 : 256)));
        }
        request[0] = codes[random.next() % 7];
        modbus::bank bank = bank_of({1, 2, 3, 4, 5, 6, 7, 8});
        const modbus::bank before = bank;
        const byte_string reply = reply_to(request, bank);
        ASSERT_GE(reply.size(), 2u);
        ASSERT_LE(reply.size(), 253u);
        ASSERT_EQ(reply[0] & 0x7F, request[0]);
        ASSERT_EQ(bank.now.size(), 8u);
        if (reply[0] & 0x80) {
            ASSERT_EQ(bank.now, before.now);
        }
        if (modbus::reads(reply[0])) {
            ASSERT_EQ(reply.size(), 2u + reply[1]);
        }
    }
}

// ---- faults

TEST(Fault, MeetsTheRequestsItIsFor) {
    fault_plan plan;
    plan.add({fault_kind::drop, 0, false, true}, 2);
    plan.add({fault_kind::torn}, 1);
    EXPECT_EQ(plan.take(3)->kind, fault_kind::torn);
    EXPECT_FALSE(plan.take(3));
    EXPECT_EQ(plan.take(16)->kind, fault_kind::drop);
    EXPECT_EQ(plan.take(23)->kind, fault_kind::drop);
    EXPECT_FALSE(plan.take(16));
    plan.add({fault_kind::torn}, 1);
    EXPECT_FALSE(plan.take(16));  // a write has nothing to tear
    plan.clear();
    EXPECT_FALSE(plan.take(3));
}

TEST(Fault, SpoilsTheReplyAsSaid) {
    const byte_string frame = {0, 0xFF, 0, 0, 0, 7, 1, 3, 4, 0xAA, 0xAB, 0xBA, 0xBB};
    const auto only = [&](const fault &what) { return spoil(frame, what).at(0).bytes; };
    EXPECT_EQ(only({fault_kind::wrong_id})[1], 0);
    EXPECT_EQ(only({fault_kind::truncate}), byte_string(frame.begin(), frame.begin() + 6));
    EXPECT_EQ(only({fault_kind::too_short}),
              (byte_string{0, 0xFF, 0, 0, 0, 5, 1, 3, 2, 0xAA, 0xAB}));
    EXPECT_EQ(only({fault_kind::too_long}),
              (byte_string{0, 0xFF, 0, 0, 0, 9, 1, 3, 6, 0xAA, 0xAB, 0xBA, 0xBB, 0, 0}));
    EXPECT_TRUE(spoil(frame, fault{fault_kind::drop}).empty());
    EXPECT_EQ(spoil(frame, fault{fault_kind::late, 7}).at(0).delay_ms, 7);
    const auto drops = spoil(frame, fault{fault_kind::dribble, 5});
    ASSERT_EQ(drops.size(), frame.size());
    EXPECT_EQ(drops[12].delay_ms, 60);
    EXPECT_EQ(spoil(frame, std::nullopt).at(0).bytes, frame);
}

}  // namespace
}  // namespace compbox::fakeplc
