// SPDX-License-Identifier: MIT
// What other programs call their columns.
#pragma once

#include <string>

#include "host-tools/formats/csv.h"

namespace compbox {

// in : a column's name as in the file, UTF-8
// out: position_UNIT, error_UNIT, run or direction where the name says that in one of the ways of
//      docs/measurements.md ("Target [mm]", "偏差(µm)"); error_UNIT@3+ for the third of several
//      columns of runs ("Run 3 forward (um)"; + forward, - backward, nothing where it is not said);
//      else the name as it is. A position or error without its unit stays as it is.
std::string canonical_column(const std::string &name);

// Whether it is a name of the position (of the error) that lacks its unit: "Position", 误差.
bool is_position_without_unit(const std::string &name);
bool is_error_without_unit(const std::string &name);

// Brings position_UNIT to position_mm and error_UNIT to error_um or error_urad, values with them.
void to_standard_units(csv_table &table);

// Of error_um@3+: run 3, direction +1. False for other names.
bool is_run_column(const std::string &name, std::string &run, int &direction);

}  // namespace compbox
