// SPDX-License-Identifier: MIT
// Checks of what is typed. CLI11's own ones of numbers let a NaN pass and print an open end as a
// number of 309 digits: these refuse, in a few words, what is no finite decimal number too.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host-tools/command_line/command_line.h"

namespace compbox {

cli::value_check any_number();
cli::value_check above_zero();
cli::value_check zero_or_more();
cli::value_check between(double least, double most);  // both included
cli::value_check whole_between(long least, long most);

cli::value_check one_of(const std::vector<std::string> &words);
std::string listed(const std::vector<std::string> &words);  // "{X,Y,Z}"

// Wrong usage where two of {option, file it writes} name the same file.
void different_files(const std::vector<std::pair<std::string, std::string>> &outputs);

}  // namespace compbox
