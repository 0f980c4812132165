// SPDX-License-Identifier: MIT
// What machines of one type share: how the weights of their banks are spread (docs/training.md).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/training/moments.h"

namespace compbox::training {

constexpr std::size_t least_brothers = 3, most_brothers = 1000;

// The weights of one output are drawn from N(mean, factor factor^T), per unit of the columns.
struct weight_spread {
    Eigen::VectorXd mean;
    Eigen::MatrixXd factor;
};

// Of one space of weights.
struct bank_prior {
    bank_space space;
    std::vector<weight_spread> outputs;             // of each output
    std::vector<std::vector<std::string>> strange;  // of each: files of brothers that are not used
};

// What a file has: the space of the brothers first, then that of their shorter lags, for a machine
// with a short record. Its long lags would begin at a wrong state.
struct bank_priors {
    std::string file;
    std::size_t machines = 0;  // as many brothers
    std::vector<bank_prior> spaces;
};

// in : moments of brothers of one space, least_brothers or more
// out: mean and covariance of maximum likelihood (EM from a broad start) over the brothers. Those
//      whose weights are further than four median distances from the geometric median of all are
//      not used, so that a wrong one spoils nothing. Throws input_error for different spaces
bank_priors priors_of(const std::vector<bank_moments> &brothers);

// in : tau_s: what a bank of the new machine would have, ascending
// out: the first space whose lags are not longer, else the last
const bank_prior &prior_for(const bank_priors &priors, const std::vector<double> &tau_s);

json json_of(const bank_priors &priors);
// Throws input_error with the place of what is no prior.
bank_priors read_priors(const std::string &path);

}  // namespace compbox::training
