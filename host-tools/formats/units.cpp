// SPDX-License-Identifier: MIT
#include "host-tools/formats/units.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

namespace compbox::formats {

namespace {

constexpr double urad_per_degree = 17453.292519943295;

constexpr std::array<measuring_unit, 27> units = {
    {{"um", quantity::length, 1.0, 0.0},
     {"mm", quantity::length, 1e3, 0.0},
     {"nm", quantity::length, 1e-3, 0.0},
     {"cm", quantity::length, 1e4, 0.0},
     {"m", quantity::length, 1e6, 0.0},
     {"in", quantity::length, 25400.0, 0.0},
     {"ft", quantity::length, 304800.0, 0.0},
     {"thou", quantity::length, 25.4, 0.0},
     {"uin", quantity::length, 0.0254, 0.0},
     {"urad", quantity::angle, 1.0, 0.0},
     {"mrad", quantity::angle, 1e3, 0.0},
     {"rad", quantity::angle, 1e6, 0.0},
     {"deg", quantity::angle, urad_per_degree, 0.0},
     {"arcmin", quantity::angle, urad_per_degree / 60.0, 0.0},
     {"arcsec", quantity::angle, 4.84813681109536, 0.0},
     {"gon", quantity::angle, 0.9 * urad_per_degree, 0.0},
     {"um/m", quantity::angle, 1.0, 0.0},
     {"mm/m", quantity::angle, 1e3, 0.0},
     {"degC", quantity::temperature, 1.0, 0.0},
     {"degF", quantity::temperature, 1.0 / 1.8, -32.0 / 1.8},
     {"K", quantity::temperature, 1.0, -273.15},
     {"s", quantity::duration, 1.0, 0.0},
     {"ms", quantity::duration, 1e-3, 0.0},
     {"min", quantity::duration, 60.0, 0.0},
     {"h", quantity::duration, 3600.0, 0.0},
     {"rpm", quantity::rotation, 1.0, 0.0},
     {"rps", quantity::rotation, 60.0, 0.0}}};

// Other spellings, as plain() leaves them, without blanks.
const std::map<std::string, std::string> spellings = {{"micron", "um"},
                                                      {"microns", "um"},
                                                      {"micrometer", "um"},
                                                      {"micrometre", "um"},
                                                      {"mikrometer", "um"},
                                                      {"mikron", "um"},
                                                      {"微米", "um"},
                                                      {"millimeter", "mm"},
                                                      {"millimetre", "mm"},
                                                      {"millimeters", "mm"},
                                                      {"毫米", "mm"},
                                                      {"meter", "m"},
                                                      {"metre", "m"},
                                                      {"inch", "in"},
                                                      {"inches", "in"},
                                                      {"zoll", "in"},
                                                      {"pouce", "in"},
                                                      {"pouces", "in"},
                                                      {"英寸", "in"},
                                                      {"mil", "thou"},
                                                      {"mils", "thou"},
                                                      {"microinch", "uin"},
                                                      {"microinches", "uin"},
                                                      {"uinch", "uin"},
                                                      {"mikrozoll", "uin"},
                                                      {"microrad", "urad"},
                                                      {"微弧度", "urad"},
                                                      {"um/mm", "mrad"},
                                                      {"grad", "deg"},
                                                      {"degree", "deg"},
                                                      {"degrees", "deg"},
                                                      {"度", "deg"},
                                                      {"arcminute", "arcmin"},
                                                      {"arcminutes", "arcmin"},
                                                      {"winkelminute", "arcmin"},
                                                      {"winkelminuten", "arcmin"},
                                                      {"arcsecond", "arcsec"},
                                                      {"arcseconds", "arcsec"},
                                                      {"arc-sec", "arcsec"},
                                                      {"asec", "arcsec"},
                                                      {"winkelsekunde", "arcsec"},
                                                      {"winkelsekunden", "arcsec"},
                                                      {"bogensekunde", "arcsec"},
                                                      {"bogensekunden", "arcsec"},
                                                      {"秒角", "arcsec"},
                                                      {"角秒", "arcsec"},
                                                      {"um/1000mm", "um/m"},
                                                      {"mm/1000mm", "mm/m"},
                                                      {"c", "degC"},
                                                      {"degc", "degC"},
                                                      {"celsius", "degC"},
                                                      {"℃", "degC"},
                                                      {"f", "degF"},
                                                      {"degf", "degF"},
                                                      {"fahrenheit", "degF"},
                                                      {"k", "K"},
                                                      {"kelvin", "K"},
                                                      {"sec", "s"},
                                                      {"sek", "s"},
                                                      {"seconds", "s"},
                                                      {"sekunden", "s"},
                                                      {"秒", "s"},
                                                      {"minutes", "min"},
                                                      {"minuten", "min"},
                                                      {"hours", "h"},
                                                      {"std", "h"},
                                                      {"stunden", "h"},
                                                      {"1/min", "rpm"},
                                                      {"min-1", "rpm"},
                                                      {"u/min", "rpm"},
                                                      {"tr/min", "rpm"},
                                                      {"rev/min", "rpm"},
                                                      {"giri/min", "rpm"},
                                                      {"hz", "rps"},
                                                      {"1/s", "rps"}};

// Letters with accents and other signs, and how plain() writes them.
const std::vector<std::pair<const char *, const char *>> signs = {
    {"ä", "a"},           {"à", "a"},           {"á", "a"},   {"â", "a"},
    {"ã", "a"},           {"å", "a"},           {"ç", "c"},   {"č", "c"},
    {"é", "e"},           {"è", "e"},           {"ê", "e"},   {"ë", "e"},
    {"ě", "e"},           {"í", "i"},           {"ì", "i"},   {"î", "i"},
    {"ï", "i"},           {"ñ", "n"},           {"ó", "o"},   {"ò", "o"},
    {"ô", "o"},           {"ö", "o"},           {"ø", "o"},   {"ř", "r"},
    {"š", "s"},           {"ß", "ss"},          {"ú", "u"},   {"ù", "u"},
    {"û", "u"},           {"ü", "u"},           {"ý", "y"},   {"ž", "z"},
    {"Ä", "a"},           {"À", "a"},           {"Â", "a"},   {"Ç", "c"},
    {"É", "e"},           {"È", "e"},           {"Ê", "e"},   {"Í", "i"},
    {"Ñ", "n"},           {"Ó", "o"},           {"Ö", "o"},   {"Ú", "u"},
    {"Ü", "u"},           {"ł", "l"},           {"ą", "a"},   {"ę", "e"},
    {"ó", "o"},           {"\u00b5", "u"},  // micro sign
    {"\u03bc", "u"},                        // Greek letter
    {"（", "("},          {"[", "("},           {"{", "("},   {"<", "("},
    {"）", ")"},          {"]", ")"},           {"}", ")"},   {">", ")"},
    {"\u2032", "arcmin"}, {"\u2033", "arcsec"}, {"°", "deg"}, {"º", "deg"},
    {"⁻¹", "-1"},         {"\u2212", "-"},      {"：", ":"},  {"\u00a0", " "},
    {"\u202f", " "},      {"\u2009", " "},      {"\t", " "}};

void replace_all(std::string &text, const std::string &from, const std::string &to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
        text.replace(at, from.size(), to);
        at += to.size();
    }
}

const measuring_unit *unit_of_name(const std::string &name) {
    const auto found = std::find_if(units.begin(), units.end(),
                                    [&](const measuring_unit &one) { return name == one.name; });
    return found == units.end() ? nullptr : &*found;
}

// "dx1_um" -> "dx1" and um; a name without a unit at its end -> null
wanted_column with_unit_at_end(const std::string &name) {
    const auto last = name.rfind('_');
    if (last == std::string::npos) return {name, nullptr};
    return {name.substr(0, last), unit_of_name(name.substr(last + 1))};
}

}  // namespace

std::string plain(const std::string &text) {
    std::string result = text;
    for (char &c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    for (const auto &[from, to] : signs) replace_all(result, from, to);
    return result;
}

const measuring_unit *find_unit(const std::string &spelling) {
    std::string word;
    for (const char c : plain(spelling)) {
        if (c != ' ' && c != '(' && c != ')' && c != '.') word += c;
    }
    const auto other = spellings.find(word);
    return unit_of_name(other == spellings.end() ? word : other->second);
}

double converted(double value, const measuring_unit &from, const measuring_unit &to) {
    if (&from == &to) return value;
    const double zero = (from.zero - to.zero) / to.factor;
    return value * (from.factor / to.factor) + zero;
}

name_and_unit split_brackets(const std::string &text) {
    const std::pair<std::string, std::string> brackets[] = {
        {"[", "]"}, {"(", ")"}, {"{", "}"}, {"（", "）"}, {"【", "】"}};
    for (const auto &[open, close] : brackets) {
        const std::size_t start = text.rfind(open), inside = start + open.size();
        if (start == std::string::npos || text.size() < inside + close.size()) continue;
        if (text.compare(text.size() - close.size(), close.size(), close) != 0) continue;
        const auto end = text.substr(0, start).find_last_not_of(' ');
        if (end == std::string::npos) continue;
        return {text.substr(0, end + 1), text.substr(inside, text.size() - close.size() - inside)};
    }
    return {text, ""};
}

wanted_column machine_unit(const std::string &name, const measuring_unit &is) {
    const measuring_unit *end = with_unit_at_end(name).in;
    if (end != nullptr && end->of == is.of) return {name, end};
    switch (is.of) {
        case quantity::length:
            return {name, unit_of_name(is.factor < 1e3 ? "um" : "mm")};
        case quantity::angle:
            return {name, unit_of_name(std::string(is.name) == "deg" ? "deg" : "urad")};
        case quantity::temperature:
            return {name, unit_of_name("degC")};
        case quantity::duration:
            return {name + "_s", unit_of_name("s")};
        case quantity::rotation:
            return {name, unit_of_name("rpm")};
    }
    return {name, &is};
}

unit_choice units_of_names(const std::vector<std::string> &names) {
    return [names](const std::string &bare, const measuring_unit &is) -> wanted_column {
        for (const auto &name : names) {
            const wanted_column end = with_unit_at_end(name);
            if (end.in != nullptr && end.name == bare && end.in->of == is.of) return {name, end.in};
        }
        return machine_unit(bare, is);
    };
}

}  // namespace compbox::formats
