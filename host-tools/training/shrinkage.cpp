// SPDX-License-Identifier: MIT
#include "host-tools/training/shrinkage.h"

#include <numeric>

#include "host-tools/algebra/solvers.h"

namespace compbox::training {

namespace {

constexpr double most_of_the_mix = 0.75;
constexpr double nothing_but_the_mean = 1e12;  // a decay that leaves no deviation
constexpr double least_gain = 1.0;             // square of one standard error

}  // namespace

std::array<double, 3> best_mix(const Eigen::Matrix3d &square, double doubt) {
    Eigen::Matrix3d calm = square;
    calm.diagonal().array() += 1e-9 * square.trace() + 1e-300;  // equal models share alike
    calm(0, 0) += doubt, calm(1, 1) += doubt;
    std::array<double, 3> best{1.0, 0.0, 0.0};
    double least = calm(0, 0);
    for (unsigned set = 1; set < 8; ++set) {
        std::vector<Eigen::Index> members;
        for (unsigned i = 0; i < 3; ++i) {
            if (set & (1u << i)) members.push_back(i);
        }
        const Eigen::MatrixXd some = calm(members, members);
        Eigen::VectorXd mix = algebra::factor_positive_definite(some).inverse.rowwise().sum();
        mix /= mix.sum();
        const double left = mix.dot(some * mix);
        if (mix.minCoeff() < 0.0 || left >= least) continue;
        least = left, best = {0.0, 0.0, 0.0};
        for (std::size_t i = 0; i < members.size(); ++i) {
            best[static_cast<std::size_t>(members[i])] = mix[static_cast<Eigen::Index>(i)];
        }
    }
    return best;
}

drawn_map draw_to(const weight_spread &spread, const regression::linear_map &own,
                  const Eigen::VectorXd &own_left_out, double rows, const Eigen::MatrixXd &x,
                  const Eigen::VectorXd &t, const regression::row_folds &folds,
                  const std::vector<Eigen::Index> &starts) {
    const auto counted = [&](const Eigen::MatrixXd &values) -> Eigen::MatrixXd {
        return starts.empty() ? values : regression::from_starts(values, starts);
    };
    const Eigen::VectorXd wanted = counted(t), by_mean = x * spread.mean;
    const double noise = (own_left_out - wanted).squaredNorm() / static_cast<double>(t.size());
    std::vector<Eigen::Index> all(static_cast<std::size_t>(spread.factor.cols()));
    std::iota(all.begin(), all.end(), 0);
    const auto with = [&](double decay) {
        return regression::average_maps(x * spread.factor, t - by_mean, folds, {all}, starts, 1,
                                        decay);
    };
    const regression::averaged_map mean = with(nothing_but_the_mean), shrunk = with(noise / rows);
    Eigen::MatrixXd predicted(t.size(), 3);
    predicted << own_left_out, counted(by_mean) + mean.left_out, counted(by_mean) + shrunk.left_out;
    const Eigen::MatrixXd off = predicted.colwise() - wanted;
    drawn_map drawn;
    drawn.share =
        best_mix(off.transpose() * off, least_gain * noise * static_cast<double>(t.size()) / rows);
    if (drawn.share[0] > most_of_the_mix) drawn.share = {1.0, 0.0, 0.0};
    const Eigen::Map<const Eigen::Vector3d> share(drawn.share.data());
    drawn.left_out = predicted * share;
    drawn.map.weights = share[0] * own.weights + (share[1] + share[2]) * spread.mean +
                        share[2] * (spread.factor * shrunk.map.weights);
    drawn.map.offset =
        share[0] * own.offset + share[1] * mean.map.offset + share[2] * shrunk.map.offset;
    return drawn;
}

}  // namespace compbox::training
