// SPDX-License-Identifier: MIT
// Lines of a CSV file as cells, and cells as numbers.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace compbox::csv_cells {

// Without blanks around, then without quotes around.
std::string_view trim(std::string_view text);

// Cells of a line. A blank as separator counts once, however many there are. Within quotes no
// separator separates.
std::vector<std::string_view> split(std::string_view text, char separator);

// The same without what spreadsheets put behind the last column: separators with nothing between.
std::vector<std::string_view> without_empty_end(std::vector<std::string_view> cells,
                                                std::size_t columns);

// A cell as a finite number; a decimal comma is read where the comma does not separate columns.
// beyond: it is a number, but none that a double holds.
bool to_number(std::string_view cell, char separator, double &value, bool &beyond);

// A quoted "1,500" or "12,345,678" as a spreadsheet in English writes it; "0,5" and "12,34" are
// none.
bool is_in_thousands(std::string_view cell);

// Where commas separate columns, one quoted number that cannot be in thousands shows that the comma
// is this file's decimal mark.
bool has_decimal_commas(const std::vector<std::string_view> &lines);

}  // namespace compbox::csv_cells
