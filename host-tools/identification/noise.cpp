// SPDX-License-Identifier: MIT
#include "host-tools/identification/noise.h"

#include <algorithm>
#include <cmath>

namespace compbox::identification {

namespace {

constexpr double one_in_1000 = 3.09;

// Bartlett's test of equal variances: whether chance explains their differences.
bool one_variance(const std::vector<double> &variances, const std::vector<int> &freedoms) {
    double sum = 0.0, squares = 0.0, inverse = 0.0, freedom = 0.0, count = 0.0;
    for (std::size_t i = 0; i < variances.size(); ++i) {
        if (freedoms[i] == 0) continue;
        squares += freedoms[i] * variances[i];
        sum -= freedoms[i] * std::log(variances[i]);
        inverse += 1.0 / freedoms[i];
        freedom += freedoms[i];
        count += 1.0;
    }
    if (count < 2.0) return true;
    const double correction = 1.0 + (inverse - 1.0 / freedom) / (3.0 * (count - 1.0));
    sum += freedom * std::log(squares / freedom);
    return sum / correction <= largest_chance(count - 1.0, one_in_1000);
}

// in : the lines of one direction, with repeats that differ
// out: sigma of the mean of each
std::vector<double> sigma_of_direction(const std::vector<line_repeats> &lines) {
    double squares = 0.0, freedom = 0.0;
    std::vector<double> variances;
    std::vector<int> freedoms;
    for (const auto &line : lines) {
        squares += line.freedom * line.variance_um2;
        freedom += line.freedom;
        variances.push_back(line.variance_um2);
        freedoms.push_back(line.freedom);
    }
    const bool alike = one_variance(variances, freedoms);
    std::vector<double> sigma;
    for (const auto &line : lines) {
        const double one = alike || line.freedom == 0 ? squares / freedom : line.variance_um2;
        sigma.push_back(std::sqrt(one * line.mean_share));
    }
    return sigma;
}

// Sums of the slope ratios of several lines.
struct slope_sums {
    double ratio = 0.0;
    int freedom = 0;
    void add(const line_repeats &line) {
        ratio += line.slope_freedom * line.slope_ratio;
        freedom += line.slope_freedom;
    }
    // 1 unless it is larger beyond chance.
    double factor() const {
        const bool chance = freedom == 0 || ratio <= largest_chance(freedom, one_in_1000);
        return chance ? 1.0 : std::sqrt(ratio / freedom);
    }
};

}  // namespace

double largest_chance(double freedom, double deviation) {
    const double share = 2.0 / (9.0 * freedom);
    return freedom * std::pow(1.0 - share + deviation * std::sqrt(share), 3.0);
}

line_repeats repeats_of(const std::vector<double> &position_mm, const std::vector<line_run> &runs) {
    const auto n = static_cast<Eigen::Index>(position_mm.size());
    Eigen::VectorXd t = Eigen::Map<const Eigen::VectorXd>(position_mm.data(), n);
    t.array() -= t.mean();
    const double tt = t.squaredNorm();
    double rest = 0.0, slopes = 0.0;
    int repeats = 0;
    for (const bool backward : {false, true}) {
        std::vector<Eigen::VectorXd> same;
        Eigen::VectorXd mean = Eigen::VectorXd::Zero(n);
        for (const auto &run : runs) {
            if (run.backward != backward) continue;
            same.push_back(Eigen::Map<const Eigen::VectorXd>(run.error_um.data(), n));
            mean += same.back();
        }
        if (same.size() < 2) continue;
        mean /= static_cast<double>(same.size());
        repeats += static_cast<int>(same.size()) - 1;
        for (auto &run : same) {
            run -= mean;
            run.array() -= run.mean();
            const double slope = t.dot(run) / tt;
            slopes += slope * slope;
            rest += (run - slope * t).squaredNorm();
        }
    }
    line_repeats found;
    found.freedom = repeats * (static_cast<int>(n) - 2);
    if (found.freedom > 0) found.variance_um2 = rest / found.freedom;
    if (found.variance_um2 > 0.0) {
        found.slope_freedom = repeats;
        found.slope_ratio = slopes / repeats * tt / found.variance_um2;
    }
    return found;
}

Eigen::VectorXd slope_factors(const std::vector<line_repeats> &lines) {
    slope_sums all, directions[3];
    for (std::size_t line = 0; line < lines.size(); ++line) {
        all.add(lines[line]);
        directions[line % 3].add(lines[line]);
    }
    std::vector<double> ratios;
    std::vector<int> freedoms;
    for (const auto &one : directions) {
        ratios.push_back(std::max(one.ratio / std::max(one.freedom, 1), 1e-9));
        freedoms.push_back(one.freedom);
    }
    const bool alike = one_variance(ratios, freedoms);
    Eigen::VectorXd factors(static_cast<Eigen::Index>(lines.size()));
    for (std::size_t line = 0; line < lines.size(); ++line) {
        factors(static_cast<Eigen::Index>(line)) =
            alike ? all.factor() : directions[line % 3].factor();
    }
    return factors;
}

line_sigma sigma_by_runs(const std::vector<line_repeats> &lines) {
    constexpr double least = 1e-4;  // of the largest variance
    double largest = 0.0;
    for (const auto &line : lines) largest = std::max(largest, line.variance_um2);
    line_sigma sigma(static_cast<Eigen::Index>(lines.size()));
    for (std::size_t direction = 0; direction < 3; ++direction) {
        std::vector<line_repeats> alike;
        bool repeats = false;
        for (std::size_t line = direction; line < lines.size(); line += 3) {
            alike.push_back(lines[line]);
            alike.back().variance_um2 = std::max(alike.back().variance_um2, least * largest);
            repeats = repeats || alike.back().freedom > 0;
        }
        if (!repeats || largest == 0.0) return {};
        const std::vector<double> found = sigma_of_direction(alike);
        for (std::size_t point = 0; point < found.size(); ++point) {
            sigma(static_cast<Eigen::Index>(3 * point + direction)) = found[point];
        }
    }
    return sigma;
}

}  // namespace compbox::identification
