// SPDX-License-Identifier: MIT
// Column names of other programs.
#pragma once

#include <string>

#include "host-tools/formats/csv.h"

namespace compbox {

// in : a column's name as in the file, UTF-8
// out: position_UNIT, error_UNIT, run or direction for a name of docs/measurements.md ("Target
//      [mm]", "偏差(µm)"); error_UNIT@3+ for the third of several columns of runs ("Run 3 forward
//      (um)"; + forward, - backward, nothing if unstated); any other name unchanged, also a
//      position or error without its unit.
std::string canonical_column(const std::string &name);

// Whether the name is a position (an error) without its unit: "Position", 误差.
bool is_position_without_unit(const std::string &name);
bool is_error_without_unit(const std::string &name);

// Converts position_UNIT to position_mm and error_UNIT to error_um or error_urad, with their
// values.
void to_standard_units(csv_table &table);

// Of error_um@3+: run 3, direction +1. False for other names.
bool is_run_column(const std::string &name, std::string &run, int &direction);

}  // namespace compbox
