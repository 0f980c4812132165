// SPDX-License-Identifier: MIT
// Column names of other programs, in several languages, and their units.
#pragma once

#include <string>

#include "host-tools/formats/csv.h"

namespace compbox::fitting {

// Units of columns that state none; "": refuse them.
struct column_units {
    std::string position, error;
};

// in : the option --unit: "um" or "mm,um"; one unit from mm up is that of the position too
// out: the units; throws input_error for an unknown one
column_units units_of_option(const std::string &text);

// out: the units of lengths and angles, for messages
std::string known_units();

// in : a column's name as in the file, UTF-8
// out: position_UNIT, nominal_UNIT, error_UNIT, actual_UNIT (a measured position), run or direction
//      for a name of docs/measurements.md ("Target [mm]", "Ist (Zoll)", "偏差(µm)");
//      error_UNIT@3+ for the third of several columns of runs ("Run 3 forward (um)"; + forward, -
//      backward, nothing if unstated); any other name unchanged, also one without its unit.
std::string canonical_column(const std::string &name, const column_units &missing = {});

// Whether the name without unit is a position (an error, a run, a measured position).
bool is_position_word(const std::string &name);
bool is_error_word(const std::string &name);

// in : a cell of the column direction. out: +1, -1, or 0 for an unknown word
int direction_of(const std::string &word);

// in : a table with names of canonical_column. out: position_mm, and error_um or error_urad, with
// their values; measured positions become errors, measured less nominal. Throws input_error for two
// columns of one meaning, positions that are angles, measured positions that do not follow the
// nominal ones, and errors of the other sign.
void to_standard_units(formats::csv_table &table, const column_units &missing = {});

// Of error_um@3+: run 3, direction +1. False for other names.
bool is_run_column(const std::string &name, std::string &run, int &direction);

}  // namespace compbox::fitting
