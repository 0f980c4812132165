// SPDX-License-Identifier: MIT
// The Monte Carlo comparison as options, JSON and a table, for `plan` and `identify`.
#pragma once

#include "host-tools/command_line/command_line.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/identification/monte_carlo.h"

namespace compbox {

struct monte_carlo_arguments {
    unsigned runs = 0;  // 0: off
    std::uint64_t seed = 1;
};

// --monte-carlo N, --seed K
void add_monte_carlo(cli::command &command, monte_carlo_arguments &arguments);

json monte_carlo_json(const identification::monte_carlo_result &result,
                      const identification::monte_carlo_options &options);

// Table as S2's: preset, mean and sigma of both methods, how much closer, how much less.
std::string monte_carlo_table(const json &report);

}  // namespace compbox
