// SPDX-License-Identifier: MIT
// Inputs of a model computed from columns: first-order lags, as in the box.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/training/dataset.h"

namespace compbox::training {

struct model_input {
    std::string name;
    std::size_t column = 0;  // of training_data::x
    double tau_s = 0.0;      // time constant; 0: the column itself
    int power = 1;           // 2: the column's square, 3: its cube
    // A slope is multiplied by (position - origin) for each of these columns; none: no slope.
    std::vector<int> along = {};
    std::vector<double> origin = {};

    bool is_slope() const { return !along.empty(); }
};

// The error's slope along a position depends on these inputs (the control's tanβ). Several
// positions are multiplied: {"X", "X", "Z"} is the square of X times Z.
struct slope_option {
    std::vector<std::string> along;
    std::vector<std::string> of;  // * matches any text
};

struct lag_options {
    std::vector<double> lags_s;        // of every input with a lag
    std::vector<std::string> only;     // inputs with a lag; empty: all
    std::vector<std::string> squares;  // inputs whose square is an additional input, with the same
                                       // lags
};

// Restart of the lags: on the first row of each run, on the first row of the file only (the runs
// are one record), or both. With both, every row counts twice, so that the model suits a box that
// was just switched on as well as one that has run for long. Automatic: both for a bank from one
// record without pauses, else each_run.
enum class lag_starts { automatic, each_run, once, both };

// Time constant of the lag that represents a square without memory; the box has no other square.
constexpr double square_tau_s = 1.0;

// The columns, then their lags, then squares. Names: NAME_lag600, NAME_sq (its own lag is
// square_tau_s), NAME_sq_lag600, cut to the box's 23 characters. Throws input_error if `only` or
// `squares` names an unknown input.
std::vector<model_input> model_inputs(const training_data &data, const lag_options &options);

// Adds for each slope its inputs times the distances from the origins, which are the middles of
// the positions in the rows. Throws input_error for an unknown input.
void add_slopes(std::vector<model_input> &inputs, const training_data &data,
                const std::vector<slope_option> &slopes);

// Training rows of a model: inputs as columns of x, outputs as columns of y.
struct model_rows {
    Eigen::MatrixXd x, y;
    std::vector<std::size_t> run;     // of each row
    std::vector<std::size_t> source;  // row of the file
};

// in : data.time_s, if an input has a lag
// out: rows of the file, once or twice. Lags are exact for an input that is linear from row to row,
//      and start in steady state, as in models/lag.h, but in double precision. With a history they
//      follow it from its first row, except for starts == each_run.
// Throws input_error if rows that were put run by run shall be one record.
model_rows rows_of(const training_data &data, const std::vector<model_input> &inputs,
                   lag_starts starts);

}  // namespace compbox::training
