// SPDX-License-Identifier: MIT
// Which group of inputs a linear map misses least on the runs left out, for hundreds of inputs:
// each fold is solved once, and a group leaves its solution by a formula.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "host-tools/regression/ridge.h"

namespace compbox::regression {

// A linear map with weight decay of all inputs, for each left-out fold.
class elimination {
  public:
    // x, t: scaled, one sample per row; decay: of all outputs; folds.usable()
    elimination(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t, const row_folds &folds,
                double decay, int threads);

    // in : columns of x, ascending, none of them removed before
    // out: residuals of all rows, each left out of training, without these columns
    Eigen::MatrixXd residuals_without(const std::vector<Eigen::Index> &columns) const;
    // Removes the columns from every fold's map.
    void remove(const std::vector<Eigen::Index> &columns);
    // out: residuals with the columns that remain
    Eigen::MatrixXd residuals() const;

  private:
    // With A the inverse of (x'x / N + decay) on the other folds' rows and U = x A on its own:
    // without the group g the weights change by A_g (A_gg)^-1 w_g, the predictions by U_g (…).
    struct fold {
        std::vector<Eigen::Index> rows;
        Eigen::MatrixXd a, u, weights, residuals;
    };
    void solve(fold &one, const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
               const std::vector<Eigen::Index> &others, double decay) const;

    std::vector<fold> folds_;
    Eigen::Index rows_ = 0;
};

}  // namespace compbox::regression
