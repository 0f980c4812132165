// SPDX-License-Identifier: MIT
#include "host-tools/fitting/run_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace compbox::fitting {

namespace {

constexpr std::array<double, 5> shares = {0.2, 0.5, 0.75, 0.9, 0.99};
constexpr std::array<double, 2> few_shares = {0.7, 0.99};
constexpr double length_factor = 2.0;
// Longest correlation, in travels: beyond it, the noise is an offset of each run.
constexpr double longest_noise = 4.0;
// The same where noise competes with a line of each run.
constexpr double shorter_than_lines = 0.25;

// One run's deviations from the mean, each divided by its own standard deviation / noise, so that
// all have the same size and the correlation of the noise itself.
struct deviations {
    std::vector<double> step, place, value, scale;  // place: -1 … 1; scale: what it was divided by
    double part = 0.0;  // of the run's readings that is independent of the mean
};

std::size_t target_of(const measurement &data, double position) {
    const auto above = std::upper_bound(data.position.begin(), data.position.end(), position);
    return static_cast<std::size_t>(above - data.position.begin()) - 1;
}

// Sums of the readings of each target and direction.
struct target_sums {
    std::vector<double> weight, value;
    std::vector<int> count;

    explicit target_sums(const measurement &data)
        : weight(2 * data.position.size()), value(weight.size()), count(weight.size()) {
        for (const auto &run : data.runs) {
            for (std::size_t i = 0; i < run.position.size(); ++i) {
                const std::size_t at = place_of(data, run, i);
                const double w = 1.0 / (run.sigma[i] * run.sigma[i]);
                weight[at] += w;
                value[at] += w * reading_of(data, run, i);
                ++count[at];
            }
        }
    }
    static std::size_t place_of(const measurement &data, const measured_run &run, std::size_t i) {
        return 2 * target_of(data, run.position[i]) + (run.direction < 0 ? 1 : 0);
    }
    static double reading_of(const measurement &data, const measured_run &run, std::size_t i) {
        return run.error[i] - run.offset - run.slope * (run.position[i] - data.centre());
    }
};

// in : sums of all runs
// out: the deviations of one run at targets that other runs reached too
deviations deviations_of(const measurement &data, const measured_run &run,
                         const target_sums &sums) {
    deviations found;
    const double half_range = 0.5 * (data.to() - data.from());
    for (std::size_t i = 0; i < run.position.size(); ++i) {
        const std::size_t at = target_sums::place_of(data, run, i);
        if (sums.count[at] < 2) continue;
        const double independent = 1.0 - 1.0 / (run.sigma[i] * run.sigma[i] * sums.weight[at]);
        const double scale = run.sigma[i] * std::sqrt(independent);
        const double off = target_sums::reading_of(data, run, i) - sums.value[at] / sums.weight[at];
        found.step.push_back(static_cast<double>(at / 2));
        found.place.push_back((run.position[i] - data.centre()) / half_range);
        found.value.push_back(off / scale);
        found.scale.push_back(scale);
        found.part += independent;
    }
    if (!found.value.empty()) found.part /= static_cast<double>(found.value.size());
    return found;
}

std::vector<deviations> deviations_of(const measurement &data) {
    const target_sums sums(data);
    std::vector<deviations> all;
    for (const auto &run : data.runs) {
        all.push_back(deviations_of(data, run, sums));
        if (all.back().value.size() < 2) all.pop_back();
    }
    return all;
}

// Of one run with one kind of noise.
struct whitened {
    double squares = 0.0, log_determinant = 0.0;
    double lines_determinant = 0.0;  // of the line's two coefficients, with lines
};

// in : lines: the run has an offset and a slope of its own
// out: the squares of the whitened deviations (beside the line); a scalar Kalman filter
whitened whiten(const deviations &run, const noise_kind &kind, bool lines) {
    using row = std::array<double, 3>;  // the deviation, and the line's two regressors
    whitened found;
    row state = {};
    std::array<row, 3> products = {};
    double variance = kind.share;
    for (std::size_t i = 0; i < run.value.size(); ++i) {
        if (i > 0) {
            const double decay = std::exp(-std::abs(run.step[i] - run.step[i - 1]) / kind.length);
            for (double &s : state) s *= decay;
            variance = decay * decay * variance + kind.share * (1.0 - decay * decay);
        }
        const double spread = variance + 1.0 - kind.share;
        const row reading = {run.value[i], 1.0 / run.scale[i], run.place[i] / run.scale[i]};
        row off;
        for (std::size_t k = 0; k < 3; ++k) {
            off[k] = reading[k] - state[k];
            state[k] += variance / spread * off[k];
        }
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t j = 0; j < 3; ++j) products[k][j] += off[k] * off[j] / spread;
        }
        found.log_determinant += std::log(spread);
        variance *= (1.0 - kind.share) / spread;
    }
    found.squares = products[0][0];
    if (!lines) return found;
    const double a = products[1][1], b = products[1][2], c = products[2][2];
    const double u = products[0][1], v = products[0][2], determinant = a * c - b * b;
    if (determinant <= 1e-12 * a * c) return found;
    found.squares -= (c * u * u - 2.0 * b * u * v + a * v * v) / determinant;
    found.lines_determinant = std::log(determinant);
    return found;
}

// in : restricted: the lines' coefficients cost degrees of freedom, for the noise's size
noise_evidence evidence_of(const std::vector<deviations> &runs, const noise_kind &kind, bool lines,
                           bool restricted) {
    noise_evidence found;
    found.kind = kind;
    double squares = 0.0;
    for (const auto &run : runs) {
        const whitened one = whiten(run, kind, lines);
        squares += run.part * std::max(one.squares, 0.0);
        found.log_determinant += run.part * one.log_determinant;
        found.freedom += run.part * static_cast<double>(run.value.size());
        if (!lines || !restricted) continue;
        found.log_determinant += run.part * one.lines_determinant;
        found.freedom -= 2.0 * run.part;
    }
    if (found.freedom > 0.0) found.mean_square = squares / found.freedom;
    return found;
}

// White noise first. longest: in steps
template <std::size_t count>
std::vector<noise_kind> lattice_of(double shortest, double factor, double longest,
                                   const std::array<double, count> &of_shares) {
    std::vector<noise_kind> kinds = {noise_kind{}};
    for (double length = shortest; length <= longest; length *= factor) {
        for (const double share : of_shares) kinds.push_back({share, length});
    }
    return kinds;
}

// White noise has half of the prior.
double log_prior_of(const noise_kind &kind, std::size_t kinds) {
    return std::log(kind.white() ? 0.5 : 0.5 / static_cast<double>(kinds - 1));
}

// Variance of the slope of the line through the mean, for noise of this kind and of size 1.
double slope_factor(const measurement &data, const noise_kind &kind) {
    const auto n = static_cast<double>(data.position.size());
    double middle = 0.0, tt = 0.0, sum = 0.0, before = 0.0;
    for (const double x : data.position) middle += x / n;
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double t = data.position[i] - middle, part = t * std::sqrt(data.variance[i]);
        tt += t * t;
        sum += part * part + 2.0 * kind.share * part * before;
        before = (before + part) * std::exp(-1.0 / kind.length);
    }
    return sum / (tt * tt);
}

}  // namespace

double noise_kind::neighbours() const {
    return share * std::exp(-1.0 / length);
}

double noise_evidence::log_likelihood() const {
    if (freedom <= 0.0) return 0.0;
    return -0.5 * (freedom * std::log(std::max(mean_square, 1e-300)) + log_determinant);
}

std::vector<noise_evidence> possible_noise(const measurement &data) {
    const double longest = longest_noise * static_cast<double>(data.position.size());
    const auto kinds = lattice_of(2.0, 4.0, longest, few_shares);
    std::vector<noise_evidence> all;
    for (const auto &kind : kinds) {
        noise_evidence one;
        one.kind = kind;
        one.log_prior = log_prior_of(kind, kinds.size());
        one.freedom = data.cells.freedom;
        one.mean_square = data.cells.variance / (1.0 - kind.share);
        one.log_determinant = one.freedom * std::log(1.0 - kind.share);
        all.push_back(one);
    }
    return all;
}

std::vector<noise_evidence> noise_of_runs(const measurement &data) {
    const auto runs = deviations_of(data);
    const noise_evidence white = evidence_of(runs, {}, data.runs_aligned, true);
    if (white.freedom < 3.0 || white.mean_square <= 0.0) return {white};
    const double longest = longest_noise * static_cast<double>(data.position.size());
    const auto kinds = lattice_of(1.0, length_factor, longest, shares);
    std::vector<noise_evidence> all;
    for (const auto &kind : kinds) {
        all.push_back(evidence_of(runs, kind, data.runs_aligned, true));
        all.back().log_prior = log_prior_of(kind, kinds.size());
    }
    return all;
}

double variance_of_slope(const measurement &data) {
    const auto kinds = noise_of_runs(data);
    std::vector<double> likelihood;
    for (const auto &one : kinds) likelihood.push_back(one.log_likelihood() + one.log_prior);
    const double best = *std::max_element(likelihood.begin(), likelihood.end());
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        const double weight = std::exp(likelihood[i] - best);
        sum += weight * kinds[i].mean_square * slope_factor(data, kinds[i].kind);
        weights += weight;
    }
    return sum / weights;
}

double gain_by_lines(const measurement &data) {
    const auto runs = deviations_of(data);
    double with = -std::numeric_limits<double>::infinity(), without = with;
    const double longest = shorter_than_lines * static_cast<double>(data.position.size());
    for (const auto &kind : lattice_of(1.0, length_factor, longest, shares)) {
        with = std::max(with, evidence_of(runs, kind, true, false).log_likelihood());
        without = std::max(without, evidence_of(runs, kind, false, false).log_likelihood());
    }
    return 2.0 * (with - without);
}

}  // namespace compbox::fitting
