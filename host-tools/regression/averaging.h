// SPDX-License-Identifier: MIT
// The mean of many linear maps over parts of the same inputs, which is again one linear map.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host-tools/regression/ridge.h"

namespace compbox::regression {

struct averaged_map {
    linear_map map;            // of all inputs
    Eigen::MatrixXd decay;     // of each member (row) and output
    Eigen::MatrixXd share;     // of each member (row) in each output; a column sums to 1
    Eigen::MatrixXd left_out;  // predictions of each row by maps trained without its fold
};

// in : x, t: scaled, one sample per row; folds.usable(); members: columns of x that each map uses,
//      1 or more; starts: rows where a run begins, ascending, if each run has an offset of its own
//      (rows of a run belong to one fold); else empty; threads: 0: one per processor
// out: each member has the strongest decay that is nearly as good as the best on the folds left out
//      (strongest_that_serves in ridge.h), and a share by the inverse square of its mean square
//      worst residual there. With offsets of runs, predictions and t count from each run's first
//      row, and the map's offset is the mean over the runs. With a decay above 0 that is every
//      member's.
averaged_map average_maps(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                          const row_folds &folds,
                          const std::vector<std::vector<Eigen::Index>> &members,
                          const std::vector<Eigen::Index> &starts, int threads, double decay = 0.0);

// Subtracts from each row the first row of its run.
Eigen::MatrixXd from_starts(const Eigen::MatrixXd &values, const std::vector<Eigen::Index> &starts);

}  // namespace compbox::regression
