// SPDX-License-Identifier: MIT
#include "host-tools/formats/csv_cells.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace compbox::formats::csv_cells {

std::string_view trim(std::string_view text) {
    const auto blank = [](char c) { return c == ' ' || c == '\r' || c == '\t'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
        text = text.substr(1, text.size() - 2);
    }
    return text;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    if (separator == ' ') text = trim(text);
    std::vector<std::string_view> parts;
    std::size_t start = 0;
    bool quoted = false;
    for (std::size_t i = 0; i <= text.size(); ++i) {
        if (i < text.size() && text[i] == '"') quoted = !quoted;
        if (i < text.size() && (quoted || text[i] != separator)) continue;
        if (separator != ' ' || i > start) parts.push_back(text.substr(start, i - start));
        start = i + 1;
    }
    if (quoted) parts = {text};  // an open quote; the count of columns reports it
    return parts;
}

std::vector<std::string_view> without_empty_end(std::vector<std::string_view> cells,
                                                std::size_t columns) {
    while (cells.size() > columns && trim(cells.back()).empty()) cells.pop_back();
    return cells;
}

bool to_number(std::string_view cell, char separator, double &value, bool &beyond) {
    std::string text(trim(cell));
    if (separator != ',' || cell.find('"') != std::string_view::npos) {
        std::replace(text.begin(), text.end(), ',', '.');
    }
    const std::string minus = "\u2212";  // typographic minus
    if (text.compare(0, minus.size(), minus) == 0) text.replace(0, minus.size(), "-");
    const char *begin = text.data() + (!text.empty() && text[0] == '+' ? 1 : 0);
    const char *end = text.data() + text.size();
    const auto result = std::from_chars(begin, end, value);
    beyond = result.ec == std::errc::result_out_of_range;
    return result.ec == std::errc() && result.ptr == end && std::isfinite(value);
}

bool is_in_thousands(std::string_view cell) {
    if (cell.find('"') == std::string_view::npos) return false;
    std::string_view text = trim(cell);
    if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
    const std::size_t first = text.find(',');
    if (first == std::string_view::npos || first < 1 || first > 3 || text[0] == '0') return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool comma = i >= first && (i - first) % 4 == 0;
        if (comma ? text[i] != ',' : text[i] < '0' || text[i] > '9') return false;
    }
    return (text.size() - first) % 4 == 0;
}

bool has_decimal_commas(const std::vector<std::string_view> &lines) {
    constexpr char separator = ',';
    const auto shows = [](std::string_view cell) {
        double value = 0.0;
        bool beyond = false;
        return cell.find('"') != std::string_view::npos &&
               cell.find(',') != std::string_view::npos &&
               to_number(cell, separator, value, beyond) && !is_in_thousands(cell);
    };
    return std::any_of(lines.begin(), lines.end(), [&](std::string_view line) {
        if (line.find('"') == std::string_view::npos) return false;
        const auto cells = split(line, separator);
        return std::any_of(cells.begin(), cells.end(), shows);
    });
}

}  // namespace compbox::formats::csv_cells
