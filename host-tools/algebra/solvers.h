// SPDX-License-Identifier: MIT
// Eigen's decompositions of matrices of any size, compiled once each, because they take longer to
// compile than the files that use them.
#pragma once

#include <Eigen/Core>

namespace compbox::algebra {

struct least_squares {
    Eigen::MatrixXd x;  // columns of a by columns of b
    Eigen::Index rank;  // of a
};

// in : threshold: a pivot less than this fraction of the largest counts as zero; 0: by rounding
// out: for each column of b the x of least |a x - b|; if a lacks full rank, the smallest such x.
//      With the identity as b: the inverse of a, or its pseudo-inverse. NaN if an input is NaN.
least_squares solve_least_squares(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b,
                                  double threshold = 0.0);

// out: the square upper triangle r of a = q r with q orthogonal, padded with zeros where a has
// fewer
//      rows than columns. Rows of a may be given in pieces: the factor of the last factor above the
//      next rows is that of all.
Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd &a);

struct symmetric_eigen {
    Eigen::VectorXd values;   // ascending
    Eigen::MatrixXd vectors;  // columns, of length 1
};

// in : a symmetric; only its lower half is read
symmetric_eigen eigen_of_symmetric(const Eigen::MatrixXd &a);

struct positive_definite {
    Eigen::MatrixXd inverse;
    double log_determinant;
};

// in : a positive definite; only its lower half is read
positive_definite factor_positive_definite(const Eigen::MatrixXd &a);

}  // namespace compbox::algebra
