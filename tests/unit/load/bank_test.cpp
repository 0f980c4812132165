// SPDX-License-Identifier: MIT
// Banks of linear terms: how they load, and what is refused.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"
#include "tests/support/paths.h"

extern "C" {
#include "firmware/signals/bank.h"
}

using namespace compbox_test;

namespace {

const std::string bank_text =
    R"({"inputs": ["T1", "B"], "powers": {"B": [1, 3]}, "tau_s": [0, 60, 3600],
 "weights": [[1, 2, 3, 4, 5, 6, 7, 8, 9], [10, 20, 30, 40, 50, 60, 1, 2, 3]], "bias": [0.5, -0.25]})";
const std::string with_bank = with(
    R"({"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})",
    R"({"name": "warm", "type": "linear", "outputs": ["KB", "KC"], "bank": )" + bank_text + "}");

std::string bank_with(const std::string &piece, const std::string &other) {
    return with(piece, other, with_bank);
}

TEST(config_bank, arrives_with_its_columns_in_order) {
    const auto got = load(with_bank);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    EXPECT_EQ(invariants(c).broken, "");
    ASSERT_EQ(c.banks_count, 1);
    EXPECT_EQ(c.bank_lags_count, 6);
    const cb_bank_config &b = c.banks[0];
    EXPECT_TRUE(b.unlagged);
    EXPECT_FALSE(b.trained);
    const uint8_t links[] = {1, 3, 1, 5};  // T1, B; T1 itself, B and its cube
    for (int i = 0; i < 4; ++i) EXPECT_EQ(c.links[b.inputs.link + i], links[i]) << i;
    const float taus[] = {0, 60, 3600};
    for (int i = 0; i < 3; ++i) EXPECT_EQ(c.pool[b.taus + i], taus[i]) << i;
    const cb_term_config &term = c.terms[3];
    ASSERT_EQ(term.type, CB_TERM_LINEAR);
    EXPECT_EQ(term.outputs, 2);
    EXPECT_TRUE(term.as.linear.has_bank);
    const float *weights = c.pool + term.as.linear.pool;
    const float all[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 20, 30, 40, 50, 60, 1, 2, 3, 0.5f, -0.25f};
    for (int i = 0; i < 20; ++i) EXPECT_EQ(weights[i], all[i]) << i;
    EXPECT_EQ(c.pool_count, term.as.linear.pool + 20);
}

TEST(config_bank, the_example_of_the_manual_loads) {
    std::ifstream file(from_source("docs/coefficient-file.md"));
    const std::string manual{std::istreambuf_iterator<char>(file), {}};
    const size_t start = manual.find("    {\"name\": \"warm\", \"type\": \"linear\"");
    ASSERT_NE(start, std::string::npos);
    const std::string shown = manual.substr(start, manual.find("\n\n", start) - start);
    std::string text =
        with(R"({"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})",
             with("\"ch1\"", "\"KB\"", shown));
    const auto got = load(with(R"("name": "T2")", R"("name": "rpm")", text));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(got.config->bank_lags_count, 8);
    EXPECT_FLOAT_EQ(got.config->pool[got.config->terms[3].as.linear.pool + 11], 3e-11f);
}

TEST(config_bank, the_example_of_a_sigma_loads) {
    std::ifstream file(from_source("docs/coefficient-file.md"));
    const std::string manual{std::istreambuf_iterator<char>(file), {}};
    const size_t start = manual.rfind("    {\"name\": \"warm\", \"type\": \"linear\"");
    ASSERT_NE(start, std::string::npos);
    const std::string shown = manual.substr(start, manual.find("\n\n", start) - start);
    const auto got =
        load(with(R"({"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})",
                  with("\"ch1\"", "\"KB\"", shown)));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(got.config->banks[0].directions, 2);
}

TEST(config_bank, defaults) {
    std::string text = bank_with(R"("powers": {"B": [1, 3]}, )", "");
    text = with(R"("tau_s": [0, 60, 3600])", R"("tau_s": [60])", text);
    text = with(
        R"([[1, 2, 3, 4, 5, 6, 7, 8, 9], [10, 20, 30, 40, 50, 60, 1, 2, 3]], "bias": [0.5, -0.25])",
        "[[7, 8]]", text);
    text = with(R"("outputs": ["KB", "KC"], )", "", text);
    text = with(R"("name": "warm")", R"("name": "KB")", text);
    const auto got = load(text);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(invariants(*got.config).broken, "");
    const cb_bank_config &b = got.config->banks[0];
    EXPECT_FALSE(b.unlagged);
    EXPECT_EQ(got.config->bank_lags_count, 2);
    EXPECT_EQ(got.config->links[b.inputs.link + 3], 1) << "the power 1";
    EXPECT_EQ(got.config->pool[got.config->terms[3].as.linear.pool + 2], 0) << "bias";
    EXPECT_STREQ(got.config->outputs[3].name, "KB");
}

TEST(config_bank, has_a_training_range) {
    const auto trained = [](const std::string &more) {
        return load(bank_with(
            R"("bias": [0.5, -0.25])",
            R"("bias": [0.5, -0.25], "input_min": [10, -90], "input_max": [40, 90])" + more));
    };
    const auto got = trained("");
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(invariants(*got.config).broken, "");
    EXPECT_TRUE(got.config->banks[0].trained);
    const float ranges[] = {10, 40, 3, 1 / 15.0f, -90, 90, 18, 1 / 90.0f};
    for (int i = 0; i < 8; ++i)
        EXPECT_FLOAT_EQ(got.config->pool[got.config->banks[0].ranges + i], ranges[i]) << i;
    const auto stated = trained(R"(, "margin": [1, 2], "fade": [4, 5])");
    ASSERT_EQ(stated.error, CB_OK) << stated.text;
    EXPECT_EQ(stated.config->pool[stated.config->banks[0].ranges + 6], 2);
    EXPECT_EQ(trained(R"(, "margin": [1])").text,
              "terms[3].bank.margin: 1 numbers for 2 inputs; each needs one");
}

TEST(config_bank, a_spindle_to_its_cube_may_exceed_the_range_of_signals) {
    std::string text = with("-180.5, \"max\": 180.5", "0, \"max\": 1e9", with_bank);
    text = with("[1, 3]", "[1, 4]", text);
    text = with("5, 6, 7, 8, 9], [10, 20, 30, 40, 50, 60, 1, 2, 3]",
                "0, 0, 1e-28, 1e-28, 1e-28], [0, 0, 0, 0, 0, 0, 1e-29, 0, 1e-28]", text);
    text = with("[1, 2, 3, 4, ", "[1, 2, 3, 0, ", text);
    const auto got = load(text);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(invariants(*got.config).broken, "");
    EXPECT_EQ(
        load(with("1e-29", "1e-20", text)).text,
        "terms[3].bank.weights[1]: between min and max of its signals this sum exceeds 1e9 µm");
    EXPECT_EQ(
        load(with("1e-29", "1e9", text)).text,
        "terms[3].bank.weights[1]: between min and max of its signals this sum exceeds 1e9 µm");
}

const std::string sigma_text =
    R"("sigma": {"floor_um": [8, 5], "along_um": [2, 1.5], "offsets": [-4, 0.5],
 "directions": [[1, 2, 3, 4, 5, 6, 7, 8, 9], [9, 8, 7, 6, 5, 4, 3, 2, 1]]})";

std::string sigma_with(const std::string &piece, const std::string &other) {
    return with(
        piece, other,
        with("\"bias\": [0.5, -0.25]}", "\"bias\": [0.5, -0.25]}, " + sigma_text, with_bank));
}

TEST(config_bank, states_its_sigma) {
    const auto got = load(sigma_with("[8, 5]", "[8, 5]"));
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    EXPECT_EQ(invariants(c).broken, "");
    const cb_bank_config &b = c.banks[0];
    EXPECT_EQ(b.outputs, 2);
    EXPECT_EQ(b.directions, 2);
    EXPECT_NE(b.model, 0u);
    const float all[] = {8, 5, 2, 1.5f, -4, 0.5f, 1, 2, 3, 4, 5, 6,
                         7, 8, 9, 9,    8,  7,    6, 5, 4, 3, 2, 1};
    for (int i = 0; i < 24; ++i) EXPECT_EQ(c.pool[b.sigma + i], all[i]) << i;
    EXPECT_EQ(c.pool_count, b.sigma + 24);
    EXPECT_EQ(load(with_bank).config->banks[0].model, 0u);
}

TEST(config_bank, another_number_is_another_model) {
    const auto model = [](const std::string &text) { return load(text).config->banks[0].model; };
    const uint32_t usual = model(sigma_with("[8, 5]", "[8, 5]"));
    EXPECT_EQ(model(sigma_with("[8, 5]", "[8.0, 5.00]")), usual);
    for (const auto &[piece, other] : std::vector<std::pair<std::string, std::string>>{
             {"[8, 5]", "[8, 6]"},
             {"[9, 8, 7,", "[9, 8, 7.5,"},
             {"[0.5, -0.25]", "[0.5, 0.25]"},
             {"[[1, 2, 3, 4, 5, 6, 7, 8, 9], [10,", "[[1, 2, 3, 4, 5, 6, 7, 8, 9], [11,"}})
        EXPECT_NE(model(sigma_with(piece, other)), usual) << piece;
}

TEST(config_bank, every_mistake_in_a_sigma_has_its_sentence) {
    const std::pair<std::pair<const char *, const char *>, const char *> mistakes[] = {
        {{"\"floor_um\": [8, 5], ", ""}, "terms[3].sigma: the key floor_um is missing"},
        {{"[8, 5]", "[8]"}, "terms[3].sigma.floor_um: 1 numbers for 2 outputs; each needs one"},
        {{"[8, 5]", "[8, -1]"}, "terms[3].sigma.floor_um[1]: -1 is outside the range of 0 to 1e6"},
        {{"[2, 1.5]", "[2, 1e7]"},
         "terms[3].sigma.along_um[1]: 1e7 is outside the range of 0 to 1e6"},
        {{"[-4, 0.5]", "[]"}, "terms[3].sigma.offsets: at least one direction is needed"},
        {{"[-4, 0.5]", "[1, 2, 3, 4, 5]"},
         "terms[3].sigma.offsets[4]: a list of numbers here holds at most 4"},
        {{"[-4, 0.5]", "[-4]"}, "terms[3].sigma.directions: 2 rows for 1 offsets; each needs one"},
        {{", 3, 2, 1]]", ", 3, 2]]"},
         "terms[3].sigma.directions[1]: 8 numbers for 9 columns (input, power, time constant); "
         "each needs one"},
        {{"[[1, 2, 3, 4, 5, 6, 7, 8, 9], [9,", "[[1, 2, 3, 4, 5, 6, 1e9, 8, 9], [9,"},
         "terms[3].sigma.directions[0]: between min and max of its signals this sum exceeds 1e9"},
    };
    for (const auto &[change, sentence] : mistakes)
        EXPECT_EQ(load(sigma_with(change.first, change.second)).text, sentence);
    EXPECT_EQ(load(with(R"("coefficients": [0.5])", R"("coefficients": [0.5])")).text, "");
    EXPECT_EQ(
        load(with(R"({"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})",
                  R"({"name": "KB", "type": "linear", "inputs": ["B"], "weights": [1], )" +
                      sigma_text + "}"))
            .text,
        "terms[3].sigma: only a term with a bank states its sigma; omit it");
}

struct bank_mistake {
    const char *piece, *other, *message;
};

TEST(config_bank, every_mistake_has_its_sentence) {
    const bank_mistake mistakes[] = {
#include "tests/unit/load/bank_refused.inc"
    };
    for (const auto &[piece, other, message] : mistakes) {
        const auto got = load(bank_with(piece, other));
        EXPECT_EQ(compbox_test::error_name(got.error) + " " + got.text, message)
            << piece << " -> " << other;
    }
}

// A file whose terms are banks of `taus` time constants over `inputs` thermometers each.
std::string file_of_banks(size_t count, size_t inputs, size_t taus) {
    using nlohmann::json;
    json file = json::parse(full_example);
    for (size_t i = 0; i < 60; ++i)
        file["signals"].push_back({{"name", "s" + std::to_string(i)},
                                   {"unit", "degC"},
                                   {"can", "0x181"},
                                   {"min", 0},
                                   {"max", 1}});
    file["terms"] = json::array();
    for (size_t b = 0; b < count; ++b) {
        json own = {{"weights", json::array({json(inputs * taus, 0.1)})}};
        for (size_t i = 0; i < inputs; ++i) own["inputs"].push_back("s" + std::to_string(i));
        for (size_t t = 0; t < taus; ++t) own["tau_s"].push_back(10 + t);
        file["terms"].push_back(
            {{"name", "b" + std::to_string(b)}, {"type", "linear"}, {"bank", own}});
    }
    file["channels"][0]["sum"] = {"b0"};
    file["channels"].erase(2);
    file["channels"].erase(1);
    file.erase("pairs");
    return file.dump();
}

TEST(config_bank, fills_the_pool_of_lags_and_no_more) {
    const auto full = load(file_of_banks(16, 2, 8));
    ASSERT_EQ(full.error, CB_OK) << full.text;
    EXPECT_EQ(invariants(*full.config).broken, "");
    EXPECT_EQ(full.config->bank_lags_count, CB_MAX_BANK_LAGS);
    EXPECT_EQ(load(file_of_banks(9, 16, 2)).text,
              "terms[8]: this bank needs 32 lags, and of the box's 256 only 0 are left");
    EXPECT_EQ(load(file_of_banks(17, 1, 1)).text,
              "terms[16].bank: the terms have more than 16 banks together");
    EXPECT_EQ(load(file_of_banks(3, 50, 2)).text,
              "terms[2]: this bank needs 100 lags, and of the box's 256 only 56 are left");
}

TEST(config_bank, takes_two_links_for_each_input) {
    using nlohmann::json;
    json file = json::parse(file_of_banks(4, 60, 1));
    json term = {{"type", "linear"}, {"weights", json(40, 0.1)}};
    for (size_t i = 0; i < 40; ++i) term["inputs"].push_back("s" + std::to_string(i));
    term["name"] = "filler";
    file["terms"].insert(file["terms"].begin() + 3, term);
    const auto full = load(file.dump());
    EXPECT_EQ(full.text,
              "terms[4].bank.inputs: the terms have more than 512 inputs together; an input of a "
              "bank counts twice");
}

TEST(config_bank, finds_each_lag_by_its_key_and_back) {
    using nlohmann::json;
    json file = json::parse(file_of_banks(3, 3, 4));
    json &own = file["terms"][1]["bank"];
    own["powers"] = {{"s0", {2, 3}}, {"s2", {1, 4}}};
    own["tau_s"] = {0, 20, 30};
    own["weights"] = json::array({json(15, 0.1)});
    file["terms"][2]["bank"]["tau_s"] = {0};
    file["terms"][2]["bank"]["weights"] = json::array({json(3, 0.1)});
    const auto got = load(file.dump());
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    ASSERT_EQ(c.bank_lags_count, 12 + 10);
    for (unsigned lag = 0; lag < c.bank_lags_count; ++lag)
        EXPECT_EQ(cb_bank_find(&c, cb_bank_key_of(&c, lag)), lag);
    const cb_bank_key key = cb_bank_key_of(&c, 12 + 2 + 1);  // of s0 cubed with 30 s
    EXPECT_STREQ(c.signals[key.signal].name, "s0");
    EXPECT_EQ(key.power, 3);
    EXPECT_EQ(key.tau_s, 30);
    EXPECT_EQ(cb_bank_find(&c, {key.signal, 4, 30, -1e30F, 1e30F}), CB_MAX_BANK_LAGS)
        << "no such power";
    EXPECT_EQ(cb_bank_find(&c, {key.signal, 3, 31, -1e30F, 1e30F}), CB_MAX_BANK_LAGS)
        << "no such time constant";
    EXPECT_EQ(cb_bank_find(&c, {0, 1, 30, -1e30F, 1e30F}), CB_MAX_BANK_LAGS) << "no such input";
}

}  // namespace
