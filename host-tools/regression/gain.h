// SPDX-License-Identifier: MIT
// Significance of a network's gain on left-out runs.
#pragma once

#include <Eigen/Core>

namespace compbox::regression {

// in : mean square of the residuals of each run for both models, on the same rows; equal sizes >= 1
// out: true if the network is significantly better. With five runs or more: the mean logarithm of
//      linear / network is above its standard error times the 97.5 % quantile of Student's t. With
//      any number: the residuals of every run fall by 20 % (rms).
// The test uses runs, because rows of one run are not independent, and ratios, because a hot run
// saves more than a cold one. With fewer than five runs their spread is hardly known.
bool is_clear_gain(const Eigen::ArrayXd &linear, const Eigen::ArrayXd &network);

// 97.5 % quantile of Student's t with this number of degrees of freedom, >= 4; relative error at
// most 0.4 %.
double student_quantile(Eigen::Index freedom);

}  // namespace compbox::regression
