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
    std::vector<std::vector<double>> rows;  // rows[r].size() == names.size(); NaN: not a number
    std::vector<long> lines;                // lines[r]: line of row r in the file, 1-based
    long header_line = 0;
    // By column: what is wrong with its first cell that is not a finite number; "": nothing.
    // Shorter than names: nothing is wrong beyond.
    std::vector<std::string> mistakes;

    // Index of a column, or -1. Throws input_error where the column is there with a mistake in it.
    int find(const std::string &name) const;
    // Index of a column that must be there. Throws input_error naming the columns that are, and
    // where the column has a mistake in it.
    std::size_t column(const std::string &name) const;
    // A copy of one column.
    std::vector<double> values(const std::string &name) const;
};

// Reads a table of finite numbers, except in the columns named in `words`, whose distinct texts
// become 0, 1, 2 … in order of appearance (pass the texts' home in word_lists). Other people's
// tables have columns for people too: text, nan, inf or a number outside double's range makes its
// column unusable, and whoever asks for that column gets an input_error with file, line and column.
// Empty lines and lines starting with '#' are skipped. Throws input_error for an empty file, a
// missing header, and a short or long row.
csv_table read_csv(const std::string &path, const std::vector<std::string> &words = {},
                   std::vector<std::vector<std::string>> *word_lists = nullptr);

// The shortest decimal text that reads back as the same double / float.
std::string shortest(double value);
std::string shortest_float(float value);

// Header and rows as CSV text, numbers written so that they read back bit for bit.
std::string csv_text(const std::vector<std::string> &names,
                     const std::vector<std::vector<double>> &rows);

}  // namespace compbox
