// SPDX-License-Identifier: MIT
#include "host-tools/regression/gain.h"

#include <cmath>

namespace compbox::regression {

namespace {

constexpr Eigen::Index least_runs = 5;
constexpr double each_run_left = 0.8 * 0.8;  // of the mean square
constexpr double no_square = 1e-300;
constexpr double normal_quantile = 1.959964;

}  // namespace

double student_quantile(Eigen::Index freedom) {
    // Cornish and Fisher's series
    const double z = normal_quantile, z2 = z * z, n = static_cast<double>(freedom);
    const double first = z * (z2 + 1.0) / 4.0;
    const double second = z * (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / 96.0;
    const double third = z * (3.0 * z2 * z2 * z2 + 19.0 * z2 * z2 + 17.0 * z2 - 15.0) / 384.0;
    return z + first / n + second / (n * n) + third / (n * n * n);
}

bool is_clear_gain(const Eigen::ArrayXd &linear, const Eigen::ArrayXd &network) {
    if ((network <= each_run_left * linear).all() && (linear > 0.0).all()) return true;
    const Eigen::Index runs = linear.size();
    if (runs < least_runs) return false;
    const Eigen::ArrayXd saved = linear.max(no_square).log() - network.max(no_square).log();
    const double n = static_cast<double>(runs), mean = saved.mean();
    const double error = std::sqrt((saved - mean).square().sum() / (n * (n - 1.0)));
    return mean > student_quantile(runs - 1) * error;
}

}  // namespace compbox::regression
