// SPDX-License-Identifier: MIT
#include "host-tools/fitting/columns.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "host-tools/formats/error.h"
#include "host-tools/formats/text.h"
#include "host-tools/formats/units.h"

namespace compbox::fitting {

namespace {

using word_list = std::set<std::string>;

// Words as plain() writes them, without blanks and . _ : , /
const word_list nominal_words = {"target",
                                 "targets",
                                 "targetposition",
                                 "nominal",
                                 "nominalposition",
                                 "commanded",
                                 "commandedposition",
                                 "setpoint",
                                 "soll",
                                 "sollposition",
                                 "sollwert",
                                 "positionsoll",
                                 "ziel",
                                 "zielposition",
                                 "consigne",
                                 "positionconsigne",
                                 "positionnominale",
                                 "cible",
                                 "positioncible",
                                 "nominale",
                                 "posizionenominale",
                                 "nominal",
                                 "posicionnominal",
                                 "objetivo",
                                 "目标位置",
                                 "目标",
                                 "指令位置",
                                 "理论位置",
                                 "名义位置",
                                 "目標位置",
                                 "目標"};
const word_list position_words = {"position", "pos",     "axisposition", "axispos", "posizione",
                                  "posicion", "pozycja", "pozice",       "位置"};
const word_list error_words = {"error",
                               "err",
                               "deviation",
                               "dev",
                               "positioningerror",
                               "positionerror",
                               "straightness",
                               "abweichung",
                               "positionsabweichung",
                               "fehler",
                               "positionsfehler",
                               "geradheit",
                               "geradheitsabweichung",
                               "ecart",
                               "erreur",
                               "rectitude",
                               "errore",
                               "scostamento",
                               "deviazione",
                               "rettilineita",
                               "desviacion",
                               "rectitud",
                               "odchylka",
                               "odchylenie",
                               "误差",
                               "偏差",
                               "定位误差",
                               "直线度",
                               "直线度误差",
                               "誤差",
                               "真直度"};
const word_list actual_words = {"actual",
                                "actualposition",
                                "measured",
                                "measuredposition",
                                "measuredvalue",
                                "ist",
                                "istposition",
                                "istwert",
                                "positionist",
                                "messwert",
                                "gemessen",
                                "mesure",
                                "positionmesuree",
                                "positionreelle",
                                "reel",
                                "misurato",
                                "misurata",
                                "medido",
                                "posicionmedida",
                                "posicionreal",
                                "实际位置",
                                "实测位置",
                                "测量位置",
                                "实际",
                                "实测",
                                "实测值"};
const word_list run_words = {
    "run",       "runno", "runnumber", "lauf",  "laufnr", "laufnummer", "messung", "durchgang",
    "messreihe", "essai", "passage",   "prova", "corsa",  "ensayo",     "次数",    "测量次数"};
const word_list direction_column_words = {"direction",
                                          "dir",
                                          "richtung",
                                          "fahrtrichtung",
                                          "verfahrrichtung",
                                          "anfahrrichtung",
                                          "sens",
                                          "direzione",
                                          "direccion",
                                          "sentido",
                                          "方向"};
const std::map<std::string, int> direction_words = {
    {"+", 1},        {"1", 1},         {"+1", 1},         {"f", 1},          {"fwd", 1},
    {"forward", 1},  {"forwards", 1},  {"up", 1},         {"positive", 1},   {"pos", 1},
    {"plus", 1},     {"vor", 1},       {"vorwarts", 1},   {"vorwaerts", 1},  {"hin", 1},
    {"positiv", 1},  {"aller", 1},     {"avant", 1},      {"avanti", 1},     {"andata", 1},
    {"ida", 1},      {"adelante", 1},  {"正", 1},         {"正向", 1},       {"→", 1},
    {"↑", 1},        {"-", -1},        {"-1", -1},        {"b", -1},         {"r", -1},
    {"bwd", -1},     {"backward", -1}, {"backwards", -1}, {"down", -1},      {"reverse", -1},
    {"rev", -1},     {"negative", -1}, {"neg", -1},       {"minus", -1},     {"zuruck", -1},
    {"zurueck", -1}, {"ruck", -1},     {"rueck", -1},     {"ruckwarts", -1}, {"rueckwaerts", -1},
    {"her", -1},     {"negativ", -1},  {"retour", -1},    {"arriere", -1},   {"indietro", -1},
    {"ritorno", -1}, {"vuelta", -1},   {"atras", -1},     {"反", -1},        {"反向", -1},
    {"负向", -1},    {"←", -1},        {"↓", -1}};

// A straight reading follows its target. Further from it than this part of the travel is no
// position.
constexpr double most_of_travel = 0.05;
constexpr double um_per_mm = 1000.0;

std::string without(const std::string &text, const std::string &unwanted) {
    std::string result;
    for (const char c : text) {
        if (unwanted.find(c) == std::string::npos) result += c;
    }
    return result;
}

bool starts_with(const std::string &text, const std::string &start) {
    return text.compare(0, start.size(), start) == 0;
}

std::string word_of(const std::string &name) {
    return without(formats::plain(name), " ._:,/;");
}

// Whether a list has the word, with or without hyphens.
bool has(const word_list &list, const std::string &word) {
    return list.count(word) > 0 || list.count(without(word, "-")) > 0;
}

// The same for a position, which may name its axis: "X-Position", "Position X".
bool has_position(const word_list &list, const std::string &word) {
    const std::string bare = without(word, "-"), axes = "xyzuvw";
    if (has(list, bare) || bare.size() < 2) return has(list, bare);
    return (axes.find(bare.back()) != std::string::npos &&
            has(list, bare.substr(0, bare.size() - 1))) ||
           (axes.find(bare.front()) != std::string::npos && has(list, bare.substr(1)));
}

struct word_and_unit {
    std::string word;
    const formats::measuring_unit *unit;  // null: none, or unknown
};

// Splits "deviation (um)", "deviation_um", "deviation/um", "deviation um" into word and unit.
word_and_unit split_unit(const std::string &name) {
    const std::string text = formats::plain(name);
    const auto open = text.find('('), close = text.rfind(')');
    if (open != std::string::npos && close != std::string::npos && close > open) {
        return {word_of(text.substr(0, open) + text.substr(close + 1)),
                formats::find_unit(text.substr(open + 1, close - open - 1))};
    }
    const std::string arc = "arc sec";
    const bool two_words = text.size() > arc.size() && text.substr(text.size() - arc.size()) == arc;
    for (const char between : {'_', ' ', '/'}) {
        auto last = text.rfind(between);
        if (two_words && between == ' ') last = text.size() - arc.size() - 1;
        if (last == std::string::npos || last == 0) continue;
        const formats::measuring_unit *unit = formats::find_unit(text.substr(last + 1));
        if (unit != nullptr) return {word_of(text.substr(0, last)), unit};
    }
    return {word_of(text), nullptr};
}

bool is_angle(const formats::measuring_unit &unit) {
    return unit.of == formats::quantity::angle;
}

bool is_length(const formats::measuring_unit &unit) {
    return unit.of == formats::quantity::length;
}

// "+", "-" or "" for the direction of a word; nothing for another word
const char *sign_of(const std::string &word) {
    if (word.empty() || word == "次") return "";
    const auto found = direction_words.find(word.rfind("次", 0) == 0 ? word.substr(3) : word);
    if (found == direction_words.end()) return nullptr;
    return found->second > 0 ? "+" : "-";
}

// out: "@3+" for what follows the word of a run: "3", "3vorwarts", "vorwarts3", "vorwarts"; else ""
std::string run_suffix(const std::string &rest) {
    const char *const digits = "0123456789";
    const auto start = std::min(rest.find_first_of(digits), rest.size());
    const auto end = std::min(rest.find_first_not_of(digits, start), rest.size());
    const char *before = sign_of(rest.substr(0, start)), *after = sign_of(rest.substr(end));
    if (before == nullptr || after == nullptr || end - start > 4) return "";
    const std::string sign = *before != 0 ? before : after;
    if (start == end) return sign.empty() ? "" : "@1" + sign;
    if (*before != 0 && *after != 0) return "";
    return fmt::format("@{}{}", rest.substr(start, end - start), sign);
}

// out: "error_um@3+", "actual_mm@3" for a column of one run; "" for other words
std::string run_column(const std::string &word, const std::string &unit, bool length) {
    static const word_list lone = {"", "第"};  // a direction alone: "hin", "forward 2"
    const std::string bare = word.substr(0, word.find_first_of("0123456789"));
    const bool short_word = bare.size() < 3 || bare == "pos" || bare == "neg";
    for (const word_list *list : {&run_words, &error_words, &actual_words, &lone}) {
        for (const auto &start : *list) {
            if (!starts_with(word, start) || word.size() == start.size()) continue;
            if (start.empty() && short_word) continue;
            const std::string suffix = run_suffix(word.substr(start.size()));
            if (suffix.empty()) continue;
            return (list == &actual_words && length ? "actual_" : "error_") + unit + suffix;
        }
    }
    return "";
}

struct unit_name {
    std::string start, end;               // "error_", "@3+"
    const formats::measuring_unit *unit;  // null for other names
};

// "error_mm@3+" -> "error_", mm, "@3+"
unit_name parse(const std::string &name) {
    for (const std::string start : {"nominal_", "position_", "error_", "actual_"}) {
        if (!starts_with(name, start)) continue;
        const auto at = std::min(name.find('@'), name.size());
        const std::string unit = name.substr(start.size(), at - start.size());
        return {start, name.substr(at), formats::find_unit(unit)};
    }
    return {"", "", nullptr};
}

// Converts a column, and gives it the name of the standard unit.
void convert(formats::csv_table &table, std::size_t column) {
    const unit_name parts = parse(table.names[column]);
    if (parts.unit == nullptr) return;
    const bool error = parts.start == "error_";
    const formats::measuring_unit &to = *formats::find_unit(is_angle(*parts.unit) ? "urad"
                                                            : error               ? "um"
                                                                                  : "mm");
    const std::string name = parts.start + to.name + parts.end;
    if (name == table.names[column]) return;
    if (std::count(table.names.begin(), table.names.end(), name) > 0) {
        throw input_error(table.file, table.header_line, 0,
                          "has the columns {} and {}; keep one of them", name, table.names[column]);
    }
    table.names[column] = name;
    for (auto &row : table.rows) row[column] = formats::converted(row[column], *parts.unit, to);
}

// The nominal position is the position; a column "Pos." beside it is something else.
void choose_position(formats::csv_table &table) {
    const bool nominal = std::any_of(table.names.begin(), table.names.end(), [](const auto &name) {
        return starts_with(name, "nominal_");
    });
    for (auto &name : table.names) {
        if (nominal && starts_with(name, "position_")) name = "beside " + name;
    }
    for (auto &name : table.names) {
        if (starts_with(name, "nominal_")) name.replace(0, 8, "position_");
        if (parse(name).start != "position_" || parse(name).unit == nullptr) continue;
        if (!is_angle(*parse(name).unit)) continue;
        throw input_error(table.file, table.header_line, 0,
                          "the positions are angles; rotary axes are not read yet");
    }
}

// Readings in µm beside positions in mm are deviations, whatever their column's name.
void choose_readings(formats::csv_table &table) {
    const formats::measuring_unit *position = nullptr;
    for (const auto &name : table.names) {
        const unit_name parts = parse(name);
        if (parts.start == "position_") position = parts.unit;
    }
    for (auto &name : table.names) {
        const unit_name parts = parse(name);
        if (parts.start != "actual_" || parts.unit == nullptr || position == nullptr) continue;
        const bool small = parts.unit->factor < formats::find_unit("mm")->factor;
        if (small && parts.unit != position) name.replace(0, parts.start.size(), "error_");
    }
}

// in : a column of measured positions, mm. out: error_um, measured less nominal
void subtract_nominal(formats::csv_table &table, std::size_t column, std::size_t position) {
    double low = 1e300, high = -1e300, furthest = 0.0;
    const auto &front = table.rows.front();
    const double first = front[column] - front[position];
    for (auto &row : table.rows) {
        const double difference = row[column] - row[position];
        low = std::min(low, row[position]);
        high = std::max(high, row[position]);
        furthest = std::max(furthest, std::abs(difference - first));
        row[column] = um_per_mm * difference;
    }
    if (furthest > most_of_travel * (high - low) && table.rows.size() > 1) {
        throw input_error(table.file, table.header_line, 0,
                          "the measured position does not follow the nominal one ({:.4g} mm apart "
                          "on {:.4g} mm of travel): check the columns and their units",
                          furthest, high - low);
    }
    table.names[column].replace(0, std::string("actual_mm").size(), "error_um");
}

// Throws where a column of errors beside nominal and measured position has the other sign.
void check_sign(const formats::csv_table &table, std::size_t error, std::size_t actual,
                std::size_t position) {
    double as_here = 0.0, turned = 0.0;
    for (const auto &row : table.rows) {
        const double difference = um_per_mm * (row[actual] - row[position]);
        as_here += std::abs(row[error] - difference);
        turned += std::abs(row[error] + difference);
    }
    if (turned >= 0.5 * as_here) return;
    throw input_error(table.file, table.header_line, 0,
                      "the error is the nominal less the measured position; compbox takes measured "
                      "less nominal: remove the column of the error");
}

// Measured positions become errors, unless the table has these too.
void take_measured_positions(formats::csv_table &table) {
    if (std::none_of(table.names.begin(), table.names.end(),
                     [](const auto &name) { return starts_with(name, "actual_mm"); })) {
        return;
    }
    const std::size_t position = table.column("position_mm");
    const int error = table.find("error_um");
    for (std::size_t column = 0; column < table.names.size(); ++column) {
        const std::string name = table.names[column];
        if (!starts_with(name, "actual_mm")) continue;
        table.column(name);  // throws for a cell that is no number
        if (error < 0) {
            subtract_nominal(table, column, position);
        } else {
            check_sign(table, static_cast<std::size_t>(error), column, position);
        }
    }
}

// A column that could not get its standard name, because another has it.
void refuse_second(const formats::csv_table &table, const column_units &missing) {
    for (const auto &name : table.names) {
        const std::string other = canonical_column(name, missing);
        if (other == name || std::count(table.names.begin(), table.names.end(), other) == 0)
            continue;
        const bool position = parse(other).start == "position_" || parse(other).start == "nominal_";
        throw input_error(table.file, table.header_line, 0,
                          "the column '{}' holds {} too; keep one of these columns", name,
                          position            ? "the position"
                          : parse(other).unit ? "the error"
                                              : other);
    }
}

}  // namespace

std::string canonical_column(const std::string &name, const column_units &missing) {
    const word_and_unit parts = split_unit(name);
    const std::string whole = word_of(name);
    if (run_words.count(whole) > 0) return "run";
    if (direction_column_words.count(whole) > 0) return "direction";
    const bool nominal = has_position(nominal_words, parts.word);
    const bool position = nominal || has_position(position_words, parts.word);
    const formats::measuring_unit *unit = parts.unit;
    const bool bare = unit == nullptr && formats::split_brackets(name).unit.empty();
    if (bare) unit = formats::find_unit(position ? missing.position : missing.error);
    if (unit == nullptr) return name;
    if (position && (is_length(*unit) || is_angle(*unit))) {
        return fmt::format("{}_{}", nominal ? "nominal" : "position", unit->name);
    }
    if (!is_length(*unit) && !is_angle(*unit)) return name;
    if (has(error_words, parts.word)) return fmt::format("error_{}", unit->name);
    if (has_position(actual_words, parts.word)) {
        return fmt::format("{}_{}", is_length(*unit) ? "actual" : "error", unit->name);
    }
    const std::string run = run_column(parts.word, unit->name, is_length(*unit));
    return run.empty() ? name : run;
}

bool is_position_word(const std::string &name) {
    const std::string word = word_of(name);
    return has_position(nominal_words, word) || has_position(position_words, word);
}

bool is_error_word(const std::string &name) {
    const std::string word = word_of(name);
    return has(error_words, word) || has_position(actual_words, word) ||
           !run_column(word, "um", true).empty();
}

int direction_of(const std::string &word) {
    const auto found = direction_words.find(without(formats::plain(word), " ._:"));
    return found == direction_words.end() ? 0 : found->second;
}

void to_standard_units(formats::csv_table &table, const column_units &missing) {
    refuse_second(table, missing);
    choose_position(table);
    choose_readings(table);
    for (std::size_t column = 0; column < table.names.size(); ++column) convert(table, column);
    take_measured_positions(table);
}

column_units units_of_option(const std::string &text) {
    if (text.empty()) return {};
    const auto pieces = formats::split(text, ',');
    for (const auto &piece : pieces) {
        const formats::measuring_unit *unit = formats::find_unit(piece);
        const bool fits = unit != nullptr && (is_length(*unit) || is_angle(*unit));
        if (fits && pieces.size() <= 2) continue;
        throw input_error(
            fmt::format("--unit: '{}' must be the unit of the error, or those of "
                        "position and error, as in mm,um; known are {}",
                        text, known_units()));
    }
    if (pieces.size() == 2) return {pieces[0], pieces[1]};
    const bool both = is_length(*formats::find_unit(text)) &&
                      formats::find_unit(text)->factor >= formats::find_unit("mm")->factor;
    return {both ? text : "", text};
}

std::string known_units() {
    return "mm, um, nm, cm, m, in, thou, uin; urad, mrad, rad, deg, arcmin, arcsec, um/m, mm/m";
}

bool is_run_column(const std::string &name, std::string &run, int &direction) {
    const auto at = name.find('@');
    if (!starts_with(name, "error_") || at == std::string::npos) return false;
    run = name.substr(at + 1);
    direction = run.back() == '+' ? 1 : run.back() == '-' ? -1 : 0;
    if (direction != 0) run.pop_back();
    return true;
}

}  // namespace compbox::fitting
