// SPDX-License-Identifier: MIT
// How far the prediction of a bank may be off at a state: what the runs left out show, and more
// where the state is far from those trained on.
#pragma once

#include <Eigen/Core>

#include "host-tools/training/train.h"

namespace compbox::training {

// As models/sigma.h has it: the variance of output k at the columns x is
//   floor_um[k]^2 + sum over the directions of (along_um[k] * (weights * x + offset))^2.
struct bank_sigma {
    Eigen::VectorXd floor_um, along_um;  // of each output
    Eigen::MatrixXd weights;             // a direction per row, of the bank's columns
    Eigen::VectorXd offset;              // of each direction
};

// out: true for a bank without zero_at_start, with predictions of runs left out
bool has_sigma(const train_result &result);

// in : has_sigma()
// out: as directions the principal axes in which the trained states lie furthest apart, at most
// four,
//      scaled to a mean square of 1 over the rows. floor_um and along_um are those of maximum
//      likelihood of the residuals left out; along_um is at least the share of one in all runs.
bank_sigma sigma_of_bank(const train_result &result);

// in : rows of the bank's columns. out: of each row the place along the directions
Eigen::MatrixXd places_of(const bank_sigma &sigma, const Eigen::MatrixXd &x);

}  // namespace compbox::training
