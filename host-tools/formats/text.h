// SPDX-License-Identifier: MIT
// Text files of other people's programs as UTF-8.
#pragma once

#include <string>

namespace compbox {

// in : a file's bytes
// out: UTF-8 without byte-order mark. What is valid UTF-8 stays as it is; UTF-16 is known by its
//      byte-order mark; other bytes are GBK where they come in pairs as Chinese characters do, else
//      Windows-1252 (µ and ° of western instruments). Never fails: what has no meaning in the code
//      page, and a zero byte, becomes '?'.
std::string to_utf8(const std::string &bytes);

// The text with '?' for each control character: C0, DEL, C1, line and paragraph separators, and
// those that change the direction of text. A terminal or a log then shows all of it, on one line.
// docs/coefficient-file.md lists them; the box's own loader refuses them (firmware/json/text.h).
std::string printable(const std::string &text);

}  // namespace compbox
