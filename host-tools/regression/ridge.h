// SPDX-License-Identifier: MIT
// The linear baseline: regression with weight decay ("ridge"), the decay chosen by leaving out
// whole runs or by evidence.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace compbox::regression {

// Groups of rows that are left out together: fold[r] of row r, 0 … count - 1.
struct row_folds {
    std::vector<std::size_t> fold;
    std::size_t count = 0;  // 0 or 1: leaving out is impossible

    bool usable() const { return count >= 3; }
};

// One fold for each run, at most ten folds: the r-th run belongs to fold r mod 10.
row_folds folds_of(const std::vector<std::size_t> &runs);

// y = offset + weights^T x for one row x; one column of weights per output.
struct linear_map {
    Eigen::MatrixXd weights;
    Eigen::VectorXd offset;

    Eigen::MatrixXd predict(const Eigen::MatrixXd &x) const {
        return (x * weights).rowwise() + offset.transpose();
    }
};

// Minimises 1/(2N) sum (y - t)^2 + 1/2 decay_k |w_k|^2 for each output k; the offset is free.
class ridge_solver {
  public:
    // x, t: one sample per row
    ridge_solver(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t);
    linear_map solve(const Eigen::VectorXd &decay) const;

    // MacKay's update, one decay and one noise for all outputs, until it converges.
    struct evidence {
        double decay, log_evidence, effective_parameters;
    };
    evidence find_evidence() const;

  private:
    double residual_squares(double decay) const;

    Eigen::Index samples_;
    Eigen::VectorXd x_mean_, t_mean_, eigenvalues_;  // of x^T x / N
    Eigen::MatrixXd eigenvectors_, projected_;       // projected: V^T x^T t / N
    Eigen::VectorXd t_power_;                        // mean square of each output
};

// Results of leaving out, for each decay of a grid.
struct ridge_choice {
    Eigen::VectorXd decay;     // of each output
    Eigen::MatrixXd left_out;  // predictions of each row by a map trained without its run
};

// For each output the strongest decay that is nearly as good as the best on the left-out runs: the
// square of the worst residual, averaged over the folds, is within 2 % of the least. The worst
// residual counts, because machines are judged by it. in: folds.usable()
ridge_choice choose_by_folds(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                             const row_folds &folds);

// Rows in a fold (inside) or not (outside).
std::vector<Eigen::Index> rows_inside(const row_folds &folds, std::size_t fold);
std::vector<Eigen::Index> rows_outside(const row_folds &folds, std::size_t fold);

}  // namespace compbox::regression
