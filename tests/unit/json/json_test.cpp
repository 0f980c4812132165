// SPDX-License-Identifier: MIT
// The box's own JSON reader; nlohmann-json is the independent judge of what is JSON.
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/cases.h"
#include "tests/support/dice.h"

extern "C" {
#include "firmware/json/json.h"
}

namespace {

struct parsed {
    bool good;
    std::string tokens;  // one letter for each token
    std::string mistake;
    uint32_t line, column;
};

parsed parse(const std::string &text) {
    const std::unique_ptr<char[]> exact(new char[text.size() + (text.empty() ? 1 : 0)]);
    text.copy(exact.get(), text.size());
    cb_json json;
    cb_json_start(&json, exact.get(), static_cast<uint32_t>(text.size()), 0);
    parsed result = {false, "", "", 0, 0};
    for (;;) {
        const cb_json_token token = cb_json_next(&json);
        result.tokens += "{}[]ksntf0.!"[token.kind];
        EXPECT_LE(token.at + token.length, text.size());
        if (token.kind == CB_JSON_END) result.good = true;
        if (token.kind == CB_JSON_BAD) {
            result.mistake = json.mistake;
            const cb_json_place place = cb_json_locate(exact.get(), token.at);
            result.line = place.line;
            result.column = place.column;
            EXPECT_EQ(cb_json_next(&json).kind, CB_JSON_BAD) << "a mistake is final";
        }
        if (token.kind == CB_JSON_END || token.kind == CB_JSON_BAD) return result;
    }
}

// The judge, with the two things in which it is no pure judge of syntax taken out: it skips a byte
// order mark, and it stops at a number beyond double, whatever comes after it.
enum class verdict { json, not_json, undecided };

verdict judge(const std::string &text) {
    if (text.compare(0, 3, "\xEF\xBB\xBF") == 0) return verdict::not_json;
    struct sax : nlohmann::json_sax<nlohmann::json> {
        bool null() override { return true; }
        bool boolean(bool) override { return true; }
        bool number_integer(number_integer_t) override { return true; }
        bool number_unsigned(number_unsigned_t) override { return true; }
        bool number_float(number_float_t, const string_t &) override { return true; }
        bool string(string_t &) override { return true; }
        bool binary(binary_t &) override { return true; }
        bool start_object(std::size_t) override { return ++depth <= CB_JSON_MAX_DEPTH; }
        bool key(string_t &) override { return true; }
        bool end_object() override { return depth-- > 0; }
        bool start_array(std::size_t) override { return ++depth <= CB_JSON_MAX_DEPTH; }
        bool end_array() override { return depth-- > 0; }
        bool parse_error(std::size_t, const std::string &,
                         const nlohmann::detail::exception &error) override {
            too_large = error.id == 406;
            return false;
        }
        int depth = 0;
        bool too_large = false;
    } sax;
    if (nlohmann::json::sax_parse(text, &sax)) return verdict::json;
    return sax.too_large ? verdict::undecided : verdict::not_json;
}

::testing::AssertionResult agrees(const std::string &text) {
    const verdict expected = judge(text);
    const parsed got = parse(text);
    if (expected == verdict::undecided || got.good == (expected == verdict::json))
        return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure()
           << (got.good ? "accepted: " : "refused: ") << text << "  " << got.mistake;
}

TEST(json, tokens_of_a_good_text) {
    EXPECT_EQ(
        parse(" {\"a\": [1, -2.5e+3, true, false, null], \"b\": {}, \"c\": \"x\"}\r\n").tokens,
        "{k[nntf0]k{}ks}.");
    for (const char *text :
         {"[]", "{}", "0", "\"\"", "null", " true ", "[[],[]]", "-0.0E-0", "1e400"})
        EXPECT_TRUE(parse(text).good) << text;
}

TEST(json, places_and_lengths) {
    const std::string text = "{\"key\" :\n  [12.5, \"a\\n\"]}";
    cb_json json;
    cb_json_start(&json, text.data(), static_cast<uint32_t>(text.size()), 0);
    std::vector<std::string> seen;
    for (int i = 0; i < 7; ++i) {
        const cb_json_token token = cb_json_next(&json);
        const cb_json_place place = cb_json_locate(text.data(), token.at);
        seen.push_back(text.substr(token.at, token.length) + "@" + std::to_string(place.line) +
                       ":" + std::to_string(place.column));
    }
    const std::vector<std::string> expected = {"{@1:1",         "\"key\"@1:2", "[@2:3", "12.5@2:4",
                                               "\"a\\n\"@2:10", "]@2:15",      "}@2:16"};
    EXPECT_EQ(seen, expected);
}

TEST(json, mistakes_say_what_and_where) {
    const struct {
        const char *text, *mistake;
        uint32_t line, column;
    } cases[] = {
        {"", "the text ends where a value is expected", 1, 1},
        {"{\"a\":1,}", "a key is missing here; is there a comma too many?", 1, 8},
        {"[1,]", "a value is missing before this bracket; is there a comma too many?", 1, 4},
        {"[1,,2]", "a value is missing before this comma", 1, 4},
        {"[1 2]", "a comma or ] is expected here", 1, 4},
        {"{\"a\":1 \"b\":2}", "a comma or } is expected here", 1, 8},
        {"{\"a\" 1}", "a colon is expected after the key", 1, 6},
        {"{a:1}", "a key in double quotes is expected here", 1, 2},
        {"{\"a\":}", "a value is missing before this bracket", 1, 6},
        {"[1}", "a comma or ] is expected here", 1, 3},
        {"[\n NaN]", "NaN is not a number of JSON", 2, 2},
        {"[-Infinity]", "a digit must follow the minus sign", 1, 2},
        {"[Infinity]", "infinity is not a number of JSON", 1, 2},
        {"[01]", "a number may not begin with a needless 0", 1, 2},
        {"[-01]", "a number may not begin with a needless 0", 1, 2},
        {"[+1]", "a number may not begin with +", 1, 2},
        {"[.5]", "a number must begin with a digit: write 0.5, not .5", 1, 2},
        {"[5.]", "a digit must follow the decimal point", 1, 2},
        {"[1e]", "the exponent of a number has no digits", 1, 2},
        {"[1e+]", "the exponent of a number has no digits", 1, 2},
        {"['a']", "texts need double quotes", 1, 2},
        {"[1] // x", "the file must end after its last }", 1, 5},
        {"[// x\n1]", "JSON has no comments", 1, 2},
        {"{} {}", "the file must end after its last }", 1, 4},
        {"{\"a\":1", "the text ends before its closing }", 1, 7},
        {"[1", "the text ends before its closing ]", 1, 3},
        {"{", "the text ends where a key is expected", 1, 2},
        {"[\"a", "the text ends inside double quotes", 1, 4},
        {"[\"a\\", "the text ends inside double quotes", 1, 4},
        {"[\"a\nb\"]", "a control character inside a text; is a quote missing?", 1, 4},
        {"[\"a\\x\"]", "unknown escape; a backslash itself is written \\\\", 1, 4},
        {"[\"\\u12g4\"]", "four hexadecimal digits must follow \\u", 1, 3},
        {"[\"\\udc00\"]", "a low surrogate without its high one", 1, 3},
        {"[\"\\ud800\\n\"]", "a high surrogate without its low one", 1, 3},
        {"[\"\xff\"]", "a byte that is not UTF-8; save the file as UTF-8", 1, 3},
        {"\xEF\xBB\xBF{}",
         "a byte order mark or another stray character; save the file as plain UTF-8", 1, 1},
        {"[tru]",
         "a value is expected here: an object, an array, a text in double quotes, a number, true, "
         "false or null",
         1, 2},
    };
    for (const auto &c : cases) {
        const parsed got = parse(c.text);
        EXPECT_EQ(got.mistake, c.mistake) << c.text;
        EXPECT_EQ(got.line, c.line) << c.text;
        EXPECT_EQ(got.column, c.column) << c.text;
        EXPECT_TRUE(agrees(c.text));
    }
}

TEST(json, a_zero_byte_is_no_white_space) {
    EXPECT_FALSE(parse(std::string("{}\0", 3)).good);
    EXPECT_FALSE(parse(std::string("[\0]", 3)).good);
    EXPECT_FALSE(parse(std::string("[\"\0\"]", 5)).good);
    EXPECT_FALSE(parse(std::string("\0", 1)).good);
}

TEST(json, depth_is_bounded) {
    const std::string open(CB_JSON_MAX_DEPTH, '['), close(CB_JSON_MAX_DEPTH, ']');
    EXPECT_TRUE(parse(open + close).good);
    EXPECT_EQ(parse("[" + open + close + "]").mistake, "brackets are nested deeper than 32");
    EXPECT_EQ(parse(std::string(100000, '[')).column, CB_JSON_MAX_DEPTH + 1u);
    std::string objects;
    for (int i = 0; i < 40; ++i) objects += "{\"a\":[";
    EXPECT_FALSE(parse(objects).good);
}

// Every second and third byte after every possible first one, as text in an array. Outside the long
// tests the first ones are those at the ends of eights, where each class of bytes begins or ends,
// and those of interest.
TEST(json, utf8_as_the_judge_sees_it) {
    const char interesting[] =
        "\x00\x22\x5c\x7f\x80\x8f\x90\x9f\xa0\xbf\xc0\xc2\xe0\xed\xf0\xf4\xff";
    const std::string seconds(interesting, sizeof interesting - 1);
    for (int first = 0; first < 256; ++first) {
        const bool at_an_end = first % 8 == 0 || first % 8 == 7;
        const bool of_interest = seconds.find(static_cast<char>(first)) != std::string::npos;
        if (!compbox_test::long_tests() && !at_an_end && !of_interest) continue;
        for (const char second : seconds) {
            for (const char third : seconds) {
                for (const char *tail : {"", "\x80", "\xbf\x80"}) {
                    const std::string text = std::string("[\"") + static_cast<char>(first) +
                                             second + third + tail + "\"]";
                    ASSERT_TRUE(agrees(text));
                }
            }
        }
    }
}

std::string text_of(const std::string &quoted, uint32_t size = 64) {
    std::vector<char> buffer(size);
    const cb_json_token token = {CB_JSON_STRING, 0, static_cast<uint32_t>(quoted.size())};
    const uint32_t length = cb_json_text(quoted.data(), token, buffer.data(), size);
    return length > size ? "too long" : std::string(buffer.data(), length);
}

TEST(json, texts_are_unescaped) {
    EXPECT_EQ(text_of("\"\""), "");
    EXPECT_EQ(text_of("\"a\\\"\\\\\\/\\b\\f\\n\\r\\tz\""), "a\"\\/\b\f\n\r\tz");
    EXPECT_EQ(text_of("\"\\u0041\\u00e9\\u20AC\\ud83d\\ude00\""), "Aé€😀");
    EXPECT_EQ(text_of("\"é€😀\""), "é€😀");
    EXPECT_EQ(text_of("\"\\u0000\"").size(), 1u);
    EXPECT_EQ(text_of("\"abc\"", 3), "abc");
    EXPECT_EQ(text_of("\"abcd\"", 3), "too long");
    EXPECT_EQ(text_of("\"ab€\"", 4), "too long");
}

// Every text that the judge can write must come back as it was.
TEST(json, texts_of_the_judge_come_back) {
    compbox_test::dice random(5);
    for (int i = 0; i < 5000; ++i) {
        std::u32string points;
        for (unsigned k = random(8); k > 0; --k) {
            char32_t point = random(random(2) ? 0x80 : 0x110000);
            if (point >= 0xD800 && point < 0xE000) point = 0xFFFD;
            points += point;
        }
        std::string utf8;
        for (const char32_t p : points) {
            if (p < 0x80) {
                utf8 += static_cast<char>(p);
            } else if (p < 0x800) {
                utf8 += {static_cast<char>(0xC0 | p >> 6), static_cast<char>(0x80 | (p & 63))};
            } else if (p < 0x10000) {
                utf8 += {static_cast<char>(0xE0 | p >> 12), static_cast<char>(0x80 | (p >> 6 & 63)),
                         static_cast<char>(0x80 | (p & 63))};
            } else {
                utf8 +=
                    {static_cast<char>(0xF0 | p >> 18), static_cast<char>(0x80 | (p >> 12 & 63)),
                     static_cast<char>(0x80 | (p >> 6 & 63)), static_cast<char>(0x80 | (p & 63))};
            }
        }
        for (const bool ascii : {false, true}) {
            const std::string written = nlohmann::json(utf8).dump(-1, ' ', ascii);
            ASSERT_TRUE(parse(written).good) << written;
            ASSERT_EQ(text_of(written), utf8) << written;
        }
    }
}

// Pieces that make and break JSON, put together at random: the judge and the reader must agree.
TEST(json, random_pieces_agree_with_the_judge) {
    const std::vector<std::string> pieces = {
        "{",   "}",  "[",  "]",  ",",       ":",    "\"a\"", "\"b\"", "1",   "-2.5",
        "1e5", "0",  "-",  ".",  "e",       "true", "false", "null",  "nul", " ",
        "\n",  "\t", "\\", "\"", "\\u0041", "\x01", "\x80",  "é"};
    compbox_test::dice random(6);
    int good = 0;
    for (int i = 0; i < compbox_test::cases(200000); ++i) {
        std::string text;
        for (unsigned k = 1 + random(9); k > 0; --k) text += pieces[random(pieces.size())];
        ASSERT_TRUE(agrees(text));
        good += parse(text).good;
    }
    EXPECT_GT(good, compbox_test::cases(1000))
        << "the pieces hardly ever make JSON: the test says little";
}

// A good text with one byte changed, removed or added.
TEST(json, small_damage_agrees_with_the_judge) {
    const std::string good =
        "{\"a\":[1,-2.5e-3,\"x\\u00e9\\ud83d\\ude00\",true],\"b\":{\"c\":null,\"d\":false},\"é\":0."
        "5}";
    compbox_test::dice random(7);
    ASSERT_TRUE(agrees(good));
    for (size_t cut = 0; cut <= good.size(); ++cut) ASSERT_TRUE(agrees(good.substr(0, cut)));
    for (int i = 0; i < compbox_test::cases(100000); ++i) {
        std::string text = good;
        for (unsigned k = 1 + random(2); k > 0; --k) {
            const size_t at = random(text.size());
            const char byte = random(2) ? static_cast<char>(random())
                                        : "{}[]:,\"\\0123456789.eE+-ntfu "[random(28)];
            switch (random(3)) {
                case 0:
                    text[at] = byte;
                    break;
                case 1:
                    text.erase(at, 1);
                    break;
                default:
                    text.insert(at, 1, byte);
                    break;
            }
        }
        ASSERT_TRUE(agrees(text));
    }
}

TEST(json, skip_leaves_a_container) {
    const std::string text = "[[1,[2,3]],4]";
    cb_json json;
    cb_json_start(&json, text.data(), static_cast<uint32_t>(text.size()), 0);
    cb_json_next(&json);
    cb_json_next(&json);
    cb_json_skip(&json, 1);
    EXPECT_EQ(text[cb_json_next(&json).at], '4');
    cb_json_start(&json, text.data(), static_cast<uint32_t>(text.size()), 4);  // the inner list
    EXPECT_EQ(cb_json_next(&json).kind, CB_JSON_ARRAY);
    cb_json_skip(&json, 0);
    EXPECT_EQ(json.at, 9u);
}

TEST(json, skip_ends_where_the_text_is_broken) {
    const std::string text = "[1,[2,x],3]";
    cb_json json;
    cb_json_start(&json, text.data(), static_cast<uint32_t>(text.size()), 0);
    cb_json_next(&json);
    cb_json_skip(&json, 0);
    EXPECT_EQ(json.at, 6u);
    EXPECT_EQ(cb_json_next(&json).kind, CB_JSON_BAD);
}

}  // namespace
