// SPDX-License-Identifier: MIT
#include "host-tools/regression/elimination.h"

#include "host-tools/algebra/solvers.h"
#include "host-tools/regression/parallel.h"

namespace compbox::regression {

namespace {

// (A_gg)^-1, the group's part of the inverse
Eigen::MatrixXd inverse_of_group(const Eigen::MatrixXd &a,
                                 const std::vector<Eigen::Index> &columns) {
    return algebra::factor_positive_definite(a(columns, columns)).inverse;
}

}  // namespace

void elimination::solve(fold &one, const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                        const std::vector<Eigen::Index> &others, double decay) const {
    const Eigen::MatrixXd x_out = x(others, Eigen::all), t_out = t(others, Eigen::all);
    const Eigen::RowVectorXd x_mean = x_out.colwise().mean(), t_mean = t_out.colwise().mean();
    const Eigen::MatrixXd centred = x_out.rowwise() - x_mean;
    const double share = 1.0 / static_cast<double>(others.size());
    Eigen::MatrixXd gram = centred.transpose() * centred * share;
    gram.diagonal().array() += decay;
    one.a = algebra::factor_positive_definite(gram).inverse;
    one.weights = one.a * (centred.transpose() * (t_out.rowwise() - t_mean) * share);
    const Eigen::MatrixXd own = x(one.rows, Eigen::all).rowwise() - x_mean;
    one.u = own * one.a;
    one.residuals = ((own * one.weights).rowwise() + t_mean) - t(one.rows, Eigen::all);
}

elimination::elimination(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t, const row_folds &folds,
                         double decay, int threads)
    : folds_(folds.count), rows_(x.rows()) {
    run_parallel(folds.count, threads, [&](std::size_t f) {
        folds_[f].rows = rows_inside(folds, f);
        solve(folds_[f], x, t, rows_outside(folds, f), decay);
    });
}

Eigen::MatrixXd elimination::residuals_without(const std::vector<Eigen::Index> &columns) const {
    Eigen::MatrixXd all(rows_, folds_.front().residuals.cols());
    for (const fold &one : folds_) {
        const Eigen::MatrixXd change =
            inverse_of_group(one.a, columns) * one.weights(columns, Eigen::all);
        all(one.rows, Eigen::all) = one.residuals - one.u(Eigen::all, columns) * change;
    }
    return all;
}

Eigen::MatrixXd elimination::residuals() const {
    Eigen::MatrixXd all(rows_, folds_.front().residuals.cols());
    for (const fold &one : folds_) all(one.rows, Eigen::all) = one.residuals;
    return all;
}

void elimination::remove(const std::vector<Eigen::Index> &columns) {
    for (fold &one : folds_) {
        const Eigen::MatrixXd inverse = inverse_of_group(one.a, columns);
        const Eigen::MatrixXd change = inverse * one.weights(columns, Eigen::all);
        const Eigen::MatrixXd rows = inverse * one.a(columns, Eigen::all);
        const Eigen::MatrixXd a = one.a(Eigen::all, columns), u = one.u(Eigen::all, columns);
        one.residuals -= u * change;
        one.weights -= a * change;
        one.a -= a * rows;
        one.u -= u * rows;
    }
}

}  // namespace compbox::regression
