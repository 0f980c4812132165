// SPDX-License-Identifier: MIT
// Modes and reasons: words of the snapshot, numbers of the record.
#pragma once

#include <optional>
#include <string>

namespace compbox::view {

// out: nothing for a word of a later version
std::optional<int> mode_number(const std::string &word);
std::optional<int> reason_number(const std::string &word);

// out: "" for an unknown number
std::string mode_word(int number);
std::string reason_word(int number);

// out: which mode to show of several: ACTIVE the least, FAULT the most; -1: an unknown number
int mode_severity(int number);

}  // namespace compbox::view
