// SPDX-License-Identifier: MIT
// Files of other programs as text.
#pragma once

#include <string>

namespace compbox::formats {

// out: the file's text in UTF-8 (text.h), with lines that end in \n. Throws input_error for files
// that hold no text, such as workbooks of a spreadsheet, with the remedy.
std::string read_table_text(const std::string &path);

}  // namespace compbox::formats
