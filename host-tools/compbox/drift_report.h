// SPDX-License-Identifier: MIT
// compbox report --drift: what probes have shown over months.
#pragma once

#include <string>

#include "host-tools/command_line/command_line.h"
#include "host-tools/metrology/model_drift.h"

namespace compbox {

struct drift_arguments {
    std::string table, plot, output;
    metrology::drift_options options;
    bool as_json = false;
};

// Prints periods and the day from which a model has drifted, and writes the figure and the JSON.
// Throws input_error for a table without residuals.
void report_drift(const drift_arguments &arguments, const cli::streams &io);

}  // namespace compbox
