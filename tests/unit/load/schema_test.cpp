// SPDX-License-Identifier: MIT
// docs/coefficients.schema.json and docs/coefficient-file.md say what the loader's tables say: the
// same keys, required ones, ranges, words and defaults.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/paths.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow" /* a function is called like the struct that it returns \
                                           */
extern "C" {
#include "firmware/load/sections.h"
#include "firmware/terms/curves.h"
#include "firmware/terms/kinds.h"
#include "firmware/terms/load.h"
}
#pragma GCC diagnostic pop

using json = nlohmann::ordered_json;

namespace {

std::string read(const std::string &name) {
    std::ifstream file(from_source("docs/" + name));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

const std::string &manual() {
    static const std::string text = read("coefficient-file.md");
    return text;
}

const json &schema() {
    static const json value = json::parse(read("coefficients.schema.json"));
    return value;
}

// The schema of a value, with a "$ref" into "$defs" followed and merged.
json resolved(json node) {
    if (!node.contains("$ref")) return node;
    const std::string path = node["$ref"].get<std::string>().substr(1);
    json target = schema().at(json::json_pointer(path));
    node.erase("$ref");
    target.update(node);
    return resolved(target);
}

struct pairing {
    std::string name;  // in "$defs"; "" is the whole file
    cb_object object;
    std::string heading;  // in the manual
};
const std::vector<pairing> sections = {
    {"", cb_top_object, "## file"},
    {"machine", cb_machine_object, "## machine"},
    {"cycle", cb_cycle_object, "## cycle"},
    {"safety", cb_safety_object, "## safety"},
    {"plc", cb_plc_object, "## plc"},
    {"transport", cb_transport_object, "### transport"},
    {"tcp", cb_tcp_object, "### tcp"},
    {"rtu", cb_rtu_object, "### rtu"},
    {"bus", cb_bus_object, "## buses"},
    {"bus_line", cb_bus_line_object, "### rtu"},
    {"read_block", cb_read_block_object, "### read and write"},
    {"write_block", cb_write_block_object, "### read and write"},
    {"can", cb_can_object, "## can"},
    {"can_node", cb_can_node_object, "### nodes"},
    {"signal", cb_signal_object, "## signals"},
    {"channel", cb_channel_object, "## channels"},
    {"tangent", cb_tangent_object, "### tangent"},
    {"pair", cb_pair_object, "## pairs"},
};

// A kind of term, its parts, and the branch backward of a curve.
void add_kind(std::vector<pairing> &all, const std::string &name, const cb_term_kind &kind) {
    const std::string heading = "### " + name;
    all.push_back({name, kind.object, heading});
    const cb_object own = {kind.object.fields + CB_CURVE_KEYS,
                           static_cast<uint8_t>(kind.object.count - CB_CURVE_KEYS)};
    if (kind.curve) all.push_back({name + "_backward", own, heading});
    for (const cb_term_part *part = kind.parts; part && part->name; ++part) {
        const std::string own_heading = std::string("### ") + part->name;
        const bool own_section = manual().find("\n" + own_heading + "\n") != std::string::npos;
        all.push_back({part->name, *part->object, own_section ? own_heading : heading});
    }
}

const std::vector<pairing> pairings = [] {
    std::vector<pairing> all = sections;
#define ADD(NAME, name) add_kind(all, #name, cb_term_##name);
    CB_TERM_KINDS(ADD)
#undef ADD
    return all;
}();

json schema_of(const pairing &pair) {
    return !pair.name.empty() ? schema().at("$defs").at(pair.name) : schema();
}

template <class F>
void for_each_field(F look) {
    for (const pairing &pair : pairings) {
        const json node = schema_of(pair);
        for (int i = 0; i < pair.object.count; ++i) {
            const cb_field &field = pair.object.fields[i];
            if (field.kind == CB_FIELD_LATER) continue;
            ASSERT_TRUE(node["properties"].contains(field.key)) << pair.name << "." << field.key;
            look(pair, field, resolved(node["properties"][field.key]));
        }
    }
}

TEST(config_schema, has_the_keys_of_the_loader_and_no_others) {
    for (const pairing &pair : pairings) {
        const json node = schema_of(pair);
        std::set<std::string> keys, required, schema_keys;
        for (int i = 0; i < pair.object.count; ++i) {
            const cb_field &field = pair.object.fields[i];
            if (field.kind == CB_FIELD_LATER) continue;
            keys.insert(field.key);
            if (field.required) required.insert(field.key);
        }
        for (const auto &[key, value] : node["properties"].items()) schema_keys.insert(key);
        EXPECT_EQ(schema_keys, keys) << pair.name;
        EXPECT_EQ(node["required"].get<std::set<std::string>>(), required) << pair.name;
        EXPECT_EQ(node["additionalProperties"], false) << pair.name;
    }
}

TEST(config_schema, has_the_types_of_the_loader) {
    for_each_field([](const pairing &pair, const cb_field &field, const json &node) {
        static const char *const types[] = {"number", "number",  "integer", "integer", "integer",
                                            nullptr,  "boolean", nullptr,   "string",  "string",
                                            "string", "object",  "array",   nullptr,   nullptr};
        const char *type = types[field.kind];
        if (!type || !node.contains("type")) return;
        EXPECT_EQ(node["type"], type) << pair.name << "." << field.key;
    });
}

TEST(config_schema, has_the_ranges_of_the_loader) {
    int ranges = 0;
    for_each_field([&](const pairing &pair, const cb_field &field, const json &node) {
        if (!field.least || field.kind == CB_FIELD_SIGN) return;
        ASSERT_TRUE(node.contains("minimum") && node.contains("maximum")) << field.key;
        EXPECT_EQ(node["minimum"].get<double>(), std::atof(field.least)) << pair.name << field.key;
        EXPECT_EQ(node["maximum"].get<double>(), std::atof(field.most)) << pair.name << field.key;
        ++ranges;
    });
    EXPECT_GT(ranges, 35);
}

TEST(config_schema, has_the_words_of_the_loader) {
    int lists = 0;
    for_each_field([&](const pairing &pair, const cb_field &field, const json &node) {
        if (field.kind != CB_FIELD_WORD) return;
        std::set<std::string> words;
        for (const cb_word *word = field.words; word->word; ++word) words.insert(word->word);
        EXPECT_EQ(node["enum"].get<std::set<std::string>>(), words) << pair.name << field.key;
        ++lists;
    });
    EXPECT_EQ(lists, 11);
}

TEST(config_schema, has_the_defaults_of_the_loader) {
    int defaults = 0;
    for_each_field([&](const pairing &pair, const cb_field &field, const json &node) {
        if (!field.otherwise) return;
        ASSERT_TRUE(node.contains("default")) << pair.name << "." << field.key;
        const json &value = node["default"];
        const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        EXPECT_EQ(text, field.otherwise) << pair.name << "." << field.key;
        EXPECT_FALSE(field.required) << field.key;
        ++defaults;
    });
    EXPECT_GT(defaults, 10);
}

TEST(config_schema, has_the_maxima_of_the_box) {
    const auto most = [](const char *path) {
        return schema().at(json::json_pointer(path)).at("maxItems").get<int>();
    };
    EXPECT_EQ(most("/properties/signals"), CB_MAX_SIGNALS);
    EXPECT_EQ(most("/properties/buses"), CB_MAX_BUSES);
    EXPECT_EQ(most("/properties/terms"), CB_MAX_TERMS);
    EXPECT_EQ(most("/properties/channels"), CB_MAX_CHANNELS);
    EXPECT_EQ(most("/properties/pairs"), CB_MAX_PAIRS);
    EXPECT_EQ(most("/$defs/can/properties/nodes"), CB_MAX_CAN_NODES);
    EXPECT_EQ(most("/$defs/channel/properties/sum"), CB_MAX_SUM);
    EXPECT_EQ(most("/$defs/bspline/properties/control_points"), CB_MAX_CURVE_POINTS);
    EXPECT_EQ(most("/$defs/bank/properties/tau_s"), CB_MAX_BANK_TAUS);
    EXPECT_EQ(most("/$defs/bank/properties/inputs"), CB_MAX_SIGNALS);
    EXPECT_EQ(most("/$defs/bank/properties/powers/additionalProperties"), CB_MAX_BANK_POWER);
    EXPECT_EQ(most("/$defs/sigma/properties/offsets"), CB_MAX_DIRECTIONS);
    EXPECT_EQ(most("/$defs/sigma/properties/directions"), CB_MAX_DIRECTIONS);
    EXPECT_EQ(schema().at("/$defs/name/pattern"_json_pointer),
              "^[A-Za-z0-9_.-]{1," + std::to_string(CB_NAME_SIZE - 1) + "}$");
}

// The tables stay inside the sizes that the reader reserves for them.
TEST(config_schema, tables_fit_the_reader) {
    for (const pairing &pair : pairings) {
        EXPECT_LE(pair.object.count, CB_MAX_FIELDS) << pair.name;
        for (int i = 0; i < pair.object.count; ++i) {
            const cb_field &field = pair.object.fields[i];
            EXPECT_LT(std::string(field.key).size(), static_cast<size_t>(CB_KEY_SIZE));
            EXPECT_LT(std::string(field.least ? field.least : "").size(),
                      static_cast<size_t>(CB_TABLE_TEXT));
        }
    }
}

// Rows of the manual's section under a heading, up to the next one; terms share three keys.
std::string section(const std::string &heading) {
    const std::string &text = manual();
    const size_t start = text.find("\n" + heading + "\n");
    EXPECT_NE(start, std::string::npos) << heading;
    const std::string own = text.substr(start, text.find("\n#", start + 2) - start);
    const size_t terms = text.find("\n## terms\n"), after = text.find("\n## ", terms + 1);
    const bool is_kind = start > terms && start < after;
    return is_kind ? own + section("## terms") : own;
}

TEST(config_schema, the_manual_explains_every_key_with_range_and_default) {
    for_each_field([&](const pairing &pair, const cb_field &field, const json &) {
        const std::string rows = section(pair.heading);
        const size_t start = rows.find("\n| `" + std::string(field.key) + "` |");
        ASSERT_NE(start, std::string::npos) << pair.name << "." << field.key << " has no row";
        const std::string row = rows.substr(start + 1, rows.find('\n', start + 1) - start - 1);
        if (field.least && field.kind != CB_FIELD_SIGN) {
            const std::string range = std::string(field.least) + " … " + field.most;
            EXPECT_NE(row.find(range), std::string::npos) << pair.name << ": " << row;
        }
        if (field.otherwise) {
            const std::string otherwise = std::string("| ") + field.otherwise + " |";
            EXPECT_NE(row.find(otherwise), std::string::npos) << pair.name << ": " << row;
        }
        const bool printed = row.find("| required |") != std::string::npos;
        EXPECT_EQ(printed, field.required) << pair.name << row;
    });
}

}  // namespace
