// SPDX-License-Identifier: MIT
#include "host-tools/formats/csv.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "host-tools/formats/csv_cells.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/table_text.h"

namespace compbox {

using csv_cells::has_decimal_commas, csv_cells::is_in_thousands, csv_cells::split,
    csv_cells::to_number, csv_cells::trim, csv_cells::without_empty_end;

namespace {

std::vector<std::string_view> lines_of(std::string_view text) {
    std::vector<std::string_view> lines;
    for (std::size_t start = 0; start <= text.size();) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        lines.push_back(text.substr(start, end - start));
        start = end + 1;
    }
    return lines;
}

// out: the separator of a first line: a tab or semicolon if it has one, else a comma, else blanks
char separator_of(std::string_view header) {
    for (const char separator : {'\t', ';', ','}) {
        if (header.find(separator) != std::string_view::npos) return separator;
    }
    return trim(header).find(' ') == std::string_view::npos ? ',' : ' ';
}

std::string counted(std::size_t count, const char *noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

struct place {
    const std::string &file;
    long line;
    long column;
};

// out: a cell for a message: on one line, shortened
std::string shown(std::string_view cell) {
    std::size_t length = std::min<std::size_t>(cell.size(), 40);
    const auto inside = [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) == 0x80u; };
    while (length > 0 && length < cell.size() && inside(cell[length])) --length;
    std::string text(cell.substr(0, length));
    const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
    std::replace_if(text.begin(), text.end(), control, '?');
    return fmt::format("'{}{}", text, cell.size() > length ? "…'" : "'");
}

double number(std::string_view cell, char separator, bool gaps, const place &at) {
    double value = 0.0;
    bool beyond = false;
    if (to_number(cell, separator, value, beyond)) return value;
    const std::string text(trim(cell));
    if (text.empty() && gaps) return NAN;
    if (text.empty()) throw input_error(at.file, at.line, at.column, "a number is missing here");
    throw input_error(
        at.file, at.line, at.column,
        shown(text) + (beyond ? " is beyond what a number can hold" : " is not a finite number"));
}

// Meaning of the comma in a quoted number of a comma-separated file: a decimal mark, or ambiguous
// if every such number could also have thousands separators.
class comma_in_quotes {
  public:
    comma_in_quotes(const std::vector<std::string_view> &lines, char separator)
        : doubtful_(separator == ',' && !has_decimal_commas(lines)) {}

    void check(std::string_view cell, const place &at) const {
        if (!doubtful_ || !is_in_thousands(cell)) return;
        throw input_error(
            at.file, at.line, at.column,
            shown(trim(cell)) +
                " may have a decimal comma or be in thousands: write it without a comma");
    }

  private:
    bool doubtful_;
};

// out: the number; for another text NaN, and its message if it is the first of the column
double number_or_mistake(std::string_view cell, char separator, bool gaps,
                         const comma_in_quotes &comma, const place &at, std::string &mistake) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (!mistake.empty()) return none;
    try {
        comma.check(cell, at);
        return number(cell, separator, gaps, at);
    } catch (const input_error &error) {
        mistake = error.what();
        return none;
    }
}

bool all_numbers(const std::vector<std::string_view> &cells, char separator) {
    return std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) {
        double value = 0.0;
        bool beyond = false;
        return to_number(cell, separator, value, beyond);
    });
}

// out: whether the row has separators only, as spreadsheets write an empty row
bool all_empty(const std::vector<std::string_view> &cells) {
    return cells.size() > 1 && std::all_of(cells.begin(), cells.end(), [](std::string_view cell) {
               return trim(cell).empty();
           });
}

// out: index of the word in the list, to which a new word is added; `known` has the indices
using word_numbers = std::unordered_map<std::string, std::size_t>;
double word(std::string_view cell, std::vector<std::string> &list, word_numbers &known) {
    const auto [place, is_new] = known.try_emplace(std::string(trim(cell)), list.size());
    if (is_new) list.push_back(place->first);
    return static_cast<double>(place->second);
}

void read_header(csv_table &table, std::string_view line, char separator, long line_number) {
    for (const auto part : without_empty_end(split(line, separator), 1)) {
        const std::string name(trim(part));
        if (name.empty()) {
            throw input_error(table.file, line_number, 0, "a column of the header has no name");
        }
        if (table.find(name) >= 0) {
            throw input_error(table.file, line_number, 0, "the column {} is there twice",
                              shown(name));
        }
        table.names.push_back(name);
    }
}

// out: the names of the header, or the given names, one for each column of the first line
void name_columns(csv_table &table, std::string_view line, char separator,
                  const std::vector<std::string> &given, bool header, long line_number) {
    if (given.empty() && !header) {
        throw input_error(table.file, line_number, 0,
                          "begins with numbers: a header line such as position_mm,error_um is "
                          "missing");
    }
    if (given.empty()) {
        read_header(table, line, separator, line_number);
        return;
    }
    const std::size_t there = without_empty_end(split(line, separator), given.size()).size();
    if (there != given.size()) {
        throw input_error(table.file, line_number, 0, "has {}, but {}{}", counted(there, "column"),
                          given.size(), given.size() == 1 ? " was named" : " were named");
    }
    table.names = given;
}

void rename(csv_table &table, const csv_reading &how) {
    if (!how.rename) return;
    for (auto &name : table.names) {
        const std::string other = how.rename(name);
        if (table.find(other) < 0) name = other;
    }
}

// out: whether the line is empty, a comment, or the line "sep=;" of a spreadsheet
bool is_passed_over(std::string_view line) {
    const std::string_view text = trim(line);
    return text.empty() || text.front() == '#' ||
           (text.size() <= 5 && text.compare(0, 4, "sep=") == 0);
}

// out: index of the header line; 0 without one
std::size_t header_of(const std::vector<std::string_view> &lines, const csv_reading &how) {
    constexpr std::size_t furthest = 200;
    for (std::size_t i = 0; how.is_header && i < std::min(lines.size(), furthest); ++i) {
        if (is_passed_over(lines[i])) continue;
        std::vector<std::string> names;
        for (const auto part : split(lines[i], separator_of(lines[i]))) {
            const std::string name(trim(part));
            names.push_back(how.rename ? how.rename(name) : name);
        }
        if (how.is_header(names)) return i;
    }
    return 0;
}

}  // namespace

int csv_table::find(const std::string &name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return -1;
    const auto index = static_cast<std::size_t>(found - names.begin());
    if (index < mistakes.size() && !mistakes[index].empty()) throw input_error(mistakes[index]);
    return static_cast<int>(index);
}

std::size_t csv_table::column(const std::string &name) const {
    const int index = find(name);
    if (index >= 0) return static_cast<std::size_t>(index);
    std::string there;
    for (const auto &other : names) there += (there.empty() ? "" : ", ") + other;
    throw input_error(file, header_line, 0, "there is no column '{}' (there are {})", name, there);
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
    csv_reading how;
    how.words = words;
    return read_csv(path, how, word_lists);
}

csv_table read_csv(const std::string &path, const csv_reading &how,
                   std::vector<std::vector<std::string>> *word_lists) {
    return read_csv_text(path, read_table_text(path), how, word_lists);
}

csv_table read_csv_text(const std::string &path, const std::string &content, const csv_reading &how,
                        std::vector<std::vector<std::string>> *word_lists) {
    csv_table table;
    table.file = path;
    std::vector<std::vector<std::string>> lists;
    std::vector<word_numbers> known;
    std::vector<bool> is_word;
    char separator = ',';
    const auto lines = lines_of(content);
    std::optional<comma_in_quotes> comma;
    for (std::size_t i = header_of(lines, how); i < lines.size(); ++i) {
        const std::string_view raw = lines[i];
        const long line_number = static_cast<long>(i) + 1;
        if (is_passed_over(raw)) continue;
        if (table.names.empty()) {
            separator = separator_of(raw);
            comma.emplace(lines, separator);
            const bool header =
                !all_numbers(without_empty_end(split(raw, separator), 1), separator);
            name_columns(table, raw, separator, how.columns, header, line_number);
            rename(table, how);
            lists.resize(table.names.size());
            known.resize(table.names.size());
            table.mistakes.resize(table.names.size());
            table.header_line = line_number;
            for (const auto &name : table.names) {
                is_word.push_back(std::count(how.words.begin(), how.words.end(), name) > 0);
            }
            if (header) continue;
        }
        const auto cells = without_empty_end(split(raw, separator), table.names.size());
        if (all_empty(cells)) continue;
        if (cells.size() != table.names.size()) {
            throw input_error(path, line_number, 0, "has {}, the header has {}",
                              counted(cells.size(), "column"), table.names.size());
        }
        std::vector<double> row;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const long column = static_cast<long>(cells[c].data() - raw.data()) + 1;
            row.push_back(is_word[c]
                              ? word(cells[c], lists[c], known[c])
                              : number_or_mistake(cells[c], separator, how.gaps, *comma,
                                                  {path, line_number, column}, table.mistakes[c]));
        }
        table.rows.push_back(std::move(row));
        table.lines.push_back(line_number);
    }
    if (table.names.empty()) throw input_error(path, 0, 0, "is empty: a header line is missing");
    if (table.rows.empty()) throw input_error(path, 0, 0, "has a header but no rows");
    if (word_lists != nullptr) *word_lists = std::move(lists);
    return table;
}

std::string csv_text(const std::vector<std::string> &names,
                     const std::vector<std::vector<double>> &rows) {
    std::string text;
    for (std::size_t c = 0; c < names.size(); ++c) text += (c ? "," : "") + names[c];
    text += '\n';
    for (const auto &row : rows) {
        for (std::size_t c = 0; c < row.size(); ++c)
            text += fmt::format("{}{}", c ? "," : "", row[c]);
        text += '\n';
    }
    return text;
}

}  // namespace compbox
