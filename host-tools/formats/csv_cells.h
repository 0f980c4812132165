// SPDX-License-Identifier: MIT
// Lines of a CSV file as cells, and cells as numbers.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace compbox::formats::csv_cells {

// out: the text without surrounding blanks, then without surrounding quotes
std::string_view trim(std::string_view text);

// out: cells of a line. Consecutive blanks are one separator. Separators within quotes do not
// count.
std::vector<std::string_view> split(std::string_view text, char separator);

// out: the cells without empty ones behind the last column, which spreadsheets add
std::vector<std::string_view> without_empty_end(std::vector<std::string_view> cells,
                                                std::size_t columns);

// out: a cell as a finite number; a decimal comma is allowed if commas do not separate columns.
// beyond: a number outside double's range
bool to_number(std::string_view cell, char separator, double &value, bool &beyond);

// out: whether a quoted number can have thousands separators: "1,500", "12,345,678"; not "0,5" or
// "12,34"
bool is_in_thousands(std::string_view cell);

// In a comma-separated file, one quoted number that cannot have thousands separators shows that the
// comma is the decimal mark.
bool has_decimal_commas(const std::vector<std::string_view> &lines);

}  // namespace compbox::formats::csv_cells
