// SPDX-License-Identifier: MIT
#include "host-tools/fitting/columns.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace compbox {

namespace {

struct unit {
    const char *name, *standard;
    double scale;  // standard units per unit
};

constexpr std::array<unit, 3> position_units = {
    {{"mm", "mm", 1.0}, {"m", "mm", 1e3}, {"um", "mm", 1e-3}}};
constexpr std::array<unit, 7> error_units = {{{"um", "um", 1.0},
                                              {"mm", "um", 1e3},
                                              {"nm", "um", 1e-3},
                                              {"urad", "urad", 1.0},
                                              {"mrad", "urad", 1e3},
                                              {"rad", "urad", 1e6},
                                              {"arcsec", "urad", 4.84813681109536}}};

const std::set<std::string> position_words = {
    "position",        "pos",          "target",  "targets",      "targetposition", "nominal",
    "nominalposition", "axisposition", "axispos", "sollposition", "zielposition",   "位置",
    "目标位置",        "目标"};
const std::set<std::string> error_words = {
    "error",         "err",          "deviation",  "dev",       "positioningerror",
    "positionerror", "straightness", "abweichung", "fehler",    "误差",
    "偏差",          "定位误差",     "直线度",     "直线度误差"};
const std::set<std::string> run_words = {"run", "runno", "runnumber", "lauf", "次数", "测量次数"};
const std::set<std::string> direction_words = {"direction", "dir", "richtung", "方向"};
const std::set<std::string> run_column_words = {"run", "lauf", "error", "deviation",
                                                "dev", "误差", "偏差",  "第"};
const std::map<std::string, int> branch_words = {
    {"", 0},        {"+", 1},   {"f", 1},     {"fwd", 1},  {"forward", 1},
    {"up", 1},      {"正", 1},  {"正向", 1},  {"次", 0},   {"次正向", 1},
    {"次反向", -1}, {"-", -1},  {"b", -1},    {"bwd", -1}, {"backward", -1},
    {"down", -1},   {"反", -1}, {"反向", -1}, {"r", -1},   {"reverse", -1}};

void replace_all(std::string &text, const std::string &from, const std::string &to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
        text.replace(at, from.size(), to);
        at += to.size();
    }
}

// Lower case, with one spelling of micro and of brackets.
std::string plain(const std::string &name) {
    std::string text = name;
    for (char &c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    for (const char *micro : {"\u00b5", "\u03bc"}) replace_all(text, micro, "u");
    for (const char *open : {"（", "[", "{"}) replace_all(text, open, "(");
    for (const char *close : {"）", "]", "}"}) replace_all(text, close, ")");
    replace_all(text, "微米", "um");
    replace_all(text, "毫米", "mm");
    replace_all(text, "arc sec", "arcsec");
    return text;
}

std::string without(const std::string &text, const std::string &unwanted) {
    std::string result;
    for (const char c : text) {
        if (unwanted.find(c) == std::string::npos) result += c;
    }
    return result;
}

struct word_and_unit {
    std::string word, unit;
};

// Splits "deviation (um)", "deviation_um", "deviation/um", "deviation um" into word and unit.
word_and_unit split_unit(const std::string &text) {
    const auto open = text.find('('), close = text.rfind(')');
    if (open != std::string::npos && close != std::string::npos && close > open) {
        return {text.substr(0, open) + text.substr(close + 1),
                without(text.substr(open + 1, close - open - 1), " ")};
    }
    const auto last = text.find_last_of("_/, ");
    if (last == std::string::npos) return {text, ""};
    return {text.substr(0, last), text.substr(last + 1)};
}

template <std::size_t n>
const unit *find_unit(const std::array<unit, n> &units, const std::string &name) {
    const auto found =
        std::find_if(units.begin(), units.end(), [&](const unit &one) { return name == one.name; });
    return found == units.end() ? nullptr : &*found;
}

// "run3forward" -> "@3+"; "" for other columns than runs.
std::string run_suffix(const std::string &word) {
    const auto digit = word.find_first_of("0123456789");
    if (digit == std::string::npos || run_column_words.count(word.substr(0, digit)) == 0) return "";
    auto end = word.find_first_not_of("0123456789", digit);
    if (end == std::string::npos) end = word.size();
    const auto branch = branch_words.find(word.substr(end));
    if (branch == branch_words.end() || end - digit > 4) return "";
    const char *sign = branch->second > 0 ? "+" : branch->second < 0 ? "-" : "";
    return fmt::format("@{}{}", word.substr(digit, end - digit), sign);
}

// Multiplies a column and gives it its standard name.
template <std::size_t n>
void convert(csv_table &table, std::size_t column, const std::string &start,
             const std::array<unit, n> &units) {
    std::string &name = table.names[column];
    if (name.compare(0, start.size(), start) != 0) return;
    const auto at = std::min(name.find('@'), name.size());
    const unit *found = find_unit(units, name.substr(start.size(), at - start.size()));
    if (found == nullptr) return;
    const std::string standard = start + found->standard + name.substr(at);
    if (standard != name && std::count(table.names.begin(), table.names.end(), standard) > 0)
        return;
    name = standard;
    if (found->scale == 1.0) return;
    for (auto &row : table.rows) row[column] *= found->scale;
}

}  // namespace

std::string canonical_column(const std::string &name) {
    const word_and_unit parts = split_unit(plain(name));
    const std::string word = without(parts.word, " ._:,/");
    const std::string whole = without(plain(name), " ._:");
    if (run_words.count(whole) > 0) return "run";
    if (direction_words.count(whole) > 0) return "direction";
    if (position_words.count(word) > 0 && find_unit(position_units, parts.unit)) {
        return "position_" + parts.unit;
    }
    if (find_unit(error_units, parts.unit) == nullptr) return name;
    if (error_words.count(word) > 0) return "error_" + parts.unit;
    const std::string run = run_suffix(word);
    return run.empty() ? name : fmt::format("error_{}{}", parts.unit, run);
}

bool is_position_without_unit(const std::string &name) {
    return position_words.count(without(plain(name), " ._:,/")) > 0;
}

bool is_error_without_unit(const std::string &name) {
    return error_words.count(without(plain(name), " ._:,/")) > 0;
}

void to_standard_units(csv_table &table) {
    for (std::size_t column = 0; column < table.names.size(); ++column) {
        convert(table, column, "position_", position_units);
        convert(table, column, "error_", error_units);
    }
}

bool is_run_column(const std::string &name, std::string &run, int &direction) {
    const auto at = name.find('@');
    if (name.compare(0, 6, "error_") != 0 || at == std::string::npos) return false;
    run = name.substr(at + 1);
    direction = run.back() == '+' ? 1 : run.back() == '-' ? -1 : 0;
    if (direction != 0) run.pop_back();
    return true;
}

}  // namespace compbox
