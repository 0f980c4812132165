// SPDX-License-Identifier: MIT
// Splits a linear map over inputs and slopes (input times distance) into the box's terms: a map of
// the inputs alone, and for each position the slope as a map of inputs.
#pragma once

#include <vector>

#include "host-tools/training/train.h"

namespace compbox::training {

// The linear path and the bias of the chosen model, in its scaled inputs and outputs, without the
// slopes. The slopes along one position are taken at the centres of their inputs, where they are
// linear in the position.
struct plain_linear {
    Eigen::MatrixXd weights;  // one row per output, one column per plain input
    Eigen::VectorXd bias;
};
plain_linear linear_without_slopes(const train_result &result);

// out: the positions of a slope as part of a name, such as X or XXZ
std::string positions_of(const train_result &result, const model_input &slope);

// Contribution of one slope to each output: um_per_mm * (input - from) * (position - origin) for
// each position.
struct slope_gain {
    std::vector<int> along;  // columns of the positions
    Eigen::Index input = 0;  // among result.inputs: its plain input
    double from = 0.0;       // its centre along one position; 0 along several
    Eigen::VectorXd um_per_mm;
};
std::vector<slope_gain> slope_gains(const train_result &result);

// out: the plain inputs that are positions of a slope along several ones, each once; none along one
std::vector<Eigen::Index> distinct_positions(const train_result &result, const model_input &slope);

// Throws input_error if the names of slopes are too long for the box, or if a position or an input
// of a slope is no input of the model.
void check_slopes(const train_result &result);

}  // namespace compbox::training
