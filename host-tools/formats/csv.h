// SPDX-License-Identifier: MIT
// Tables of numbers with named columns: our own CSV files and other people's
// (comma, semicolon or tab; decimal comma; byte-order mark; CRLF).
#pragma once

#include <string>
#include <vector>

namespace compbox {

struct csv_table {
    std::string file;                       // for messages
    std::vector<std::string> names;         // header, trimmed
    std::vector<std::vector<double>> rows;  // rows[r].size() == names.size(), all finite
    std::vector<long> lines;                // lines[r]: line of row r in the file, 1-based

    // Index of a column, or -1.
    int find(const std::string &name) const;
    // Index of a column that must be there. Throws input_error naming the columns that are.
    std::size_t column(const std::string &name) const;
    // A copy of one column.
    std::vector<double> values(const std::string &name) const;
};

// Reads a table whose cells are all finite numbers, except in the columns named in `words`, whose
// distinct texts become 0, 1, 2 … in order of appearance (pass the texts' home in word_lists).
// Empty lines and lines starting with '#' are skipped. Throws input_error with file, line and
// column for an empty file, a missing header, a short or long row, text where a number belongs,
// nan, inf, or a number outside double's range.
csv_table read_csv(const std::string &path, const std::vector<std::string> &words = {},
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

// The shortest decimal text that reads back as the same double / float.
std::string shortest(double value);
std::string shortest_float(float value);

// Header and rows as CSV text, numbers written so that they read back bit for bit.
std::string csv_text(const std::vector<std::string> &names,
                     const std::vector<std::vector<double>> &rows);

}  // namespace compbox
