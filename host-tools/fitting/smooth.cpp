// SPDX-License-Identifier: MIT
#include "host-tools/fitting/smooth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "host-tools/fitting/matern.h"

namespace compbox::fitting {

namespace {

// Degrees of freedom of a sigma column, beside the readings' own.
constexpr double freedom_of_given_sigma = 20.0;
// The usual noise of one reading of a laser or a probe on a good machine, um or urad, and the decay
// of the prior around it. Used only without repeats and without a sigma column (docs/fitting.md).
constexpr double usual_noise = 0.2, noise_doubt = 0.15;
// log of the prior odds of a curve without a slope (kind 0) against one with a slope: the guideways
// of a machine bend, they do not jitter.
constexpr double rough_kind = -2.0;
// Models whose likelihood is below the best one's by this power of e are left out.
// Part of the time, for the progress.
constexpr double part_of_weighing = 0.7;
constexpr double worth_a_look = 9.0, worth_a_share = 6.0;

// Lattice of models for one kind: length scales by factors of 1.6, and the "drive" ratio *
// length^-(2 kind + 1), which is the effect on a reading at a large length. Its steps change the
// curve's freedom equally for every kind.
struct lattice {
    int kind;
    double shortest, longest;  // length scale
    double drive_step;         // of log(drive)
    double length_step = std::log(1.6);

    matern model(int i, int j) const {
        const double length = shortest * std::exp(i * length_step);
        const double order = 2.0 * kind + 1.0;
        const double log_ratio = j * drive_step + order * std::log(length / longest);
        return {kind, length, std::exp(log_ratio)};
    }
    int length_count() const {
        return 1 + static_cast<int>(std::log(longest / shortest) / length_step);
    }
    // Signal from a hundredth of the noise to 30 000 times the noise (in standard deviations).
    std::pair<int, int> drive_range(int i) const {
        const double order = 2.0 * kind + 1.0;
        const double shift = order * (std::log(shortest / longest) + i * length_step);
        return {static_cast<int>(std::ceil((std::log(1e-4) - shift) / drive_step)),
                static_cast<int>(std::floor((std::log(1e9) - shift) / drive_step))};
    }
    // Weight of one node: its share of the prior, flat in log(length) and log(ratio).
    double log_cell() const { return std::log(length_step * drive_step); }
};

struct node {
    matern model;
    double log_weight;
};

// log of the prior of the noise: a peak at the usual noise with power-law flanks, so that clear
// readings override it.
double log_prior_of_noise(const process_points &points, double noise_variance) {
    if (points.prior_freedom > 0.0) return 0.0;
    const double apart = std::log(std::sqrt(noise_variance) / usual_noise) / noise_doubt;
    return 1.0 - std::sqrt(1.0 + apart * apart);
}

using explored = std::map<std::pair<int, int>, double>;

// Likelihoods with the prior of the noise, of one kind: first a coarse net, then the neighbours of
// every likely node.
explored explore(const process_points &points, const lattice &net) {
    explored known;
    double best = -std::numeric_limits<double>::infinity();
    std::vector<std::pair<int, int>> open;
    const auto visit = [&](int i, int j) {
        const auto [low, high] = net.drive_range(i);
        if (i < 0 || i >= net.length_count() || j < low || j > high) return;
        const auto [place, is_new] = known.try_emplace({i, j}, 0.0);
        if (!is_new) return;
        const matern_likelihood found = likelihood_of(points, net.model(i, j));
        place->second = found.log_likelihood + log_prior_of_noise(points, found.noise_variance);
        best = std::max(best, place->second);
        open.push_back({i, j});
    };
    for (int i = 0; i < net.length_count(); i += 3) {
        const auto [low, high] = net.drive_range(i);
        for (int j = low; j <= high; j += 3) visit(i, j);
    }
    while (!open.empty()) {
        const auto place = open.back();
        open.pop_back();
        if (known[place] < best - worth_a_look) continue;
        visit(place.first - 1, place.second);
        visit(place.first + 1, place.second);
        visit(place.first, place.second - 1);
        visit(place.first, place.second + 1);
    }
    return known;
}

double median_step(const std::vector<double> &x) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < x.size(); ++i) steps.push_back(x[i] - x[i - 1]);
    std::nth_element(steps.begin(), steps.begin() + static_cast<long>(steps.size() / 2),
                     steps.end());
    return steps[steps.size() / 2];
}

// The relevant models, with weights that sum to one.
std::vector<node> weigh_models(const process_points &points, double shortest, double longest,
                               const std::function<void(double)> &progress) {
    std::vector<node> nodes;
    double best = -std::numeric_limits<double>::infinity();
    for (int kind = 0; kind < matern_kinds; ++kind) {
        if (progress) progress(part_of_weighing * kind / matern_kinds);
        const lattice net{kind, shortest, longest, 0.6 * (kind + 1.0)};
        const double log_share = net.log_cell() + (kind == 0 ? rough_kind : 0.0);
        for (const auto &[place, log_likelihood] : explore(points, net)) {
            const double log_weight = log_likelihood + log_share;
            nodes.push_back({net.model(place.first, place.second), log_weight});
            best = std::max(best, log_weight);
        }
    }
    nodes.erase(std::remove_if(nodes.begin(), nodes.end(),
                               [&](const node &n) { return n.log_weight < best - worth_a_share; }),
                nodes.end());
    double sum = 0.0;
    for (const auto &one : nodes) sum += std::exp(one.log_weight - best);
    for (auto &one : nodes) one.log_weight -= best + std::log(sum);
    return nodes;
}

process_points measured_points(const measurement &data) {
    process_points points;
    points.x = data.position;
    points.y = data.mean;
    points.variance = data.variance;
    points.measured = data.position.size();
    const double own = data.repeat_freedom, given = data.sigma_given ? freedom_of_given_sigma : 0.0;
    points.prior_freedom = own + given;
    if (points.prior_freedom > 0.0) {
        points.prior_variance = (own * data.repeat_variance + given) / points.prior_freedom;
    }
    return points;
}

// The same points with unmeasured ones between them.
process_points with_points_between(const process_points &points, int between,
                                   std::vector<std::size_t> &measured) {
    process_points dense = points;
    dense.x.clear();
    dense.y.clear();
    dense.variance.clear();
    for (std::size_t i = 0; i < points.x.size(); ++i) {
        measured.push_back(dense.x.size());
        dense.x.push_back(points.x[i]);
        dense.y.push_back(points.y[i]);
        dense.variance.push_back(points.variance[i]);
        for (int k = 1; i + 1 < points.x.size() && k <= between; ++k) {
            dense.x.push_back(points.x[i] + (points.x[i + 1] - points.x[i]) * k / (between + 1.0));
            dense.y.push_back(0.0);
            dense.variance.push_back(0.0);
        }
    }
    return dense;
}

// Means, variances (within and between models) and leave-one-out residuals of the mixture.
void add_share(smooth_curve &sum, const matern_curve &one, const process_points &points,
               double share) {
    const double noise_variance = one.likelihood.noise_variance;
    sum.noise += share * noise_variance;
    for (std::size_t i = 0; i < points.x.size(); ++i) {
        sum.mean[i] += share * one.mean[i];
        sum.sigma[i] += share * (one.variance[i] + one.mean[i] * one.mean[i]);
    }
    for (std::size_t k = 0; k < sum.measured.size(); ++k) {
        const std::size_t i = sum.measured[k];
        const double leverage =
            std::min(one.variance[i] / (noise_variance * points.variance[i]), 1.0 - 1e-9);
        sum.effective_coefficients += share * leverage;
        sum.left_out[k] += share * (points.y[i] - one.mean[i]) / (1.0 - leverage);
        sum.left_out_variance[k] += share * noise_variance * points.variance[i] / (1.0 - leverage);
    }
}

}  // namespace

smooth_curve smooth(const measurement &data, int between,
                    const std::function<void(double)> &progress) {
    const process_points points = measured_points(data);
    const double range = data.to() - data.from();
    const double shortest = median_step(data.position);
    const auto nodes = weigh_models(points, shortest, 4.0 * range, progress);
    smooth_curve curve;
    const process_points dense = with_points_between(points, between, curve.measured);
    curve.x = dense.x;
    curve.mean.assign(dense.x.size(), 0.0);
    curve.sigma.assign(dense.x.size(), 0.0);
    curve.left_out.assign(curve.measured.size(), 0.0);
    curve.left_out_variance.assign(curve.measured.size(), 0.0);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        add_share(curve, regress(dense, nodes[k].model), dense, std::exp(nodes[k].log_weight));
        const double done = static_cast<double>(k + 1) / static_cast<double>(nodes.size());
        if (progress) progress(part_of_weighing + (1.0 - part_of_weighing) * done);
    }
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
        curve.sigma[i] = std::sqrt(std::max(curve.sigma[i] - curve.mean[i] * curve.mean[i], 0.0));
    }
    curve.noise = std::sqrt(curve.noise);
    curve.noise_measured = points.prior_freedom > 0.0;
    double squares = 0.0;
    for (const double r : curve.left_out) squares += r * r;
    curve.left_out_rms = std::sqrt(squares / static_cast<double>(curve.left_out.size()));
    return curve;
}

}  // namespace compbox::fitting
