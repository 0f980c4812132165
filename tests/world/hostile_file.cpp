// SPDX-License-Identifier: MIT
#include "tests/world/hostile_file.h"

#include <cctype>
#include <nlohmann/json.hpp>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::world {

namespace {

void flip_bits(std::string &text, dice &chance) {
    for (std::uint64_t i = 0, count = 1 + chance.below(4); i < count && !text.empty(); ++i) {
        char &byte = text[chance.below(text.size())];
        byte = static_cast<char>(byte ^ (1 << chance.below(8)));
    }
}

void cut(std::string &text, dice &chance) {
    text.resize(chance.below(text.size() + 1));
}

// Removes, doubles or exchanges lines.
void disturb_lines(std::string &text, dice &chance) {
    std::vector<std::string> lines(1);
    for (const char letter : text) {
        if (letter == '\n')
            lines.emplace_back();
        else
            lines.back() += letter;
    }
    const std::size_t a = chance.below(lines.size()), b = chance.below(lines.size());
    const std::uint64_t way = chance.below(3);
    if (way == 0) lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(a));
    if (way == 1) lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(a), lines[b]);
    if (way == 2) std::swap(lines[a], lines[b]);
    text.clear();
    for (const auto &line : lines) text += line + "\n";
}

// Puts another token in place of a number.
void change_number(std::string &text, dice &chance) {
    static const std::vector<std::string> odd = {"0",
                                                 "-0",
                                                 "-1",
                                                 "1",
                                                 "0.5",
                                                 "1e308",
                                                 "-1e308",
                                                 "1e-320",
                                                 "1e400",
                                                 "NaN",
                                                 "Infinity",
                                                 "65535",
                                                 "65536",
                                                 "2147483647",
                                                 "2147483648",
                                                 "4294967296",
                                                 "99999999999999999999",
                                                 "null",
                                                 "true",
                                                 "\"\"",
                                                 "[]",
                                                 "{}",
                                                 "1e-7",
                                                 "1000000",
                                                 "3.4028235e38",
                                                 "0x10",
                                                 "01",
                                                 "1.",
                                                 "--1",
                                                 "1e",
                                                 "16",
                                                 "256"};
    if (text.empty()) return;
    std::size_t at = chance.below(text.size());
    while (at < text.size() && !std::isdigit(static_cast<unsigned char>(text[at]))) ++at;
    std::size_t end = at;
    while (end < text.size() && std::string("0123456789.eE+-").find(text[end]) != std::string::npos)
        ++end;
    if (at < end) text.replace(at, end - at, chance.one_of(odd));
}

void add_bytes(std::string &text, dice &chance) {
    switch (chance.below(6)) {
        case 0:
            text.insert(0, "\xEF\xBB\xBF");
            break;
        case 1:
            text += text;
            break;
        case 2: {
            const std::string zeros(1 + chance.below(9), '\0');
            text.insert(chance.below(text.size() + 1), zeros);
            break;
        }
        case 3:
            text.insert(chance.below(text.size() + 1), std::string(300000, ' '));
            break;
        case 4:
            text = std::string(1 + chance.below(5000), '[');
            break;
        default:
            text.clear();
    }
}

// All nodes below, in the order of the file.
void collect(json &node, std::vector<json *> &all) {
    all.push_back(&node);
    if (!node.is_structured()) return;
    for (auto &child : node) collect(child, all);
}

json &any_of(json &root, dice &chance) {
    std::vector<json *> all;
    collect(root, all);
    return *chance.one_of(all);
}

// A change that keeps the form of the file.
void change_value(json &root, dice &chance) {
    json &node = any_of(root, chance);
    if (node.is_number()) {
        static const std::vector<double> factors = {-1, 0, 0.5, 0.9, 1.1, 2, 10, 1000, 1e-3};
        const double changed = node.get<double>() * chance.one_of(factors);
        if (node.is_number_integer() &&
            changed == static_cast<double>(static_cast<std::int64_t>(changed)))
            node = static_cast<std::int64_t>(changed);
        else
            node = changed;
    } else if (node.is_structured() && !node.empty()) {
        auto child = node.begin();
        std::advance(child, static_cast<std::ptrdiff_t>(chance.below(node.size())));
        if (node.is_array() && chance.one_in(2))
            node.push_back(json(*child));
        else
            node.erase(child);
    } else if (node.is_string()) {
        node = chance.one_in(2) ? "X" : std::string(chance.below(80), 'a');
    }
}

// Limits that are wider or narrower, of a channel, a pair or all.
void change_limits(json &root, dice &chance) {
    const double factor = chance.log_between(0.05, 20);
    for (const char *list : {"channels", "pairs"}) {
        if (!root.contains(list)) continue;
        for (auto &entry : root[list]) {
            for (const char *key : {"limit_um", "slew_um_per_s", "error_um", "max_difference_um"}) {
                if (entry.is_object() && entry.contains(key) && entry[key].is_number() &&
                    !chance.one_in(3))
                    entry[key] = entry[key].get<double>() * factor;
            }
        }
    }
    if (root.contains("safety") && chance.one_in(2))
        root["safety"]["ramp_um_per_s"] = chance.log_between(1, 1000);
    if (root.contains("safety") && chance.one_in(2))
        root["safety"]["hold_ms"] = chance.below(60000);
}

void move_registers(json &root, dice &chance) {
    if (!root.contains("channels") || !root["channels"].is_array() || root["channels"].empty())
        return;
    json &channel = root["channels"][chance.below(root["channels"].size())];
    if (!channel.is_object() || !channel.contains("plc") || !channel["plc"].is_number()) return;
    switch (chance.below(3)) {
        case 0:
            channel["plc"] =
                channel["plc"].get<double>() + static_cast<double>(chance.time_between(-2, 2));
            break;
        case 1:
            channel["sign"] = -1;
            break;
        default:
            channel["scale"] = chance.log_between(1e-4, 10);
    }
}

}  // namespace

std::string hostile_file(const std::string &good, dice &chance) {
    std::string text = good;
    for (std::uint64_t i = 0, count = 1 + chance.below(3); i < count; ++i) {
        const std::uint64_t way = chance.below(14);
        if (way < 5) {
            void (*const ways[])(std::string &, dice &) = {flip_bits, cut, disturb_lines,
                                                           change_number, add_bytes};
            ways[way](text, chance);
            continue;
        }
        json root = json::parse(text, nullptr, false);
        if (!root.is_object()) continue;
        if (way < 9)
            change_value(root, chance);
        else if (way < 12)
            change_limits(root, chance);
        else
            move_registers(root, chance);
        text = root.dump(1);
    }
    return text;
}

}  // namespace compbox::world
