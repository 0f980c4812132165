// SPDX-License-Identifier: MIT
// Joins the box's recording and probed errors to rows for training.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

namespace compbox::metrology {

struct join_options {
    bool add_back = true;              // subtract the active compensation from the probed error
    double time_offset_s = 0.0;        // record's clock = probe's clock + this
    double longest_gap_s = 1.0;        // maximum distance of the recorded rows around a probed one
    double tolerance_mm = 0.05;        // by position: maximum distance
    double together_s = 120.0;         // probes of one record within this time are one row
    std::vector<std::string> signals;  // selected columns of the record; empty: its signals
};

struct joined_rows {
    std::vector<std::string> names;
    std::vector<std::vector<double>> rows;
    std::vector<std::string> run_names;  // a row's run is its index in here
    std::vector<std::string> remarks;
    bool by_time = true;
};

// in : record, columns as written by compboxd (docs/compboxd.md), empty cells as NaN; probe:
//      time_s, or positions named like signals of the record; error_NAME_um for channels NAME
//      (comp_NAME_um in the record); optional run, read as words: run_names has them
// out: one row for each row of the probe: time_s, run, the signals, the errors minus the active
//      compensation: the machine's errors without the box
// Rows are matched by time if the probe has time_s, else by position: for each row of the probe in
// order, the next time in the record at which every given position is within tolerance.
// Throws input_error with file and line for an unmatched row.
joined_rows join_rows(const formats::csv_table &record, const formats::csv_table &probe,
                      const std::vector<std::string> &run_names, const join_options &options);

// EXX … ECZ: a term's output by its ISO 230-1 name. A value computed by the box is no input of a
// model.
bool is_iso_name(const std::string &name);

// The rows as CSV, runs by their names.
std::string joined_text(const joined_rows &joined);

}  // namespace compbox::metrology
