// SPDX-License-Identifier: MIT
// Damaged files: the loader says what is wrong, or what it accepted is sound and the box runs on
// it. With the sanitizers of the asan preset also: no byte is read beyond the text.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/cases.h"
#include "tests/support/config_drive.h"
#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"
#include "tests/support/every_term.h"

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
    for (uint32_t i = 0; i < compbox_test::cases(6000u); ++i) {
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
    EXPECT_GT(count.good, compbox_test::cases(100));
    EXPECT_GT(count.refused, compbox_test::cases(1500));
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
    for (uint32_t i = 0; i < compbox_test::cases(5000u); ++i) {
        json tree = good;
        for (uint32_t k = 1 + random(3u); k > 0; --k) damage(tree, random);
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(i % 2 ? -1 : 1), i, count));
    }
    EXPECT_GT(count.good, compbox_test::cases(500));
    EXPECT_GT(count.refused, compbox_test::cases(1500));
}

// The same before a FANUC control, whose values and keys have limits of their own.
TEST(config_fuzz, damaged_values_before_a_fanuc_control) {
    dice random(25);
    tally count;
    json good = json::parse(with("sinumerik-840d", "fanuc"));
    good["channels"][0]["scale"] = 0.1;
    good["plc"].update({{"handshake", 2}, {"scan_ms", 8}, {"max_step_units", 9998}});
    for (uint32_t i = 0; i < compbox_test::cases(3000u); ++i) {
        json tree = good;
        for (uint32_t k = 1 + random(2u); k > 0; --k) {
            json &part = random(2u) ? tree : random(2u) ? tree["plc"] : tree["channels"];
            damage(part, random);
        }
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(), i, count));
    }
    EXPECT_GT(count.good, compbox_test::cases(300));
    EXPECT_GT(count.refused, compbox_test::cases(1000));
}

// The same on a file with every kind of term.
TEST(config_fuzz, damaged_values_of_every_kind_of_term) {
    dice random(24);
    tally count;
    const json good = json::parse(every_term());
    for (uint32_t i = 0; i < compbox_test::cases(4000u); ++i) {
        json tree = good;
        const size_t terms = tree["terms"].size();
        for (uint32_t k = random(3u); k > 0; --k) damage(tree["terms"][random(terms)], random);
        if (random(3u) == 0) damage(tree, random);
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(), i, count));
    }
    EXPECT_GT(count.good, compbox_test::cases(300));
    EXPECT_GT(count.refused, compbox_test::cases(1500));
}

TEST(config_fuzz, a_file_with_every_kind_of_term_cut_anywhere_is_refused) {
    const std::string text = every_term();
    tally count;
    for (size_t length = 0; length <= text.rfind('}'); length += 7)
        judge(text.substr(0, length), 1, count);
    EXPECT_EQ(count.good, 0);
}

// Terms of random kinds that use each other at random, with sizes and numbers that mostly fit.
class random_terms {
  public:
    explicit random_terms(dice &d) : random(d) {}

    json make() {
        json terms = json::array();
        for (uint32_t n = 1 + random(8u); n > 0; --n) terms.push_back(one());
        return terms;
    }
    std::vector<std::string> outputs;

  private:
    dice &random;
    int names = 0;

    double number() {
        const double digits = static_cast<double>(random(2000u)) / 1000 - 1;
        return digits * std::pow(10, static_cast<double>(random(8u)) - (random(6u) ? 4 : 30));
    }
    std::vector<double> numbers(size_t n) {
        std::vector<double> all(n);
        for (double &x : all) x = number();
        if (random(60u) == 0) all.push_back(1);
        return all;
    }
    std::vector<double> ascending(size_t n) {
        std::vector<double> all(n);
        double x = static_cast<double>(random(100u));
        for (double &y : all) y = x += random(50u) ? 1 + static_cast<double>(random(400u)) : 0;
        return all;
    }
    std::string signal() {
        static const char *const all[] = {"X", "Y", "Z", "VX", "T1", "L", "T1_slow", "T1_square"};
        return random(60u) ? all[random(8u)] : "nobody";
    }
    std::string output() {
        return outputs.empty() || random(40u) == 0 ? "nothing" : outputs[random(outputs.size())];
    }
    std::string name() {
        const bool again = !outputs.empty() && random(80u) == 0;
        outputs.push_back(again ? outputs.front() : "t" + std::to_string(++names));
        return outputs.back();
    }
    json curve(const std::string &type) {
        const size_t n = 2 + random(9u), degree = 1 + random(3u);
        if (type == "polynomial")
            return {{"coefficients", numbers(1 + random(6u))}, {"half_range", 2000}};
        if (type == "polyline") return {{"positions", ascending(n)}, {"values", numbers(n)}};
        const size_t points = n + degree;
        return {{"degree", degree},
                {"knots", ascending(points + degree + 1)},
                {"control_points", numbers(points)}};
    }
    json curve_term() {
        static const char *const types[] = {"bspline", "polyline", "polynomial"};
        const std::string type = types[random(3u)];
        json term = curve(type);
        if (random(2u)) term.update({{"reversal_mm", 0.5}, {"backward", curve(type)}});
        term.update({{"name", name()}, {"type", type}, {"signal", random(3u) ? "X" : signal()}});
        return term;
    }
    json rows(size_t n, size_t columns) {
        json all = json::array();
        for (size_t i = 0; i < n; ++i) all.push_back(numbers(columns));
        return all;
    }
    json inputs(size_t n) {
        std::set<std::string> all;
        while (all.size() < n) all.insert(signal());
        return all;
    }
    json network() {
        const size_t n = 1 + random(5u), hidden = 1 + random(9u), out = 1 + random(3u);
        json term = {{"name", "n" + std::to_string(++names)}, {"type", "bpnet"}};
        for (size_t k = 0; k < out; ++k) term["outputs"].push_back(name());
        term["inputs"] = inputs(n);
        term["activation"] = random(2u) ? "tansig" : "logsig";
        term["hidden_weights"] = rows(hidden, n);
        term["hidden_bias"] = numbers(hidden);
        term["output_weights"] = rows(out, hidden);
        term["output_bias"] = numbers(out);
        if (random(2u)) term["linear_weights"] = rows(out, n);
        term["input_min"] = std::vector<double>(n, -100);
        term["input_max"] = std::vector<double>(n, 100);
        return term;
    }
    json volumetric() {
        static const char *const chains[] = {"fXYZ", "XYfZ", "ZfXY", "YXZf", "XfYY"};
        json term = {{"name", "v" + std::to_string(++names)}, {"type", "volumetric"}};
        for (int k = 0; k < 3; ++k) term["outputs"].push_back(name());
        term["chain"] = chains[random(random(20u) ? 4u : 5u)];
        term["errors"] = json::array();
        if (random(10u) == 0) term["errors"].push_back("EXX");
        term["tool_offset_mm"] = numbers(3);
        return term;
    }
    json one() {
        switch (random(6u)) {
            case 0: {
                const size_t n = 1 + random(4u);
                return {{"name", name()},
                        {"type", "linear"},
                        {"inputs", inputs(n)},
                        {"weights", numbers(n)}};
            }
            case 1: {
                const std::string used = output();
                return {{"name", name()},
                        {"type", "product"},
                        {"term", used},
                        {"signal", signal()},
                        {"origin", number()}};
            }
            case 2:
                return network();
            case 3:
                return volumetric();
            default:
                return curve_term();
        }
    }
};

TEST(config_fuzz, random_terms_of_every_kind) {
    dice random(25);
    tally count;
    const json good = json::parse(every_term());
    for (uint32_t i = 0; i < compbox_test::cases(4000u); ++i) {
        json tree = good;
        random_terms terms(random);
        tree["terms"] = terms.make();
        for (json &channel : tree["channels"]) {
            channel["sum"] = json::array();
            std::set<std::string> once;
            for (uint32_t k = 1 + random(3u); k > 0; --k)
                once.insert(terms.outputs[random(terms.outputs.size())]);
            channel["sum"] = once;
        }
        ASSERT_NO_FATAL_FAILURE(judge(tree.dump(), i, count));
    }
    EXPECT_GT(count.good, compbox_test::cases(500));
    EXPECT_GT(count.refused, compbox_test::cases(500));
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
    for (uint32_t i = 0; i < compbox_test::cases(2000u); ++i) {
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
    EXPECT_GT(count.good, compbox_test::cases(200));
    EXPECT_GT(count.refused, compbox_test::cases(200));
}

}  // namespace
