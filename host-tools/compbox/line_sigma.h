// SPDX-License-Identifier: MIT
// The option --sigma-um of the commands for nine lines: one number, ALONG,ACROSS, or one for each
// line.
#pragma once

#include <string>
#include <vector>

#include "host-tools/command_line/command_line.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/identification/points.h"

namespace compbox {

void add_line_sigma(cli::command &command, std::vector<double> &sigma_um,
                    const std::string &description);

// in : the option's numbers, one or more
// out: sigma of each line; throws usage_error for another count than 1, 2 or the lines
identification::line_sigma line_sigma_of(const std::vector<double> &sigma_um, int axis,
                                         std::size_t points);

// out: the number if all lines have the same, else a list of all
json line_sigma_json(const identification::line_sigma &sigma_um);

}  // namespace compbox
