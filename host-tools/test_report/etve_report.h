// SPDX-License-Identifier: MIT
// The report of an ETVE test: figures, a table for a terminal, a figure over time.
#pragma once

#include <string>

#include "host-tools/formats/json_type.h"
#include "host-tools/metrology/etve.h"

namespace compbox::test_report {

// out: {"hours", "readings", "window_min", "displacements": {name: {"range", "in_window",
//      "window_from_min", "change"}}, "temperatures": …, "remarks"}
json etve_figures(const metrology::drift_record &record, double window_min);

// in : etve_figures
// out: the table for reading, with the key of the uncertainty budget, and remarks
std::string etve_text(const json &figures);

// Displacements from their first reading, and temperatures, over hours.
void plot_etve(const metrology::drift_record &record, const std::string &title,
               const std::string &path);

}  // namespace compbox::test_report
