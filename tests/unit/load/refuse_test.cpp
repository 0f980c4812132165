// SPDX-License-Identifier: MIT
// Every mistake gives its sentence at its place, and what the target cannot do is refused.
#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "tests/support/cases.h"
#include "tests/support/config_fixture.h"
#include "tests/support/dice.h"
#include "tests/support/paths.h"

extern "C" {
#include "firmware/load/host.h"
}

using namespace compbox_test;

namespace {

std::string refusal(const loaded &got) {
    return std::to_string(got.line) + ":" + std::to_string(got.column) + " " +
           compbox_test::error_name(got.error) + " " + got.text;
}

TEST(config_refuse, every_mistake_of_the_table) {
    std::ifstream file(from_source("tests/unit/load/refused.txt"));
    int cases = 0;
    for (std::string piece, other, expected; std::getline(file, piece);) {
        if (piece.empty() || piece[0] == '#') continue;
        ASSERT_TRUE(std::getline(file, other) && std::getline(file, expected)) << piece;
        EXPECT_EQ(refusal(load(with(piece, other))), expected) << "instead of " << piece;
        ++cases;
    }
    EXPECT_GT(cases, 200) << "the table is not read to its end";
}

TEST(config_refuse, mistakes_of_the_file_as_a_whole) {
    EXPECT_EQ(refusal(load("")), "0:0 CB_ERROR_EMPTY the file is empty");
    EXPECT_EQ(refusal(load(" \r\n\t\n")), "0:0 CB_ERROR_EMPTY the file is empty");
    EXPECT_EQ(refusal(load("[]")), "1:1 CB_ERROR_TYPE must be an object {…}, not a list […]");
    EXPECT_EQ(refusal(load("7")), "1:1 CB_ERROR_TYPE must be an object {…}, not 7");
    EXPECT_EQ(refusal(load("{}")), "1:1 CB_ERROR_KEY the key format is missing");
    EXPECT_EQ(refusal(load("hello")),
              "1:1 CB_ERROR_SYNTAX a value is expected here: an object, an array, a text in double "
              "quotes, a number, true, false or null");
    EXPECT_EQ(refusal(load(full_example + "x")),
              "42:1 CB_ERROR_SYNTAX the file must end after its last }");
    EXPECT_EQ(refusal(load("\xEF\xBB\xBF" + full_example)),
              "1:1 CB_ERROR_SYNTAX a byte order mark or another stray character; save the file as "
              "plain UTF-8");
    EXPECT_EQ(refusal(load(std::string("{\"a\": \0", 7))),
              "1:7 CB_ERROR_SYNTAX a: a value is expected here: an object, an array, a text in "
              "double quotes, a number, true, false or null");
    EXPECT_EQ(refusal(load(with("nobody",
                                "no\x01"
                                "body"))),
              "40:27 CB_ERROR_SYNTAX provenance.by: a control character inside a text; is a quote "
              "missing?");
    EXPECT_EQ(refusal(load(with("nobody",
                                "no\xff"
                                "body"))),
              "40:27 CB_ERROR_SYNTAX provenance.by: a byte that is not UTF-8; save the file as "
              "UTF-8");
}

TEST(config_refuse, the_place_counts_lines_of_any_kind) {
    std::string text = with("\"revision\": 7", "\"revision\": true");
    EXPECT_EQ(refusal(load(text)), "3:15 CB_ERROR_TYPE revision: must be a whole number, not true");
    std::string windows;
    for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
    EXPECT_EQ(refusal(load(windows)), refusal(load(text)));
    std::string one_line;
    for (const char c : text) one_line += c == '\n' ? ' ' : c;
    EXPECT_EQ(load(one_line).line, 1u);
    EXPECT_EQ(load(one_line).column, text.find("true,\n") + 1);
}

TEST(config_refuse, any_blank_before_a_comma) {
    for (const char blank : {' ', '\t', '\r', '\n'})
        EXPECT_EQ(load(with("240, 500]", std::string("240") + blank + ", NaN]")).text,
                  "terms[1].positions[2]: NaN is not a number of JSON");
}

// DEL, C1, separators of lines and marks of direction: what a terminal obeys instead of showing it.
TEST(config_refuse, no_text_has_a_control_character_and_no_message_repeats_one) {
    for (const std::string one :
         {"\x7f", "\u0080", "\u0085", "\u009b", "\u009f", "\u061c", "\u200e", "\u200f", "\u2028",
          "\u2029", "\u202a", "\u202e", "\u2066", "\u2069"}) {
        EXPECT_EQ(refusal(load(with("gantry 14 m", "a" + one + "b"))),
                  "4:23 CB_ERROR_NAME machine.name: \"a?b\" contains a control character");
        EXPECT_EQ(
            refusal(load(with("\"name\": \"gantry", "\"a" + one + "b\": 1, \"name\": \"gantry"))),
            "4:15 CB_ERROR_KEY machine.a?b: unknown key");
    }
    for (const std::string one : {" ", "~", "\u00a0", "\u00b0", "\u0444", "\u061b", "\u200d",
                                  "\u2010", "\u202f", "\u2065", "\u206a", "\U0001f600"}) {
        EXPECT_EQ(load(with("gantry 14 m", "a" + one + "b")).error, CB_OK) << one;
    }
}

// A message is always whole UTF-8 and ends, however long what it quotes.
TEST(config_refuse, long_messages_are_cut_between_characters) {
    std::string smileys;
    for (int i = 0; i < 60; ++i) smileys += "😀";
    for (size_t shift = 0; shift < 8; ++shift) {
        const std::string key = std::string(shift, 'k') + smileys;
        std::string text =
            with("\"by\": \"nobody\"", "\"" + key + "\": {\"" + key + "\": {\"" + key + "\": {\"" +
                                           key + "\": {\"" + key + "\": {\"" + key + "\": {\"" +
                                           key + "\": nothing}}}}}}");
        const auto got = load(text);
        EXPECT_EQ(got.error, CB_ERROR_SYNTAX);
        EXPECT_LT(got.text.size(), sizeof(cb_message::text));
        EXPECT_GT(got.text.size(), sizeof(cb_message::text) - 8);
        EXPECT_EQ(got.text.substr(got.text.size() - 3), "…");
        for (size_t i = 0; i < got.text.size();) {
            const auto first = static_cast<unsigned char>(got.text[i]);
            const size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
            ASSERT_LE(i + length, got.text.size()) << got.text;
            i += length;
        }
    }
}

TEST(config_refuse, what_the_target_does_not_have) {
    const uint8_t all = every_target.sources, plc = 1u << CB_SOURCE_PLC;
    const cb_target no_can = {"little-box", static_cast<uint8_t>(all & ~(1u << CB_SOURCE_CAN)),
                              1u << CB_TRANSPORT_TCP, 0};
    const cb_target no_bus = {"little-box", static_cast<uint8_t>(all & ~(1u << CB_SOURCE_BUS)),
                              1u << CB_TRANSPORT_TCP, 0};
    const cb_target no_net = {"little-box", plc, 1u << CB_TRANSPORT_RTU, 0};
    const cb_target no_stack = {"little-box", all, 1u << CB_TRANSPORT_TCP,
                                1u << CB_CLIENT_LIBMODBUS};
    EXPECT_EQ(refusal(load(full_example, no_can)),
              "16:43 CB_ERROR_PROFILE signals[1].can: little-box reads no CAN bus in this version");
    EXPECT_EQ(refusal(load(full_example, no_bus)),
              "38:77 CB_ERROR_PROFILE buses[0]: little-box reads no sensor bus in this version");
    EXPECT_EQ(refusal(load(full_example, no_net)),
              "8:26 CB_ERROR_PROFILE plc.transport.tcp: little-box has no network");
    EXPECT_EQ(load(with("\"unit\": 1}}", "\"unit\": 1, \"client\": \"compbox\"}}"), no_stack).error,
              CB_OK);
    EXPECT_EQ(
        refusal(load(with("\"unit\": 1}}", "\"unit\": 1, \"client\": \"libmodbus\"}}"), no_stack)),
        "8:83 CB_ERROR_PROFILE plc.transport.tcp.client: little-box was built without "
        "\"libmodbus\"; omit it, or install the Debian package");
}

TEST(config_refuse, counters_and_nothing_else_in_the_read_block) {
    const auto text = with("\"count\": 32}", "\"count\": 32, \"counters\": true}");
    EXPECT_EQ(refusal(load(text)),
              "11:16 CB_ERROR_OVERLAP plc.control: register 0 already belongs to a block counter "
              "(counters)");
    EXPECT_EQ(
        refusal(load(
            with("\"control\": 0", "\"control\": 2", with("\"plc\": 10,", "\"plc\": 30,", text)))),
        "20:41 CB_ERROR_OVERLAP signals[3].plc: register 31 already belongs to a block counter "
        "(counters)");
    EXPECT_EQ(load(with("\"control\": 0", "\"control\": 2", text)).error, CB_OK);
}

// inet_pton is the judge of what is an address in numbers.
TEST(config_refuse, numeric_addresses_as_inet_pton_sees_them) {
    const auto judge = [](const std::string &text) {
        unsigned char bytes[16];
        return inet_pton(AF_INET, text.c_str(), bytes) == 1 ||
               inet_pton(AF_INET6, text.c_str(), bytes) == 1;
    };
    const std::vector<std::string> pieces = {":",   "::",      ".", "0",    "1",     "12", "255",
                                             "256", "01",      "f", "ffff", "12345", "AF", "G",
                                             "@",   "1.2.3.4", "%", "g",    "-"};
    dice random(11);
    int good = 0;
    for (int i = 0; i < compbox_test::cases(300000); ++i) {
        std::string text;
        for (uint32_t k = random(18u); k > 0; --k)
            text += k % 2 && random(4u) ? (random(4u) ? ":" : ".") : pieces[random(pieces.size())];
        ASSERT_EQ(cb_is_numeric_address(text.c_str()), judge(text)) << text;
        good += judge(text);
    }
    EXPECT_GT(good, compbox_test::cases(1000));
}

}  // namespace
