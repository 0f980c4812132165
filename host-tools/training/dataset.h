// SPDX-License-Identifier: MIT
// Rows to train on: a table of inputs and measured errors, run by run.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace compbox {

constexpr std::size_t longest_name = 23;  // bytes: CB_NAME_SIZE of the box less its end

struct data_options {
    // Names of columns. * stands for anything, but neither for the time or the run nor, in inputs,
    // for an output.
    std::vector<std::string> inputs, outputs;
    std::string time_column = "time_s";
    std::string run_column;  // empty: one run
    bool needs_time = false;
    std::string record;  // file with the inputs at all times, for lags; empty: the rows are all
};

// Rows in the order of the file, or run by run. A run is a stretch of rows with the same value in
// the run column; a value that comes back later is another run, unless they come back often
// (runs.h).
struct training_data {
    std::string file;
    std::vector<std::string> inputs, outputs;
    std::vector<double> time_s;          // rising within a run; empty where it is not needed
    Eigen::MatrixXd x, y;                // row by row; all finite
    std::vector<std::size_t> run;        // of each row: 0, 1, 2 …
    std::vector<std::string> run_names;  // value of the run column; a "#2" after one that came back
    std::vector<std::size_t> run_starts;  // rows where lags start anew: of each run or stretch
    std::vector<std::size_t> file_row;    // of each row, 0 is the first under the header
    bool reordered = false;               // rows stand run by run, not as in the file
    std::string note;                     // about the runs, for the report
    // The inputs between the rows too, where a record was given; else empty. Rows as x.
    std::vector<double> history_s;  // rising, from the first row's time or before to the last's
    Eigen::MatrixXd history;

    std::size_t rows() const { return static_cast<std::size_t>(x.rows()); }
};

// true: 1 to 23 letters A to Z of either case, digits, _ - .
bool is_name_of_the_box(const std::string &name);

// Throws input_error with the place: columns that are not there, are named twice or stand on both
// sides, names that the box would refuse, inputs or outputs that never change, fewer than 10 rows,
// time that does not rise within a run, a record that does not have an input or a row's time.
training_data read_training_data(const std::string &path, const data_options &options);

}  // namespace compbox
