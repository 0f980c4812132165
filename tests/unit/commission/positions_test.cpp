// SPDX-License-Identifier: MIT
// A register beside the control's display, and positions before and after a jog.
#include "host-tools/commission/positions.h"

#include <gtest/gtest.h>

#include <cmath>

extern "C" {
#include "firmware/config/config.h"
}
#include "host-tools/coefficients/machine_file.h"
#include "host-tools/commission/table.h"
#include "host-tools/formats/error.h"

namespace compbox {
namespace {

using commission::map_row;

// A position at register 108, the second in its block.
map_row position(double value, cb_number_type type = CB_NUMBER_INT32) {
    map_row row;
    row.name = "X";
    row.unit = "mm";
    row.index = 2;
    row.address = 108;
    row.type = type;
    row.scale = 0.0001;
    row.signal = 0;
    row.value = value;
    row.seen = true;
    return row;
}

// in : the value that register and type of the row have in a block with 12.5 mm at 106
std::string fault(double value, double shown, int decimals = 4,
                  cb_number_type type = CB_NUMBER_INT32) {
    const std::vector<std::uint16_t> block = {0x0001, 0xE848, 0, 0, 0, 0};
    return commission::display_fault(position(value, type), commission::shown_as(shown, decimals),
                                     block, 106);
}

bool has(const std::string &text, const std::string &piece) {
    return text.find(piece) != std::string::npos;
}

TEST(positions, the_digits_of_the_display_are_the_tolerance) {
    EXPECT_EQ(fault(12.5004, 12.5, 1), "");
    EXPECT_EQ(fault(12.6, 12.5, 1), "");
    EXPECT_NE(fault(12.61, 12.5, 1), "");
    EXPECT_NE(fault(12.5004, 12.5, 4), "");
    EXPECT_EQ(fault(12.5001, 12.5, 4), "") << "two units of the register";
    EXPECT_NE(fault(12.5, 12, 0), "") << "a whole number is no millimetre wide";
    EXPECT_NE(fault(std::nan(""), 12.5), "");
}

TEST(positions, a_difference_is_named_with_its_cause_and_key) {
    EXPECT_EQ(
        fault(125.0, 12.5),
        "signals.X: the control shows 12.5 mm, registers 108 and 109 give (int32) 125; 10 times "
        "too large: look at scale");
    EXPECT_TRUE(has(fault(0.0125, 12.5), "1000 times too small: look at scale"));
    EXPECT_TRUE(has(fault(-12.5, 12.5), "its sign is inverted"));
    EXPECT_TRUE(has(fault(12.5 / 25.4, 12.5), "it is in inches"));
    EXPECT_TRUE(has(fault(0.0, 12.5), "register 106 as int32 has the value: look at plc"));
    EXPECT_TRUE(has(fault(0.0, 7.0), "look at plc, type, scale and zero")) << "no register has it";
    EXPECT_TRUE(has(fault(5.0, 0.0), "look at plc, type, scale and zero")) << "0 names no register";
}

// Moves of X, Y and Z, mm. out: the fault of the jog of X by 10 mm or more
std::string jogged(const commission::places &to, const commission::stages &together = {}) {
    std::vector<map_row> rows = {position(0), position(0), position(0)};
    rows[1].name = "Y";
    rows[2].name = "Z";
    const std::vector<const map_row *> all = {&rows[0], &rows[1], &rows[2]};
    const std::string fault = commission::others_fault(all, 0, {1, 2, 3}, to, together);
    return fault.empty() ? commission::way_fault(rows[0], to[0] - 1, 10.0) : fault;
}

TEST(positions, a_jog_moves_its_signal_and_no_other) {
    EXPECT_EQ(jogged({11, 2, 3}), "");
    EXPECT_EQ(jogged({-9, 2.04, 3}), "") << "down, and a standing axis that dithers";
    EXPECT_TRUE(has(jogged({10.9, 2, 3}), "X moved by 9.9000 mm where 10 or more are needed"));
    EXPECT_TRUE(has(jogged({1, 12, 3}), "the jog moved Y by 10.0000 mm and X not at all"));
    EXPECT_TRUE(has(jogged({11, 2, -7}), "moved X by 10.0000 mm, but also Z by -10.0000 mm"));
    EXPECT_EQ(jogged({11, 12, 3}, {{"X", "Y"}}), "") << "two motors of one stage";
    EXPECT_TRUE(has(jogged({11, 12, 3}, {{"Y", "Z"}}), "but also Y"));
}

json mill() {
    coefficients::machine_options options;
    options.axes = "XYZ";
    options.host = "127.0.0.1";
    options.travel = {{"X", {0, 500}}, {"Y", {-20, 20}}};
    return coefficients::new_machine(options);
}

// out: the refusal of a file whose signal X has these keys; "": none
std::string refused(const json &keys) {
    json document = mill();
    document["signals"][0].update(keys);
    const auto setup = commission::make_box_setup(document, "m.json", 50.0);
    try {
        commission::check_ranges(setup, commission::register_map(setup).signals());
    } catch (const input_error &error) {
        return error.what();
    }
    return "";
}

TEST(positions, a_number_reaches_over_the_range_of_its_signal) {
    EXPECT_EQ(refused(json::object()), "");
    EXPECT_EQ(refused({{"type", "uint32"}}), "") << "min is the margin of 10 mm below 0";
    EXPECT_EQ(refused({{"type", "int16"}, {"scale", 0.02}}), "");
    EXPECT_EQ(
        refused({{"type", "int16"}}),
        "signals.X.type: int16 with this scale reaches from -3.2768 to 3.2767 mm only; min and "
        "max of the signal are beyond that");
    const json open = {{"min", nullptr}, {"max", nullptr}};
    json narrow = {{"type", "uint16"}};
    narrow.update(open);
    EXPECT_EQ(refused(open), "");
    EXPECT_TRUE(has(refused(narrow), "min and max of the signal must state the travel"));
    EXPECT_TRUE(has(refused({{"unit", "um"}}), "signals.X.unit: the position of an axis is in mm"));
}

TEST(positions, a_jog_is_a_quarter_of_a_short_travel) {
    const auto setup = commission::make_box_setup(mill(), "m.json", 50.0);
    EXPECT_EQ(commission::least_jog(setup.config->signals[0]), 10.0);
    EXPECT_EQ(commission::least_jog(setup.config->signals[2]), 10.0) << "no range";
    cb_signal_config tool_slide = setup.config->signals[1];
    tool_slide.min = -4.0f;
    tool_slide.max = 4.0f;
    EXPECT_EQ(commission::least_jog(tool_slide), 2.0);
}

TEST(register_map, has_each_register_of_the_file_by_name_in_the_order_of_its_block) {
    const auto setup = commission::make_box_setup(mill(), "m.json", 50.0);
    const commission::register_map map(setup);
    std::string text;
    for (const auto &row : map.rows()) text += fmt::format("{} {}, ", row.address, row.name);
    EXPECT_EQ(text,
              "0 control word, 1 PLC heartbeat, 8 X, 10 Y, 12 Z, 24 X applied, 26 Y applied, "
              "28 Z applied, 100 status, 101 box heartbeat, 104 X offset, 106 Y offset, "
              "108 Z offset, ");
    EXPECT_EQ(map.signals().size(), 3u);
    EXPECT_EQ(commission::value_text(map.rows()[2]), "-") << "not read yet";
}

TEST(register_map, words_of_bits_and_numbers_with_units_are_text) {
    map_row word;
    word.name = "control word";
    word.raw = {0x000B};
    word.seen = true;
    EXPECT_EQ(commission::value_text(word), "enable referenced permit");
    word.raw = {0x0010};
    EXPECT_EQ(commission::value_text(word), "none set");
    EXPECT_EQ(commission::value_text([] {
                  auto row = position(-12.5);
                  row.raw = {0, 0};
                  return row;
              }()),
              "-12.5000 mm");
}

}  // namespace
}  // namespace compbox
