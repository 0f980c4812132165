// SPDX-License-Identifier: MIT
// Rows to train on: a table of inputs and measured errors, run by run.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace compbox::training {

constexpr std::size_t longest_name = 23;  // bytes: CB_NAME_SIZE of the box minus its end

struct data_options {
    // Names of columns. * matches any text, but neither the time nor the run nor, in inputs, an
    // output. No inputs: every column that may be one.
    std::vector<std::string> inputs, outputs;
    std::string time_column = "time_s";
    std::string run_column;  // empty: one run
    bool needs_time = false;
    bool find_runs = false;           // without a run column: by steps of a speed, pauses, days …
    bool time_if_there = false;       // needs_time if the table has the column
    std::vector<std::string> speeds;  // inputs that are speeds; empty: by their names
    std::string record;  // file with the inputs at all times, for lags; empty: use the rows
};

// Rows in the order of the file, or run by run. A run is a series of rows with the same value in
// the run column. A value that returns later is another run, unless values return often (runs.h).
struct training_data {
    std::string file;
    std::vector<std::string> inputs, outputs;
    std::vector<double> time_s;           // rising within a run; empty if unused
    Eigen::MatrixXd x, y;                 // row by row; all finite
    std::vector<std::size_t> run;         // of each row: 0, 1, 2 …
    std::vector<std::string> run_names;   // value of the run column; with "#2" for its second run
    std::vector<std::size_t> run_starts;  // rows where lags restart: of each run or series
    std::vector<std::size_t> file_row;    // of each row, 0 is the first under the header
    bool reordered = false;               // rows are run by run, not as in the file
    std::string note;                     // about the runs, for the report
    std::vector<std::string> remarks;     // about columns that were left out, for the report
    std::vector<std::size_t> together;    // of each run: runs with one number are left out together
    std::vector<std::string> speeds;      // inputs that are speeds
    std::vector<std::string> glitches;    // for the report: column, place and value of each
    std::vector<bool> spoilt;             // rows with a glitch, never trained on; empty: none
    // With a record: the inputs between the rows too; else empty. Rows as in x.
    std::vector<double> history_s;  // rising, from the first row's time or before to the last's
    Eigen::MatrixXd history;

    std::size_t rows() const { return static_cast<std::size_t>(x.rows()); }
};

// out: the columns' own names, without the unit in brackets that a reader takes away: "ch1(um)" is
//      ch1, and "time(s)" is time_s
std::vector<std::string> own_names(std::vector<std::string> names);
std::string own_name(const std::string &name);

// true: 1 to 23 letters A to Z of either case, digits, _ - .
bool is_name_of_the_box(const std::string &name);

// Throws input_error with the place: columns that are missing, repeated, or both input and output;
// names that the box rejects; constant inputs or outputs; fewer than 10 rows; time that does not
// rise within a run; a record that lacks an input or a row's time. Glitches are bridged, and their
// rows are marked.
training_data read_training_data(const std::string &path, const data_options &options);

}  // namespace compbox::training
