// SPDX-License-Identifier: MIT
// A linear map over inputs and slopes (input times way) taken apart into what the box has: a map of
// the inputs alone, and for each position the slope as a map of inputs.
#pragma once

#include <vector>

#include "host-tools/training/train.h"

namespace compbox {

// The linear path and the bias of the chosen model, in its scaled inputs and outputs, without the
// slopes: these are taken at the centres of their inputs, where they are straight in the position.
struct plain_linear {
    Eigen::MatrixXd weights;  // a row for each output, a column for each plain input
    Eigen::VectorXd bias;
};
plain_linear linear_without_slopes(const train_result &result);

// What one slope adds to each output: um_per_mm * (input - its centre) * (position - origin).
struct slope_gain {
    int along = 0;           // column of the position
    Eigen::Index input = 0;  // among result.inputs: the plain one that it is linear in
    Eigen::VectorXd um_per_mm;
};
std::vector<slope_gain> slope_gains(const train_result &result);

// Throws input_error where the names that slopes make are too long for the box, or where a position
// or an input of a slope is no input of the model.
void check_slopes(const train_result &result);

}  // namespace compbox
