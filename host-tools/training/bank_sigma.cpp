// SPDX-License-Identifier: MIT
#include "host-tools/training/bank_sigma.h"

#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"

namespace compbox::training {

namespace {

constexpr Eigen::Index most_directions = 4;  // CB_MAX_DIRECTIONS

// The best growth of the variance with the distance, and the variance at distance 0.
struct growth {
    double share = 0.0, variance = 0.0;
};

// in : squares of the residuals and of the distances of the same rows; least: of the share
// out: the share of maximum likelihood: the variance of a row is variance * (1 + share * distance)
growth growth_of(const Eigen::ArrayXd &squares, const Eigen::ArrayXd &distances, double least) {
    growth best;
    double most = INFINITY;
    for (double share = least; share < 3.0; share *= 1.3) {
        const Eigen::ArrayXd factor = 1.0 + share * distances;
        const double variance = std::max((squares / factor).mean(), 1e-12);
        const double unlikely = std::log(variance) + factor.log().mean();
        if (unlikely < most) most = unlikely, best = {share, variance};
    }
    return best;
}

}  // namespace

bool has_sigma(const train_result &result) {
    return result.options.bank && !result.options.zero_at_start &&
           result.linear.left_out_predictions.rows() > 0;
}

Eigen::MatrixXd places_of(const bank_sigma &sigma, const Eigen::MatrixXd &x) {
    return (x * sigma.weights.transpose()).rowwise() + sigma.offset.transpose();
}

bank_sigma sigma_of_bank(const train_result &result) {
    const scaling &in = result.linear.model.in;
    const Eigen::MatrixXd z =
        (result.learn.x.rowwise() - in.centre.transpose()) * in.scale.cwiseInverse().asDiagonal();
    const auto rows = static_cast<double>(z.rows());
    const Eigen::RowVectorXd mean = z.colwise().mean();
    const Eigen::MatrixXd covariance = z.transpose() * z / rows - mean.transpose() * mean;
    const auto axes = algebra::eigen_of_symmetric(covariance);  // ascending
    const Eigen::Index count = std::min(most_directions, z.cols());
    bank_sigma sigma;
    sigma.weights.resize(count, z.cols()), sigma.offset.resize(count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::Index axis = z.cols() - 1 - k;
        const double spread = std::sqrt(std::max(axes.values[axis], 1e-12));
        const Eigen::RowVectorXd scaled = axes.vectors.col(axis).transpose() / spread;
        sigma.weights.row(k) = scaled * in.scale.cwiseInverse().asDiagonal();
        sigma.offset[k] = -scaled.dot(mean) - sigma.weights.row(k).dot(in.centre);
    }
    const Eigen::ArrayXd distances = places_of(sigma, result.learn.x).rowwise().squaredNorm();
    const double least = 1.0 / static_cast<double>(result.data.run_names.size());
    const Eigen::Index outputs = result.learn.y.cols();
    sigma.floor_um.resize(outputs), sigma.along_um.resize(outputs);
    for (Eigen::Index k = 0; k < outputs; ++k) {
        const Eigen::ArrayXd left =
            result.learn.y.col(k) - result.linear.left_out_predictions.col(k);
        const growth found = growth_of(left.square(), distances, least);
        sigma.floor_um[k] = std::sqrt(found.variance);
        sigma.along_um[k] = std::sqrt(found.variance * found.share);
    }
    return sigma;
}

}  // namespace compbox::training
