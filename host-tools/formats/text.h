// SPDX-License-Identifier: MIT
// Texts: files of other programs as UTF-8, what a terminal may show, pieces.
#pragma once

#include <string>
#include <vector>

namespace compbox::formats {

// in : a file's bytes
// out: UTF-8 without byte-order mark. Valid UTF-8 is unchanged. A byte-order mark identifies
// UTF-16. Other bytes are GBK if they are paired like Chinese characters, else Windows-1252 (µ and
// ° of western instruments). Never fails: an invalid or zero byte becomes '?'.
std::string to_utf8(const std::string &bytes);

// out: the text with '?' for each control character: C0, DEL, C1, line and paragraph separators,
// and changes of text direction. A terminal or log shows it on one line. docs/coefficient-file.md
// lists the characters; the box's own loader rejects them (firmware/json/text.h).
std::string printable(const std::string &text);

// out: the pieces between the separators, at least one; a piece may be empty
std::vector<std::string> split(const std::string &text, char separator);

}  // namespace compbox::formats
