// SPDX-License-Identifier: MIT
#include "host-tools/formats/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

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
    std::vector<std::string_view> parts;
    std::size_t start = 0;
    for (std::size_t i = 0; i <= text.size(); ++i) {
        if (i == text.size() || text[i] == separator) {
            parts.push_back(text.substr(start, i - start));
            start = i + 1;
        }
    }
    return parts;
}

// The separator of a header line: a tab or semicolon wherever one stands, else a comma.
char separator_of(std::string_view header) {
    if (header.find('\t') != std::string_view::npos) return '\t';
    if (header.find(';') != std::string_view::npos) return ';';
    return ',';
}

struct place {
    const std::string &file;
    long line;
    long column;
};

// A cell as a finite number; a decimal comma is read where the comma does not separate columns.
double number(std::string_view cell, char separator, const place &at) {
    std::string text(trim(cell));
    if (separator != ',') std::replace(text.begin(), text.end(), ',', '.');
    const char *begin = text.data() + (!text.empty() && text[0] == '+' ? 1 : 0);
    const char *end = text.data() + text.size();
    double value = 0.0;
    const auto result = std::from_chars(begin, end, value);
    if (text.empty()) throw input_error(at.file, at.line, at.column, "a number is missing here");
    if (result.ec == std::errc::result_out_of_range) {
        throw input_error(at.file, at.line, at.column,
                          "'" + text + "' is beyond what a number can hold");
    }
    if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) {
        throw input_error(at.file, at.line, at.column, "'" + text + "' is not a finite number");
    }
    return value;
}

// The number of a word in its list, added where it is new.
double word(std::string_view cell, std::vector<std::string> &list) {
    const std::string text(trim(cell));
    const auto index =
        static_cast<std::size_t>(std::find(list.begin(), list.end(), text) - list.begin());
    if (index == list.size()) list.push_back(text);
    return static_cast<double>(index);
}

void read_header(csv_table &table, std::string_view line, char separator, long line_number) {
    for (const auto part : split(line, separator)) {
        const std::string name(trim(part));
        if (name.empty()) {
            throw input_error(table.file, line_number, 0, "a column of the header has no name");
        }
        if (table.find(name) >= 0) {
            throw input_error(table.file, line_number, 0,
                              "the column '" + name + "' is there twice");
        }
        table.names.push_back(name);
    }
}

}  // namespace

int csv_table::find(const std::string &name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::size_t csv_table::column(const std::string &name) const {
    const int index = find(name);
    if (index >= 0) return static_cast<std::size_t>(index);
    std::string there;
    for (const auto &other : names) there += (there.empty() ? "" : ", ") + other;
    throw input_error(file, 0, 0, "has no column '" + name + "' (it has " + there + ")");
}

std::vector<double> csv_table::values(const std::string &name) const {
    const std::size_t index = column(name);
    std::vector<double> result;
    result.reserve(rows.size());
    for (const auto &row : rows) result.push_back(row[index]);
    return result;
}

csv_table read_csv(const std::string &path, const std::vector<std::string> &words,
                   std::vector<std::vector<std::string>> *word_lists) {
    const std::string content = read_file(path);
    std::string_view text = content;
    if (text.substr(0, byte_order_mark.size()) == byte_order_mark) {
        text.remove_prefix(byte_order_mark.size());
    }
    csv_table table;
    table.file = path;
    std::vector<std::vector<std::string>> lists;
    std::vector<int> list_of_column;
    char separator = ',';
    long line_number = 0;
    for (const auto raw : split(text, '\n')) {
        ++line_number;
        if (trim(raw).empty() || trim(raw).front() == '#') continue;
        if (table.names.empty()) {
            separator = separator_of(raw);
            read_header(table, raw, separator, line_number);
            lists.resize(table.names.size());
            for (const auto &name : table.names) {
                list_of_column.push_back(std::find(words.begin(), words.end(), name) !=
                                         words.end());
            }
            continue;
        }
        const auto cells = split(raw, separator);
        if (cells.size() != table.names.size()) {
            throw input_error(path, line_number, 0,
                              "has " + std::to_string(cells.size()) + " columns, the header has " +
                                  std::to_string(table.names.size()));
        }
        std::vector<double> row;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const long column = static_cast<long>(cells[c].data() - raw.data()) + 1;
            row.push_back(list_of_column[c]
                              ? word(cells[c], lists[c])
                              : number(cells[c], separator, {path, line_number, column}));
        }
        table.rows.push_back(std::move(row));
        table.lines.push_back(line_number);
    }
    if (table.names.empty()) throw input_error(path, 0, 0, "is empty: a header line is missing");
    if (table.rows.empty()) throw input_error(path, 0, 0, "has a header but no rows");
    if (word_lists != nullptr) *word_lists = std::move(lists);
    return table;
}

std::string shortest(double value) {
    char text[32];
    const auto result = std::to_chars(text, text + sizeof text, value);
    return std::string(text, result.ptr);
}

std::string shortest_float(float value) {
    char text[32];
    const auto result = std::to_chars(text, text + sizeof text, value);
    return std::string(text, result.ptr);
}

std::string csv_text(const std::vector<std::string> &names,
                     const std::vector<std::vector<double>> &rows) {
    std::string text;
    for (std::size_t c = 0; c < names.size(); ++c) text += (c ? "," : "") + names[c];
    text += '\n';
    for (const auto &row : rows) {
        for (std::size_t c = 0; c < row.size(); ++c) text += (c ? "," : "") + shortest(row[c]);
        text += '\n';
    }
    return text;
}

}  // namespace compbox
