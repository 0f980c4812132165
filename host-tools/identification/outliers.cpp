// SPDX-License-Identifier: MIT
#include "host-tools/identification/outliers.h"

#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"

namespace compbox::identification {

namespace {

// Two-sided quantile of the normal distribution for a small probability, by Newton on erfc.
double normal_quantile(double probability) {
    double z = 3.0;
    for (int i = 0; i < 60; ++i) {
        const double excess = std::erfc(z / std::sqrt(2.0)) - probability;
        z += excess / (std::sqrt(2.0 / M_PI) * std::exp(-0.5 * z * z));
    }
    return z;
}

struct place {
    Eigen::Index row;
    int line;
};

// Residuals are R d with the projection R = R_positions x R_lines. Leaving a reading out is
// equivalent to giving it an error of its own, which follows from the residuals at the left-out
// places.
class left_out_residuals {
  public:
    left_out_residuals(const nine_line_readings &data, const std::vector<double> &position_mm,
                       const Eigen::MatrixXd &line_maker, bool separate)
        : residual_(data * line_maker.transpose()), line_maker_(line_maker), separate_(separate) {
        t_ = Eigen::Map<const Eigen::VectorXd>(position_mm.data(), data.rows());
        t_.array() -= t_.mean();
        tt_ = t_.squaredNorm();
    }

    void leave_out(place where) {
        out_.push_back(where);
        const auto m = static_cast<Eigen::Index>(out_.size());
        Eigen::MatrixXd R(m, m);
        Eigen::VectorXd r(m);
        for (Eigen::Index i = 0; i < m; ++i) {
            r(i) = residual_(at(i).row, at(i).line);
            for (Eigen::Index k = 0; k < m; ++k) R(i, k) = element(at(i), at(k));
        }
        inverse_ = algebra::solve_least_squares(R, Eigen::MatrixXd::Identity(m, m)).x;
        error_ = inverse_ * r;
    }

    // in : a reading
    // out: its residual over sqrt of its share of the noise; negative if it has no redundancy
    double scaled(place where) const {
        const auto m = static_cast<Eigen::Index>(out_.size());
        Eigen::VectorXd towards(m);
        for (Eigen::Index i = 0; i < m; ++i) towards(i) = element(where, at(i));
        double share = element(where, where), rest = residual_(where.row, where.line);
        if (m > 0) {
            share -= towards.dot(inverse_ * towards);
            rest -= towards.dot(error_);
        }
        return share > 1e-6 ? std::fabs(rest) / std::sqrt(share) : -1.0;
    }

  private:
    const place &at(Eigen::Index i) const { return out_[static_cast<std::size_t>(i)]; }

    double element(place a, place b) const {
        double along = a.row == b.row ? 1.0 : 0.0;
        if (separate_) along -= 1.0 / static_cast<double>(t_.size()) + t_(a.row) * t_(b.row) / tt_;
        return along * line_maker_(a.line, b.line);
    }

    nine_line_readings residual_;
    Eigen::MatrixXd line_maker_;
    bool separate_;
    Eigen::VectorXd t_;
    double tt_ = 0.0;
    std::vector<place> out_;
    Eigen::MatrixXd inverse_;
    Eigen::VectorXd error_;
};

// Lines whose bad reading leaves the same residuals up to their size. The distances between the
// points are the only redundancy of the lines.
std::vector<int> lines_like(int line, const Eigen::MatrixXd &line_maker) {
    constexpr double alike = 0.99;  // correlation
    std::vector<int> others;
    for (int k = 0; k < line_maker.rows(); ++k) {
        const double sizes = std::sqrt(line_maker(k, k) * line_maker(line, line));
        if (k != line && std::fabs(line_maker(k, line)) > alike * sizes) others.push_back(k);
    }
    return others;
}

}  // namespace

std::vector<six_curves::outlier> find_outliers(const nine_line_readings &data,
                                               const std::vector<double> &position_mm,
                                               const Eigen::MatrixXd &line_maker,
                                               const identify_options &options, int freedom) {
    left_out_residuals rest(data, position_mm, line_maker, options.lines == setups::separate);
    // The residuals of exact readings are rounding, not noise.
    const double least = std::max(1e-12, 1e-10 * data.cwiseAbs().maxCoeff());
    std::vector<six_curves::outlier> found;
    const auto most = static_cast<std::size_t>(std::max(1, freedom / 4));
    while (found.size() < most) {
        std::vector<double> sizes;
        double largest = 0.0;
        place worst{0, 0};
        for (Eigen::Index row = 0; row < data.rows(); ++row) {
            for (int line = 0; line < data.cols(); ++line) {
                const double size = rest.scaled({row, line});
                if (size < 0.0) continue;
                sizes.push_back(size);
                if (size > largest) {
                    largest = size;
                    worst = {row, line};
                }
            }
        }
        if (sizes.empty()) break;
        const double tested = static_cast<double>(sizes.size());
        auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
        std::nth_element(sizes.begin(), middle, sizes.end());
        const double studentised = largest / std::max(*middle / 0.6745, least);
        if (studentised <= normal_quantile(options.outlier_probability / tested)) break;
        found.push_back({static_cast<std::size_t>(worst.row), worst.line, studentised,
                         lines_like(worst.line, line_maker)});
        rest.leave_out(worst);
    }
    std::sort(found.begin(), found.end(),
              [](const auto &a, const auto &b) { return a.studentised > b.studentised; });
    return found;
}

}  // namespace compbox::identification
