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

namespace compbox::formats {

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

// One decimal mark for the whole file: where both occur, one of them separates thousands.
class decimal_mark {
  public:
    // in : a cell that is a number
    void check(std::string_view cell, const place &at) {
        const std::string_view text = trim(cell);
        const std::size_t found = text.find_first_of(",.");
        if (found == std::string_view::npos) return;
        if (mark_ == 0) {
            mark_ = text[found];
            first_ = std::string(text);
            line_ = at.line;
        }
        if (text[found] == mark_) return;
        throw input_error(at.file, at.line, at.column,
                          "{} and '{}' of line {} have different decimal marks: write all numbers "
                          "with one mark, and without thousands",
                          shown(text), first_, line_);
    }

  private:
    char mark_ = 0;
    std::string first_;
    long line_ = 0;
};

// out: the number; for another text NaN, and its message if it is the first of the column
double number_or_mistake(std::string_view cell, char separator, bool gaps,
                         const comma_in_quotes &comma, decimal_mark &mark, const place &at,
                         std::string &mistake) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (!mistake.empty()) return none;
    try {
        comma.check(cell, at);
        const double value = number(cell, separator, gaps, at);
        if (std::isfinite(value)) mark.check(cell, at);
        return value;
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
        if (std::count(table.names.begin(), table.names.end(), other) == 0) name = other;
    }
}

// out: whether a row below the header has units, or nothing, in all of its cells
bool is_row_of_units(const std::vector<std::string_view> &cells) {
    bool any = false;
    for (const auto cell : cells) {
        const std::string text(trim(cell));
        const bool none = text.empty() || text == "-" || text == "[-]" || text == "()";
        const bool unit = !none && find_unit(text) != nullptr;
        if (!none && !unit) return false;
        any = any || unit;
    }
    return any;
}

// Appends the units of a second header line to the names without brackets.
void append_units(csv_table &table, const std::vector<std::string_view> &cells) {
    for (std::size_t c = 0; c < std::min(cells.size(), table.names.size()); ++c) {
        const std::string unit(trim(cells[c]));
        if (find_unit(unit) == nullptr || !split_brackets(table.names[c]).unit.empty()) continue;
        const std::string bare =
            unit.front() == '[' || unit.front() == '(' ? unit.substr(1, unit.size() - 2) : unit;
        table.names[c] = fmt::format("{} [{}]", table.names[c], bare);
    }
}

// Takes the units in brackets from the names, and converts the values.
void take_units(csv_table &table, const csv_reading &how) {
    if (how.rename) return;
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        const name_and_unit parts = split_brackets(table.names[c]);
        if (parts.unit.empty()) continue;
        const measuring_unit *is = find_unit(parts.unit);
        const wanted_column wanted =
            is == nullptr ? wanted_column{parts.name, nullptr} : how.units(parts.name, *is);
        if (std::count(table.names.begin(), table.names.end(), wanted.name) > 0) {
            throw input_error(table.file, table.header_line, 0,
                              "the columns {} and {} have one name; rename one of them",
                              shown(wanted.name), shown(table.names[c]));
        }
        table.names[c] = wanted.name;
        if (is == nullptr || wanted.in == is) continue;
        for (auto &row : table.rows) row[c] = converted(row[c], *is, *wanted.in);
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

// Reads the lines of one file: header, units, rows.
class table_reader {
  public:
    table_reader(const std::string &path, const std::string &text, const csv_reading &how)
        : how_(how), lines_(lines_of(text)) {
        table_.file = path;
    }

    // out: the table; word_lists: the texts of its columns of words, or null. Throws input_error.
    csv_table read(std::vector<std::vector<std::string>> *word_lists) {
        for (std::size_t i = header_of(lines_, how_); i < lines_.size(); ++i) {
            if (is_passed_over(lines_[i])) continue;
            if (!table_.names.empty()) {
                read_row(lines_[i], static_cast<long>(i) + 1);
                continue;
            }
            if (!read_names(i)) read_row(lines_[i], static_cast<long>(i) + 1);
        }
        if (table_.names.empty()) {
            throw input_error(table_.file, 0, 0, "is empty: a header line is missing");
        }
        if (table_.rows.empty()) throw input_error(table_.file, 0, 0, "has a header but no rows");
        take_units(table_, how_);
        if (word_lists != nullptr) *word_lists = std::move(lists_);
        return std::move(table_);
    }

  private:
    // in : i: the first line of the table; moved to the line of units, if there is one
    // out: whether it is a header; false where the names were given and it has numbers
    bool read_names(std::size_t &i) {
        const std::string_view line = lines_[i];
        separator_ = separator_of(line);
        comma_.emplace(lines_, separator_);
        const bool header = !all_numbers(without_empty_end(split(line, separator_), 1), separator_);
        table_.header_line = static_cast<long>(i) + 1;
        name_columns(table_, line, separator_, how_.columns, header, table_.header_line);
        if (header) read_units(i);
        rename(table_, how_);
        lists_.resize(table_.names.size());
        known_.resize(table_.names.size());
        table_.mistakes.resize(table_.names.size());
        for (const auto &name : table_.names) {
            is_word_.push_back(std::count(how_.words.begin(), how_.words.end(), name) > 0);
        }
        return header;
    }

    void read_units(std::size_t &i) {
        std::size_t next = i + 1;
        while (next < lines_.size() && is_passed_over(lines_[next])) ++next;
        if (next == lines_.size()) return;
        const auto cells = split(lines_[next], separator_);
        if (!is_row_of_units(cells)) return;
        append_units(table_, cells);
        i = next;
    }

    // Appends a row; throws input_error for another number of cells than the header has.
    void read_row(std::string_view line, long number) {
        const auto cells = without_empty_end(split(line, separator_), table_.names.size());
        if (all_empty(cells)) return;
        if (cells.size() != table_.names.size()) {
            throw input_error(table_.file, number, 0, "has {}, the header has {}",
                              counted(cells.size(), "column"), table_.names.size());
        }
        std::vector<double> row;
        row.reserve(cells.size());
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const long column = static_cast<long>(cells[c].data() - line.data()) + 1;
            row.push_back(is_word_[c] ? word(cells[c], lists_[c], known_[c])
                                      : number_or_mistake(cells[c], separator_, how_.gaps, *comma_,
                                                          mark_, {table_.file, number, column},
                                                          table_.mistakes[c]));
        }
        table_.rows.push_back(std::move(row));
        table_.lines.push_back(number);
    }

    const csv_reading &how_;
    std::vector<std::string_view> lines_;
    csv_table table_;
    char separator_ = ',';
    std::optional<comma_in_quotes> comma_;
    decimal_mark mark_;
    std::vector<std::vector<std::string>> lists_;
    std::vector<word_numbers> known_;
    std::vector<bool> is_word_;
};

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

csv_table read_csv_text(const std::string &path, const std::string &text, const csv_reading &how,
                        std::vector<std::vector<std::string>> *word_lists) {
    return table_reader(path, text, how).read(word_lists);
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

}  // namespace compbox::formats
