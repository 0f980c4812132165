// SPDX-License-Identifier: MIT
// Options of the commands that read measurement files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host-tools/command_line/command_line.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/test_report/temperature.h"

namespace compbox {

// Adds --unit.
void add_unit(cli::command &command, fitting::reading_options &reading);

// The scale of a warm machine, by which readings become those at 20 degC.
struct scale_arguments {
    std::optional<double> expansion_um_per_m_K;
    std::vector<double> degC;  // one, or those at the start and at the end
};

// Adds --expansion-um-per-m-K and --material-degC.
void add_scale(cli::command &command, scale_arguments &scale);

// Throws usage_error, naming the option, for more than two temperatures.
test_report::scale_temperature stated_scale(const scale_arguments &scale,
                                            const std::string &option = "--material-degC");

}  // namespace compbox
