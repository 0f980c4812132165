// SPDX-License-Identifier: MIT
// Checks of numbers on the command line. CLI11's own ones let a NaN pass and print an open end as
// a number of 309 digits. Each refuses, in a few words, what is no finite decimal number too.
#pragma once

#include <CLI/CLI.hpp>

namespace compbox {

CLI::Validator any_number();
CLI::Validator above_zero();
CLI::Validator zero_or_more();
CLI::Validator between(double least, double most);  // both included
CLI::Validator whole_between(long least, long most);

}  // namespace compbox
