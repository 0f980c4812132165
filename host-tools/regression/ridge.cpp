// SPDX-License-Identifier: MIT
#include "host-tools/regression/ridge.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "host-tools/algebra/solvers.h"

namespace compbox::regression {

namespace {

constexpr std::size_t most_folds = 10;
constexpr int grid_points = 29;

// 1e-6 … 10 in quarter decades, for scaled inputs.
double grid_decay(int index) {
    return std::pow(10.0, -6.0 + 0.25 * index);
}

// in : square of the worst residual of each left-out fold, one row for each decay of the grid
// out: the strongest decay whose mean over the folds is within a fiftieth of the least. The runs
//      hardly distinguish it from the best, and it is calmer on other runs
Eigen::Index strongest_that_serves(const std::vector<Eigen::MatrixXd> &squares,
                                   Eigen::Index output) {
    Eigen::ArrayXd mean = Eigen::ArrayXd::Zero(grid_points);
    for (const auto &fold : squares) mean += fold.col(output).array();
    Eigen::Index strongest = grid_points - 1;
    while (mean[strongest] > 1.02 * mean.minCoeff()) --strongest;
    return strongest;
}

}  // namespace

row_folds folds_of(const std::vector<std::size_t> &runs) {
    row_folds folds;
    std::map<std::size_t, std::size_t> ranks;  // held-out runs leave gaps
    for (const std::size_t run : runs) ranks[run] = 0;
    std::size_t rank = 0;
    for (auto &run : ranks) run.second = rank++;
    for (const std::size_t run : runs) folds.fold.push_back(ranks[run] % most_folds);
    folds.count = std::min(ranks.size(), most_folds);
    return folds;
}

std::vector<Eigen::Index> rows_inside(const row_folds &folds, std::size_t fold) {
    std::vector<Eigen::Index> rows;
    for (std::size_t r = 0; r < folds.fold.size(); ++r) {
        if (folds.fold[r] == fold) rows.push_back(static_cast<Eigen::Index>(r));
    }
    return rows;
}

std::vector<Eigen::Index> rows_outside(const row_folds &folds, std::size_t fold) {
    std::vector<Eigen::Index> rows;
    for (std::size_t r = 0; r < folds.fold.size(); ++r) {
        if (folds.fold[r] != fold) rows.push_back(static_cast<Eigen::Index>(r));
    }
    return rows;
}

ridge_solver::ridge_solver(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t)
    : samples_(x.rows()), x_mean_(x.colwise().mean()), t_mean_(t.colwise().mean()) {
    const double share = 1.0 / static_cast<double>(samples_);
    const Eigen::MatrixXd centred = x.rowwise() - x_mean_.transpose();
    const Eigen::MatrixXd wanted = t.rowwise() - t_mean_.transpose();
    const algebra::symmetric_eigen eigen =
        algebra::eigen_of_symmetric(centred.transpose() * centred * share);
    eigenvalues_ = eigen.values.cwiseMax(0.0);
    eigenvectors_ = eigen.vectors;
    projected_ = eigenvectors_.transpose() * (centred.transpose() * wanted) * share;
    t_power_ = wanted.colwise().squaredNorm() * share;
}

linear_map ridge_solver::solve(const Eigen::VectorXd &decay) const {
    linear_map map;
    map.weights.resize(eigenvectors_.rows(), projected_.cols());
    for (Eigen::Index k = 0; k < projected_.cols(); ++k) {
        const Eigen::ArrayXd shrunk = projected_.col(k).array() / (eigenvalues_.array() + decay[k]);
        map.weights.col(k) = eigenvectors_ * shrunk.matrix();
    }
    map.offset = t_mean_ - map.weights.transpose() * x_mean_;
    return map;
}

// Sum of squares of all residuals at one decay.
double ridge_solver::residual_squares(double decay) const {
    double mean_square = 0.0;
    for (Eigen::Index k = 0; k < projected_.cols(); ++k) {
        const Eigen::ArrayXd p = projected_.col(k).array();
        const Eigen::ArrayXd w = p / (eigenvalues_.array() + decay);
        mean_square += t_power_[k] - (2.0 * w * p - w.square() * eigenvalues_.array()).sum();
    }
    return std::max(mean_square, 1e-15 * t_power_.sum()) * static_cast<double>(samples_);
}

// out: decay and log evidence after at most 200 of MacKay's updates, relative change 1e-6
ridge_solver::evidence ridge_solver::find_evidence() const {
    const double n = static_cast<double>(samples_), outputs = static_cast<double>(t_power_.size());
    double decay = 1e-3, gamma = 0.0, beta = 1.0;
    for (int round = 0; round < 200; ++round) {
        gamma = outputs * (eigenvalues_.array() / (eigenvalues_.array() + decay)).sum();
        double weights = 0.0;
        for (Eigen::Index k = 0; k < projected_.cols(); ++k) {
            weights += (projected_.col(k).array() / (eigenvalues_.array() + decay)).square().sum();
        }
        beta = std::max(n * outputs - gamma, 1.0) / residual_squares(decay);
        const double next = std::clamp(gamma / (weights * beta * n), 1e-12, 1e6);
        const bool still = std::abs(next - decay) <= 1e-6 * decay;
        decay = next;
        if (still) break;
    }
    constexpr double two_pi = 6.283185307179586;
    // ln p(t) with alpha = decay * beta * N, the offset with a prior of unit spread
    const double alpha = decay * beta * n;
    const Eigen::ArrayXd curvature = beta * n * eigenvalues_.array() + alpha;
    double weights = 0.0;
    for (Eigen::Index k = 0; k < projected_.cols(); ++k) {
        weights += (projected_.col(k).array() / (eigenvalues_.array() + decay)).square().sum();
    }
    const double inputs = static_cast<double>(eigenvalues_.size());
    const double log_evidence =
        0.5 * outputs * (inputs * std::log(alpha) - curvature.log().sum() - std::log(beta * n)) +
        0.5 * n * outputs * std::log(beta / two_pi) -
        0.5 * (beta * residual_squares(decay) + alpha * weights);
    return {decay, log_evidence, gamma};
}

ridge_choice choose_by_folds(const Eigen::MatrixXd &x, const Eigen::MatrixXd &t,
                             const row_folds &folds) {
    std::vector<Eigen::MatrixXd> squares(folds.count);  // of each fold: grid by outputs
    std::vector<std::vector<linear_map>> maps(folds.count);
    for (std::size_t f = 0; f < folds.count; ++f) {
        const auto in = rows_inside(folds, f), out = rows_outside(folds, f);
        const ridge_solver solver(x(out, Eigen::all), t(out, Eigen::all));
        const Eigen::MatrixXd x_in = x(in, Eigen::all), t_in = t(in, Eigen::all);
        squares[f].resize(grid_points, t.cols());
        for (int g = 0; g < grid_points; ++g) {
            maps[f].push_back(solver.solve(Eigen::VectorXd::Constant(t.cols(), grid_decay(g))));
            const Eigen::MatrixXd off = maps[f].back().predict(x_in) - t_in;
            squares[f].row(g) = off.cwiseAbs2().colwise().maxCoeff();
        }
    }
    ridge_choice choice{Eigen::VectorXd(t.cols()), Eigen::MatrixXd(t.rows(), t.cols())};
    for (Eigen::Index k = 0; k < t.cols(); ++k) {
        const Eigen::Index best = strongest_that_serves(squares, k);
        choice.decay[k] = grid_decay(static_cast<int>(best));
        for (std::size_t f = 0; f < folds.count; ++f) {
            const linear_map &map = maps[f][static_cast<std::size_t>(best)];
            for (const Eigen::Index r : rows_inside(folds, f)) {
                choice.left_out(r, k) = x.row(r).dot(map.weights.col(k)) + map.offset[k];
            }
        }
    }
    return choice;
}

}  // namespace compbox::regression
