// SPDX-License-Identifier: MIT
// Splits a linear map over inputs and slopes (input times distance) into the box's terms: a map of
// the inputs alone, and for each position the slope as a map of inputs.
#pragma once

#include <vector>

#include "host-tools/training/train.h"

namespace compbox::training {

// The linear path and the bias of the chosen model, in its scaled inputs and outputs, without the
// slopes. The slopes are taken at the centres of their inputs, where they are linear in the
// position.
struct plain_linear {
    Eigen::MatrixXd weights;  // one row per output, one column per plain input
    Eigen::VectorXd bias;
};
plain_linear linear_without_slopes(const train_result &result);

// Contribution of one slope to each output: um_per_mm * (input - its centre) * (position - origin).
struct slope_gain {
    int along = 0;           // column of the position
    Eigen::Index input = 0;  // among result.inputs: its plain input
    Eigen::VectorXd um_per_mm;
};
std::vector<slope_gain> slope_gains(const train_result &result);

// Throws input_error if the names of slopes are too long for the box, or if a position or an input
// of a slope is no input of the model.
void check_slopes(const train_result &result);

}  // namespace compbox::training
