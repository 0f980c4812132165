// SPDX-License-Identifier: MIT
// Values and texts of compbox plc, held against the box's codec and libmodbus' own.
#include "host-tools/plc/items.h"

#include <gtest/gtest.h>
#include <modbus/modbus.h>

#include <cmath>
#include <random>

#include "host-tools/formats/json.h"
#include "host-tools/plc/machine.h"

extern "C" {
#include "firmware/wire/number.h"
}

namespace compbox::plc {
namespace {

item item_of(const std::string &type, double scale = 1.0, double zero = 0.0) {
    item made;
    made.address = 7;
    made.format = fakeplc::number_format::parse(type).value();
    made.scale = scale;
    made.zero = zero;
    return made;
}

words_at words_from_7(std::uint16_t first, std::uint16_t second) {
    return {{7, first}, {8, second}};
}

std::string refusal_of(const item &to, const std::string &text) {
    try {
        encode(to, text);
    } catch (const input_error &error) {
        return error.what();
    }
    return "accepted";
}

std::string wire_fault(const std::string &text) {
    try {
        parse_wire(text);
    } catch (const input_error &error) {
        return error.what();
    }
    return "accepted";
}

// The type words of the coefficient file.
const std::map<std::string, cb_number_type> types = {
    {"uint16", CB_NUMBER_UINT16},        {"int16", CB_NUMBER_INT16},
    {"uint32", CB_NUMBER_UINT32},        {"int32", CB_NUMBER_INT32},
    {"float32", CB_NUMBER_FLOAT32},      {"uint32cdab", CB_NUMBER_UINT32_CDAB},
    {"int32cdab", CB_NUMBER_INT32_CDAB}, {"float32cdab", CB_NUMBER_FLOAT32_CDAB},
    {"uint16le", CB_NUMBER_UINT16_LE},   {"int16le", CB_NUMBER_INT16_LE},
    {"uint32le", CB_NUMBER_UINT32_LE},   {"int32le", CB_NUMBER_INT32_LE},
    {"float32le", CB_NUMBER_FLOAT32_LE},
};

TEST(plc_items, every_type_of_the_coefficient_file_has_the_value_that_the_box_decodes) {
    std::mt19937 dice(1);
    for (const auto &[word, type] : types) {
        const item one = item_of(word);
        ASSERT_EQ(cb_number_registers(type), static_cast<unsigned>(one.format.registers)) << word;
        for (int i = 0; i < 2000; ++i) {
            const std::uint16_t words[2] = {static_cast<std::uint16_t>(dice()),
                                            static_cast<std::uint16_t>(dice())};
            const float box = cb_number_decode(type, words);
            const auto own = static_cast<float>(value_of(one, words_from_7(words[0], words[1])));
            ASSERT_TRUE(box == own || (std::isnan(box) && std::isnan(own))) << word << " " << box;
        }
    }
}

TEST(plc_items, floats_are_those_that_libmodbus_decodes_from_the_same_registers) {
    std::mt19937 dice(2);
    const std::map<std::string, float (*)(const std::uint16_t *)> of_libmodbus = {
        {"float32", modbus_get_float_abcd},
        {"float32cdab", modbus_get_float_cdab},
        {"float32le", modbus_get_float_dcba}};
    for (const auto &[word, decode] : of_libmodbus) {
        for (int i = 0; i < 2000; ++i) {
            const std::uint16_t words[2] = {static_cast<std::uint16_t>(dice()),
                                            static_cast<std::uint16_t>(dice())};
            const auto theirs = static_cast<double>(decode(words));
            const double own = value_of(item_of(word), words_from_7(words[0], words[1]));
            ASSERT_TRUE(theirs == own || (std::isnan(theirs) && std::isnan(own))) << word;
        }
    }
}

TEST(plc_items, a_typed_number_comes_back_from_its_registers) {
    for (const auto &[word, type] : types) {
        (void)type;
        const item one = item_of(word, 0.5, 10.0);
        for (const char *text : {"10", "110.5", "+12"}) {
            const auto words = encode(one, text);
            words_at at;
            for (const auto w : words) at[7 + static_cast<int>(at.size())] = w;
            EXPECT_EQ(value_of(one, at), std::stod(text)) << word;
        }
    }
    EXPECT_EQ(encode(item_of("uint16"), "0xff"), std::vector<std::uint16_t>{0x00ff});
    EXPECT_EQ(encode(item_of("int32"), "-2"), (std::vector<std::uint16_t>{0xffff, 0xfffe}));
}

TEST(plc_items, a_value_that_its_registers_cannot_hold_is_refused_with_the_range) {
    EXPECT_EQ(refusal_of(item_of("uint16"), "65536"),
              "register 7: 65536 is outside what its type holds, 0 to 65535");
    EXPECT_EQ(refusal_of(item_of("int16", 0.1), "3276.8"),
              "register 7: 3276.8 is outside what its type holds, -3276.8 to 3276.7");
    EXPECT_EQ(refusal_of(item_of("int16"), "1.5"),
              "register 7: 1.5 has a fraction, and the type is an integer; give --scale, or --type "
              "float32");
    for (const char *text : {"", "x", "1,5", "nan", "inf", "1 ", "0x", "--1"}) {
        EXPECT_EQ(
            refusal_of(item_of("float32"), text),
            "register 7: '" + std::string(text) + "' is not a number; write 12.5, -3 or 0x00ff");
    }
    EXPECT_NE(refusal_of(item_of("float32"), "1e39"), "accepted");
}

TEST(plc_items, a_coil_is_0_or_1) {
    item coil = item_of("uint16");
    coil.from = table::coil;
    EXPECT_EQ(refusal_of(coil, "2"), "register 7: a bit is 0 or 1, not 2");
    EXPECT_EQ(encode(coil, "1"), std::vector<std::uint16_t>{1});
}

TEST(plc_items, texts_show_value_unit_and_registers) {
    item one = item_of("int32", 0.0001);
    one.name = "X";
    one.unit = "mm";
    const words_at words = words_from_7(0x0001, 0xe240);
    EXPECT_EQ(value_text(one, words), "12.3456 mm");
    EXPECT_EQ(raw_text(one, words), "0x0001 0xe240");
    EXPECT_EQ(one.place(), "7 (X)");
    EXPECT_EQ(item_figures(one, words).dump(),
              R"({"address":7,"name":"X","value":12.3456,"unit":"mm","registers":[1,57920]})");
    const words_at nan = words_from_7(0x7fc0, 0);
    EXPECT_TRUE(item_figures(item_of("float32"), nan)["value"].is_null());
}

TEST(plc_wire, a_server_is_a_host_with_or_without_port_or_a_device) {
    EXPECT_EQ(parse_wire("192.168.0.10").name(), "192.168.0.10:502");
    EXPECT_EQ(parse_wire("plc:1502").name(), "plc:1502");
    EXPECT_EQ(parse_wire("::1").name(), "[::1]:502");
    EXPECT_EQ(parse_wire("[fe80::2]:1502").name(), "[fe80::2]:1502");
    EXPECT_EQ(parse_wire("[::1]").name(), "[::1]:502");
    EXPECT_TRUE(parse_wire("/dev/ttyUSB0").is_serial());
    for (const char *text : {"plc:", "plc:0", "plc:65536", "plc:x", "[::1]:", "[::1]502"}) {
        EXPECT_EQ(wire_fault(text),
                  std::string(text) +
                      ": the port must be a number from 1 to 65535, as in 192.168.0.10:502 or "
                      "[fd00::1]:502");
    }
}

}  // namespace
}  // namespace compbox::plc
