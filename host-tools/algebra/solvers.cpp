// SPDX-License-Identifier: MIT
#include "host-tools/algebra/solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

namespace compbox::algebra {

least_squares solve_least_squares(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b,
                                  double threshold) {
    if (a.hasNaN()) return {Eigen::MatrixXd::Constant(a.cols(), b.cols(), NAN), 0};
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    if (threshold > 0.0) solver.setThreshold(threshold);
    solver.compute(a);
    return {solver.solve(b), solver.rank()};
}

Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd &a) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> decomposition(a);
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(a.cols(), a.cols());
    const Eigen::Index rows = std::min(a.rows(), a.cols());
    factor.topRows(rows) = decomposition.matrixQR().topRows(rows).triangularView<Eigen::Upper>();
    return factor;
}

symmetric_eigen eigen_of_symmetric(const Eigen::MatrixXd &a) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(a);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

positive_definite factor_positive_definite(const Eigen::MatrixXd &a) {
    const Eigen::LLT<Eigen::MatrixXd> factor(a);
    const Eigen::MatrixXd lower = factor.matrixL();
    return {factor.solve(Eigen::MatrixXd::Identity(a.rows(), a.cols())),
            2.0 * lower.diagonal().array().log().sum()};
}

}  // namespace compbox::algebra
