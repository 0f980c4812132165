// SPDX-License-Identifier: MIT
// Checks of an option's value. They reject a value that is not a finite decimal number; CLI11's own
// range check accepts NaN.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host-tools/command_line/command_line.h"

namespace compbox::cli {

cli::value_check any_number();
cli::value_check above_zero();
cli::value_check zero_or_more();
cli::value_check between(double least, double most);  // both included
cli::value_check whole_between(long least, long most);

cli::value_check one_of(const std::vector<std::string> &words);

// in : pairs of option and the file that it writes. Throws usage_error if two files are the same.
void different_files(const std::vector<std::pair<std::string, std::string>> &outputs);

}  // namespace compbox::cli
