// SPDX-License-Identifier: MIT
// Tables of numbers with named columns: CSV files of any program (comma, semicolon or tab; decimal
// comma; byte-order mark; CRLF).
#pragma once

#include <string>
#include <vector>

namespace compbox::formats {

struct csv_table {
    std::string file;                       // for messages
    std::vector<std::string> names;         // header, trimmed
    std::vector<std::vector<double>> rows;  // rows[r].size() == names.size(); NaN: not a number
    std::vector<long> lines;                // lines[r]: line of row r in the file, 1-based
    long header_line = 0;
    // By column: the fault of its first cell that is not a finite number; "": none. Columns beyond
    // its end have no fault.
    std::vector<std::string> mistakes;

    // out: index of a column, or -1. Throws input_error for a column with a fault.
    int find(const std::string &name) const;
    // out: index of a required column. Throws input_error, naming the columns, if it is missing,
    // and for a column with a fault.
    std::size_t column(const std::string &name) const;
    // out: a copy of one column
    std::vector<double> values(const std::string &name) const;
};

// Reads a table of finite numbers. The distinct texts of the columns in `words` become 0, 1, 2 … in
// order of appearance; word_lists receives them. Text, nan, inf or a number outside double's range
// makes its column unusable: access to that column throws input_error with file, line and column.
// Empty lines and lines starting with '#' are skipped. Throws input_error for an empty file, a
// missing header, and a short or long row.
csv_table read_csv(const std::string &path, const std::vector<std::string> &words = {},
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

// out: header and rows as CSV text; the numbers read back bit for bit
std::string csv_text(const std::vector<std::string> &names,
                     const std::vector<std::vector<double>> &rows);

}  // namespace compbox::formats
