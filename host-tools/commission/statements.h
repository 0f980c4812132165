// SPDX-License-Identifier: MIT
// Answers to commission's questions as options of a script.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/commission/positions.h"

namespace compbox::commission {

// in : "X=+19.8" or "X=19,8". out: µm by axis. Throws cli::usage_error.
std::map<std::string, double> measured_of(const std::vector<std::string> &texts);

// in : "X=0:12.5", "T1=23,4". out: what the display shows, by signal. Throws cli::usage_error.
statements shows_of(const std::vector<std::string> &texts);

// Throws cli::usage_error, naming the option, for a name that is not among the known ones.
void must_be_known(const std::string &option, const std::string &kind, const std::string &name,
                   const std::vector<std::string> &known);

// Throws cli::usage_error for a statement about an unknown signal, or with another number of values
// than the signal is compared with.
void check_statements(const position_options &options, const std::vector<const map_row *> &signals);

}  // namespace compbox::commission
