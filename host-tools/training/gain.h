// SPDX-License-Identifier: MIT
// Whether what a network saves on runs left out is more than the luck of these runs.
#pragma once

#include <Eigen/Core>

namespace compbox {

// in : mean square that each model leaves of each run, of the same rows; as many of both, >= 1
// out: true where the network is better beyond doubt: with five runs or more, the mean logarithm of
//      linear / network is above its standard error times the 97.5 % quantile of Student's t; or,
//      with any number, every single run is left with 20 % less (rms).
// Runs, because rows of one run are not independent; ratios, because a hot run saves more than a
// cold one; with fewer than five runs their spread is hardly known.
bool is_clear_gain(const Eigen::ArrayXd &linear, const Eigen::ArrayXd &network);

// 97.5 % quantile of Student's t with so many degrees of freedom, >= 4; off by 0.4 % at most.
double student_quantile(Eigen::Index freedom);

}  // namespace compbox
