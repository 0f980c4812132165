// SPDX-License-Identifier: MIT
// Damaged files: the loader says what is wrong, or what it accepted is sound and the box runs on
// it. With the sanitizers of the asan preset also: no byte is read beyond the text.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/config_drive.h"
#include "tests/unit/config_fixture.h"
#include "tests/unit/config_invariants.h"

using namespace compbox_test;
using json = nlohmann::ordered_json;

namespace {

struct tally {
    int good = 0, refused = 0;
};

// A result is either a whole message at a place inside the text, or a sound configuration.
void judge(const std::string &text, uint32_t seed, tally &count) {
    const auto got = load(text);
    if (got.error == CB_OK) {
        ASSERT_EQ(invariants(*got.config).broken, "") << text;
        ASSERT_EQ(drive(*got.config, seed).broken, "") << text;
        ++count.good;
        return;
    }
    ++count.refused;
    ASSERT_FALSE(got.text.empty()) << text;
    ASSERT_EQ(got.text.find_first_of("\r\n\t"), std::string::npos) << got.text;
    if (got.line == 0) return;  // about the file as a whole
    size_t start = 0;
    for (uint32_t line = 1; line < got.line; ++line) start = text.find('\n', start) + 1;
    ASSERT_LE(start + got.column - 1, text.size()) << got.text;
}

TEST(config_fuzz, a_file_cut_anywhere_is_refused) {
    const size_t end = full_example.rfind('}');
    tally count;
    for (size_t length = 0; length <= end; ++length)
        judge(full_example.substr(0, length), 1, count);
    EXPECT_EQ(count.good, 0);
    EXPECT_EQ(count.refused, static_cast<int>(end) + 1);
}

TEST(config_fuzz, damaged_bytes) {
    const std::string frequent = "{}[]:,\"\\0123456789.eE+-ntfu \n";
    dice random(21);
    tally count;
    for (uint32_t i = 0; i < 6000; ++i) {
        std::string text = full_example;
        for (uint32_t k = 1 + random(3u); k > 0; --k) {
            const size_t at = random(text.size());
            const char byte =
                random(4u) ? frequent[random(frequent.size())] : static_cast<char>(random());
            switch (random(4u)) {
                case 0:
                    text[at] = byte;
                    break;
                case 1:
                    text.erase(at, 1 + random(3u));
                    break;
                case 2:
                    text.insert(at, 1, byte);
                    break;
                default:
                    text.insert(random(text.size()), text.substr(at, random(40u)));
                    break;
            }
        }
        ASSERT_NO_FATAL_FAILURE(judge(text, i, count));
    }
    EXPECT_GT(count.good, 100);
    EXPECT_GT(count.refused, 1500);
}

// Values that may be right in one place and are wrong in another.
json any_value(dice &random) {
    static const std::vector<json> values = {0,
                                             1,
                                             -1,
                                             2,
                                             3,
                                             5,
                                             7,
                                             15,
                                             16,
                                             24,
                                             32,
                                             99,
                                             100,
                                             101,
                                             104,
                                             116,
                                             121,
                                             122,
                                             125,
                                             126,
                                             1000,
                                             32767,
                                             32768,
                                             65535,
                                             65536,
                                             0.1,
                                             0.5,
                                             -0.5,
                                             1e-3,
                                             1e-6,
                                             1e-9,
                                             1e-12,
                                             1e-30,
                                             1e-44,
                                             1e6,
                                             1e9,
                                             -1e9,
                                             1e10,
                                             1e30,
                                             1e38,
                                             1e300,
                                             4e9,
                                             5e9,
                                             14300,
                                             "X",
                                             "T1",
                                             "EZX",
                                             "Y1",
                                             "int32",
                                             "float32",
                                             "",
                                             "int16",
                                             "mm",
                                             "uint16",
                                             nullptr,
                                             true,
                                             false,
                                             json::array(),
                                             json::object(),
                                             json::array({0, 1}),
                                             "polyline",
                                             "bspline",
                                             "fc23",
                                             "0x7ff",
                                             "generic",
                                             "::1"};
    return values[random(values.size())];
}

// Changes one random place in the tree.
void damage(json &tree, dice &random) {
    json *place = &tree;
    while (place->is_structured() && !place->empty() && random(8u) > 0) {
        auto it = place->begin();
        std::advance(it, random(place->size()));
        place = &*it;
    }
    if (place->is_array() && !place->empty()) {
        const size_t at = random(place->size());
        const json element = (*place)[at];
        if (random(2u)) {
            place->erase(at);
        } else {
            place->push_back(element);
        }
    } else if (place->is_object() && !place->empty()) {
        auto it = place->begin();
        std::advance(it, random(place->size()));
        place->erase(it->is_null() ? place->begin() : it);
    } else if (place->is_number() && random(2u)) {
        const double number = place->get<double>();
        const double others[] = {number + 1, number - 1, -number, number * 1000, number / 1000};
        *place = others[random(5u)];
        if (random(2u) && std::fabs(number) < 1e15)
            *place = static_cast<int64_t>(number) + static_cast<int64_t>(random(5u)) - 2;
    } else {
        *place = any_value(random);
    }
}

TEST(config_fuzz, damaged_values) {
    dice random(22);
    tally count;
    const json good = json::parse(full_example);
    for (uint32_t i = 0; i < 5000; ++i) {
        json tree = good;
        for (uint32_t k = 1 + random(3u); k > 0; --k) damage(tree, random);
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(i % 2 ? -1 : 1), i, count));
    }
    EXPECT_GT(count.good, 500);
    EXPECT_GT(count.refused, 1500);
}

// Curves of random shape and size, many of them absurd: what is accepted never overflows.
TEST(config_fuzz, random_curves) {
    dice random(23);
    tally count;
    const json good = json::parse(full_example);
    const auto number = [&] {
        const double digits = static_cast<double>(random(2000u)) / 1000 - 1;
        return digits * std::pow(10, static_cast<double>(random(18u)) - (random(4u) ? 8 : 40));
    };
    for (uint32_t i = 0; i < 2000; ++i) {
        json tree = good;
        const size_t count_of_points = 1 + random(12u), degree = 1 + random(5u);
        std::vector<double> knots, values;
        for (size_t k = 0; k < count_of_points + degree + 1; ++k) knots.push_back(number());
        for (size_t k = 0; k < count_of_points; ++k) values.push_back(number());
        std::sort(knots.begin(), knots.end());
        tree["terms"][0] = {{"name", "EZX"},    {"type", "bspline"}, {"signal", "X"},
                            {"degree", degree}, {"knots", knots},    {"control_points", values}};
        knots.resize(count_of_points);
        tree["terms"][1] = {{"name", "EYX"},
                            {"type", "polyline"},
                            {"signal", "X"},
                            {"positions", knots},
                            {"values", values}};
        tree["terms"][2] = {{"name", "KT"},       {"type", "polynomial"},
                            {"signal", "T1"},     {"coefficients", values},
                            {"center", number()}, {"half_range", std::fabs(number())}};
        const json kept = tree["terms"][random(3u)];  // one bad curve of three spoils most files
        tree["terms"] = {kept, good["terms"][3]};
        tree["channels"][0]["sum"] = {"KB"};
        tree["channels"][1]["sum"] = {"KB"};
        tree["channels"][2]["sum"] = json::array();
        for (const json &term : tree["terms"]) tree["channels"][2]["sum"].push_back(term["name"]);
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(), i, count));
    }
    EXPECT_GT(count.good, 200);
    EXPECT_GT(count.refused, 200);
}

}  // namespace
