// SPDX-License-Identifier: MIT
// Linear terms, products, networks and the volumetric term: how they load, and what is refused.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"

using namespace compbox_test;

namespace {

// Stands in place of the example's last term; users stand before what they use.
const std::string models = R"({"name": "vol", "type": "volumetric", "chain": "XYfZ",
 "outputs": ["vol_x", "vol_y", "vol_z"], "errors": ["EZX", "EYX"], "positions": ["X", "B", "X"],
 "reference_points_mm": {"X": [1, 2, 3], "Z": [4, 5, 6]}, "tool_offset_mm": [10, 20, 30],
 "tool_length": "B", "tool_direction": [0, 0, -1], "squareness_urad": {"A0Z": 7, "C0Y": -9}},
{"name": "growth", "type": "product", "term": "tan_beta", "signal": "X", "origin": 250},
{"name": "tan_beta", "type": "linear", "inputs": ["T1", "T2"], "weights": [0.5, -0.25], "constant": 3},
{"name": "net", "type": "bpnet", "inputs": ["T1", "X"], "outputs": ["net_x", "net_y"],
 "activation": "tansig", "hidden_weights": [[1, 2], [3, 4], [5, 6]], "hidden_bias": [0.1, 0.2, 0.3],
 "output_weights": [[1, 2, 3], [4, 5, 6]], "output_bias": [7, 8], "linear_weights": [[0.5, 0], [0, 0.25]],
 "input_center": [20, 7000], "input_scale": [10, 7000], "output_center": [1, 2], "output_scale": [30, 40],
 "input_min": [10, 0], "input_max": [30, 14300], "margin": [2, 0], "fade": [5, 100]},
{"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})";

const std::string last_term =
    R"({"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]})";

std::string every_model() {
    return with(last_term, models);
}

TEST(config_models, arrive_in_the_order_in_which_they_need_each_other) {
    const auto got = load(every_model());
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    EXPECT_EQ(invariants(c).broken, "");
    ASSERT_EQ(c.terms_count, 8);
    const uint8_t order[] = {CB_TERM_BSPLINE,    CB_TERM_POLYLINE, CB_TERM_POLYNOMIAL,
                             CB_TERM_VOLUMETRIC, CB_TERM_LINEAR,   CB_TERM_BPNET,
                             CB_TERM_POLYNOMIAL, CB_TERM_PRODUCT};
    for (int i = 0; i < 8; ++i) EXPECT_EQ(c.terms[i].type, order[i]) << i;
    EXPECT_STREQ(c.outputs[3].name, "vol_x");
    EXPECT_STREQ(c.outputs[c.terms[7].first_output].name, "growth");

    const cb_volumetric_config &vol = c.terms[3].as.volumetric;
    EXPECT_EQ(vol.signals[1], 3);
    EXPECT_EQ(vol.signals[3], 3);
    EXPECT_EQ(vol.error[2], 0) << "EZX";
    EXPECT_EQ(vol.error[1], 1) << "EYX";
    EXPECT_EQ(vol.error[0], CB_NONE);
    const float pool[] = {9, 18, 27, 10, 20, 30, 6, 15, 24, 0, 0, -1, -9, 0, 7};
    for (int i = 0; i < 15; ++i) EXPECT_EQ(c.pool[vol.pool + i], pool[i]) << i;

    const cb_linear_config &linear = c.terms[4].as.linear;
    EXPECT_EQ(linear.inputs.count, 2);
    EXPECT_EQ(c.links[linear.inputs.link], 1);
    EXPECT_EQ(c.links[linear.inputs.link + 1], 2);
    EXPECT_EQ(c.pool[linear.pool + 1], -0.25f);
    EXPECT_EQ(c.pool[linear.pool + 2], 3.0f);

    const cb_product_config &product = c.terms[7].as.product;
    EXPECT_STREQ(c.outputs[product.output].name, "tan_beta");
    EXPECT_EQ(product.signal, 0);
    EXPECT_EQ(product.origin, 250);

    const cb_bpnet_config &net = c.terms[5].as.bpnet;
    EXPECT_EQ(net.inputs.count, 2);
    EXPECT_EQ(net.hidden, 3);
    EXPECT_TRUE(net.linear);
    EXPECT_EQ(c.terms[5].outputs, 2);
    const float ranges[] = {10, 30, 2, 0.2f, 0, 14300, 0, 0.01f};
    for (int i = 0; i < 8; ++i) EXPECT_EQ(c.pool[net.ranges + i], ranges[i]) << i;
}

TEST(config_models, defaults) {
    std::string text = with(R"(, "margin": [2, 0], "fade": [5, 100])", "", every_model());
    text = with(R"("positions": ["X", "B", "X"],)", "", text);
    text = with(R"("name": "T2")", R"("name": "Y")", text);
    text = with(R"("name": "B", "unit")", R"("name": "Z", "unit")", text);
    text = with(R"(["T1", "T2"])", R"(["T1", "Y"])", text);
    text = with(R"("signal": "B")", R"("signal": "Z")", text);
    text = with(R"("tool_length": "B")", R"("tool_length_mm": 123.5)", text);
    text = with(R"(, "constant": 3)", "", text);
    text = with(R"(, "origin": 250)", "", text);
    const auto got = load(text);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    const cb_config &c = *got.config;
    const float ranges[] = {10, 30, 2, 0.1f, 0, 14300, 1430, 1.0f / 7150};
    for (int i = 0; i < 8; ++i) EXPECT_FLOAT_EQ(c.pool[c.terms[5].as.bpnet.ranges + i], ranges[i]);
    const cb_volumetric_config &vol = c.terms[3].as.volumetric;
    EXPECT_EQ(vol.signals[2], 3);
    EXPECT_EQ(vol.signals[3], CB_NONE);
    EXPECT_EQ(c.pool[vol.pool + 16], 123.5f);
    EXPECT_EQ(c.pool[c.terms[4].as.linear.pool + 2], 0.0f);
    EXPECT_EQ(c.terms[7].as.product.origin, 0.0f);
}

struct mistake {
    const char *piece, *other, *message;
};

TEST(config_models, every_mistake_has_its_sentence) {
    const mistake mistakes[] = {
#include "tests/unit/load/models_refused.inc"
    };
    for (const auto &[piece, other, message] : mistakes) {
        const auto got = load(with(piece, other, every_model()));
        EXPECT_EQ(compbox_test::error_name(got.error) + " " + got.text, message)
            << piece << " -> " << other;
    }
}

TEST(config_models, the_largest_network_fits_and_one_more_input_does_not) {
    const auto net = [](size_t inputs, size_t hidden, size_t outputs) {
        using nlohmann::json;
        json file = json::parse(full_example);
        json term = {{"name", "big"}, {"type", "bpnet"}, {"activation", "logsig"}};
        file["signals"] = json::array();
        for (int i = 0; i < 64; ++i) {
            file["signals"].push_back({{"name", "s" + std::to_string(i)},
                                       {"unit", "degC"},
                                       {"plc", 8},
                                       {"min", 0},
                                       {"max", 1}});
        }
        for (size_t i = 0; i < inputs; ++i) term["inputs"].push_back("s" + std::to_string(i % 64));
        for (size_t k = 0; k < outputs; ++k) term["outputs"].push_back("o" + std::to_string(k));
        term["hidden_weights"] = json(hidden, json(inputs, 0.1));
        term["hidden_bias"] = json(hidden, 0.1);
        term["output_weights"] = json(outputs, json(hidden, 0.1));
        term["output_bias"] = json(outputs, 0.1);
        term["linear_weights"] = json(outputs, json(inputs, 0.1));
        term["input_min"] = json(inputs, 0);
        term["input_max"] = json(inputs, 1);
        file["terms"] = json::array({term});
        file["channels"][0]["sum"] = {"o0"};
        file["channels"].erase(2);
        file["channels"].erase(1);
        file.erase("pairs");
        return load(file.dump());
    };
    const auto largest = net(64, 64, 8);
    EXPECT_EQ(largest.error, CB_OK) << largest.text;
    EXPECT_EQ(invariants(*largest.config).broken, "");
    EXPECT_EQ(net(65, 64, 8).text,
              "terms[0].inputs[64]: the box has room for 64 inputs of one "
              "term, and this is one more");
    EXPECT_EQ(net(64, 65, 8).text,
              "terms[0].hidden_bias[64]: a list of numbers here holds at most 64");
    EXPECT_EQ(net(64, 64, 9).text,
              "terms[0].outputs[8]: the box has room for 8 outputs of one "
              "term, and this is one more");
}

}  // namespace
