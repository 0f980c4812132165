// SPDX-License-Identifier: MIT
#include "host-tools/fitting/smooth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "host-tools/fitting/cells.h"
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
// Part of the time, for the progress.
constexpr double part_of_weighing = 0.7;
// Models whose likelihood is below the best one's by this power of e are left out.
constexpr double worth_a_look = 9.0, worth_a_share = 6.0;
// The same for kinds of noise, by the repeats alone, and the largest number of them.
constexpr double worth_a_try = 4.0;
constexpr std::size_t most_kinds_of_noise = 24;
// Slow noise of a single run shows in this number of cells.
constexpr std::size_t most_for_slow_noise = 200;

// Lattice of models for one kind: length scales by factors of 1.6, and the "drive" ratio *
// length^-(2 kind + 1), which is the effect on a reading at a large length. Its steps change the
// curve's freedom equally for every kind.
struct lattice {
    noise_kind noise;
    int kind;
    double shortest, longest;  // length scale
    double drive_step;         // of log(drive)
    double length_step = std::log(1.6);

    matern model(int i, int j) const {
        const double length = shortest * std::exp(i * length_step);
        const double order = 2.0 * kind + 1.0;
        const double log_ratio = j * drive_step + order * std::log(length / longest);
        return {kind, length, std::exp(log_ratio), noise};
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
    const noise_evidence *noise;
};

// log of the prior of the noise: a peak at the usual noise with power-law flanks, so that clear
// readings override it. Correlated noise may have any size.
double log_prior_of_noise(const process_points &points, const matern &model,
                          double noise_variance) {
    if (points.prior_freedom > 0.0) return 0.0;
    noise_variance *= 1.0 - model.noise.share;
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
        const matern model = net.model(i, j);
        const matern_likelihood found = likelihood_of(points, model);
        place->second =
            found.log_likelihood + log_prior_of_noise(points, model, found.noise_variance);
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

// Adds the models of every smoothness with one kind of noise.
void add_models(const process_points &points, const noise_evidence &noise, double shortest,
                double longest, std::vector<node> &nodes) {
    for (int kind = 0; kind < matern_kinds; ++kind) {
        const lattice net{noise.kind, kind, shortest, longest, 0.6 * (kind + 1.0)};
        const double log_share = net.log_cell() + (kind == 0 ? rough_kind : 0.0) + noise.log_prior -
                                 0.5 * noise.log_determinant;
        for (const auto &[place, log_likelihood] : explore(points, net)) {
            nodes.push_back(
                {net.model(place.first, place.second), log_likelihood + log_share, &noise});
        }
    }
}

// Leaves the relevant models, with weights that sum to one.
void normalise(std::vector<node> &nodes) {
    double best = -std::numeric_limits<double>::infinity(), sum = 0.0;
    for (const auto &one : nodes) best = std::max(best, one.log_weight);
    nodes.erase(std::remove_if(nodes.begin(), nodes.end(),
                               [&](const node &n) { return n.log_weight < best - worth_a_share; }),
                nodes.end());
    for (const auto &one : nodes) sum += std::exp(one.log_weight - best);
    for (auto &one : nodes) one.log_weight -= best + std::log(sum);
}

// The kinds of noise that the repeats permit, the likeliest first.
std::vector<noise_evidence> likely_noise(const measurement &data) {
    auto all = noise_of_runs(data);
    const auto likelihood = [](const noise_evidence &one) {
        return one.log_likelihood() + one.log_prior;
    };
    std::stable_sort(all.begin(), all.end(), [&](const noise_evidence &a, const noise_evidence &b) {
        return likelihood(a) > likelihood(b);
    });
    const double best = likelihood(all.front());
    std::size_t kept = 0;
    while (kept < std::min(all.size(), most_kinds_of_noise) &&
           likelihood(all[kept]) >= best - worth_a_try) {
        ++kept;
    }
    all.resize(kept);
    return all;
}

process_points measured_points(const measurement &data) {
    process_points points;
    points.x = data.position;
    points.y = data.mean;
    points.variance = data.variance;
    points.measured = data.position.size();
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        points.step.push_back(static_cast<double>(i));
        points.drift.push_back(std::sqrt(data.variance[i]));
    }
    return points;
}

// Sets what the repeats and a sigma column say about the size of the noise.
void set_prior(process_points &points, const measurement &data, const noise_evidence &noise) {
    const bool repeats = noise.freedom > 0.0;
    const double own = repeats ? noise.freedom : data.repeat_freedom;
    const double given = data.sigma_given ? freedom_of_given_sigma : 0.0;
    const double square = repeats ? noise.mean_square : data.repeat_variance;
    points.prior_freedom = own + given;
    points.prior_variance = own + given > 0.0 ? (own * square + given) / (own + given) : 0.0;
}

// The same points with unmeasured ones between them.
process_points with_points_between(const process_points &points, int between,
                                   std::vector<std::size_t> &measured) {
    process_points dense = points;
    dense.x.clear();
    dense.y.clear();
    dense.variance.clear();
    dense.step.clear();
    dense.drift.clear();
    for (std::size_t i = 0; i < points.x.size(); ++i) {
        measured.push_back(dense.x.size());
        dense.x.push_back(points.x[i]);
        dense.y.push_back(points.y[i]);
        dense.variance.push_back(points.variance[i]);
        dense.step.push_back(points.step[i]);
        dense.drift.push_back(points.drift[i]);
        for (int k = 1; i + 1 < points.x.size() && k <= between; ++k) {
            const double part = k / (between + 1.0);
            dense.x.push_back(points.x[i] + (points.x[i + 1] - points.x[i]) * part);
            dense.y.push_back(0.0);
            dense.variance.push_back(0.0);
            dense.step.push_back(points.step[i] + part);
            dense.drift.push_back(points.drift[i] + (points.drift[i + 1] - points.drift[i]) * part);
        }
    }
    return dense;
}

// Means, variances (within and between models) and leave-one-out residuals of the mixture.
void add_share(smooth_curve &sum, const matern_curve &one, const process_points &points,
               const node &model) {
    const double share = std::exp(model.log_weight);
    const double noise_variance = one.likelihood.noise_variance;
    sum.noise += share * noise_variance;
    sum.noise_correlation += share * model.model.noise.neighbours();
    if (model.model.noise.white()) sum.white += share;
    for (std::size_t i = 0; i < points.x.size(); ++i) {
        sum.mean[i] += share * one.mean[i];
        sum.sigma[i] += share * (one.variance[i] + one.mean[i] * one.mean[i]);
    }
    for (std::size_t k = 0; k < sum.measured.size(); ++k) {
        const std::size_t i = sum.measured[k];
        const double white = noise_variance * points.variance[i] * (1.0 - model.model.noise.share);
        const double leverage = std::min(one.reading_variance[i] / white, 1.0 - 1e-9);
        sum.effective_coefficients += share * one.covariance[i] / white;
        sum.left_out[k] += share * (points.y[i] - one.reading_mean[i]) / (1.0 - leverage);
        sum.left_out_variance[k] += share * white / (1.0 - leverage);
    }
}

smooth_curve empty_curve(const process_points &dense, const std::vector<std::size_t> &measured) {
    smooth_curve curve;
    curve.measured = measured;
    curve.x = dense.x;
    curve.mean.assign(dense.x.size(), 0.0);
    curve.sigma.assign(dense.x.size(), 0.0);
    curve.more_sigma.assign(dense.x.size(), 0.0);
    curve.left_out.assign(curve.measured.size(), 0.0);
    curve.left_out_variance.assign(curve.measured.size(), 0.0);
    return curve;
}

// Standard deviations from the second moments.
void finish(smooth_curve &curve) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
        curve.sigma[i] = std::sqrt(std::max(curve.sigma[i] - curve.mean[i] * curve.mean[i], 0.0));
    }
    curve.noise = std::sqrt(curve.noise);
    double squares = 0.0;
    for (const double r : curve.left_out) squares += r * r;
    curve.left_out_rms = std::sqrt(squares / static_cast<double>(curve.left_out.size()));
}

// The mixture of all models with these kinds of noise.
smooth_curve mixture(const measurement &data, const std::vector<noise_evidence> &noises,
                     int between, const std::function<void(double)> &progress) {
    process_points points = measured_points(data);
    const auto report = [&](double from, double to, std::size_t done, std::size_t all) {
        const double part = static_cast<double>(done) / static_cast<double>(all);
        if (progress) progress(from + (to - from) * part);
    };
    std::vector<node> nodes;
    for (std::size_t k = 0; k < noises.size(); ++k) {
        set_prior(points, data, noises[k]);
        add_models(points, noises[k], median_step(data.position), 4.0 * (data.to() - data.from()),
                   nodes);
        report(0.0, part_of_weighing, k + 1, noises.size());
    }
    normalise(nodes);
    std::vector<std::size_t> measured;
    process_points dense = with_points_between(points, between, measured);
    smooth_curve curve = empty_curve(dense, measured);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        set_prior(dense, data, *nodes[k].noise);
        add_share(curve, regress(dense, nodes[k].model), dense, nodes[k]);
        report(part_of_weighing, 1.0, k + 1, nodes.size());
    }
    curve.noise_measured = dense.prior_freedom > 0.0;
    finish(curve);
    return curve;
}

// The straight line between the neighbours of x; x inside.
double between_points(const std::vector<double> &xs, const std::vector<double> &ys, double x) {
    const auto above = std::upper_bound(xs.begin() + 1, xs.end() - 1, x);
    const auto i = static_cast<std::size_t>(above - xs.begin());
    const double part = std::clamp((x - xs[i - 1]) / (xs[i] - xs[i - 1]), 0.0, 1.0);
    return ys[i - 1] + (ys[i] - ys[i - 1]) * part;
}

// What one run cannot show: how far the truth may be from this estimate if slow waves are noise.
void add_slow_noise(smooth_curve &curve, const measurement &data) {
    const measurement few = in_cells(data, most_for_slow_noise);
    const smooth_curve wide = mixture(few, possible_noise(few), 0, {});
    std::vector<double> more;
    for (std::size_t i = 0; i < wide.x.size(); ++i) {
        const double apart = wide.mean[i] - between_points(curve.x, curve.mean, wide.x[i]);
        const double own = between_points(curve.x, curve.sigma, wide.x[i]);
        const double all = wide.sigma[i] * wide.sigma[i] + apart * apart;
        more.push_back(std::sqrt(std::max(all - own * own, 0.0)));
    }
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
        curve.more_sigma[i] = between_points(wide.x, more, curve.x[i]);
    }
}

// With repeats: how much wider the band is than for independent readings.
double widening_of(const smooth_curve &curve, const measurement &data) {
    constexpr double worth_comparing = 0.1;
    if (curve.noise_correlation < worth_comparing) return 1.0;
    const smooth_curve white = mixture(data, {noise_of_runs(data).front()}, 0, {});
    double squares = 0.0, of_white = 0.0;
    for (std::size_t k = 0; k < curve.measured.size(); ++k) {
        squares += curve.sigma[curve.measured[k]] * curve.sigma[curve.measured[k]];
        of_white += white.sigma[k] * white.sigma[k];
    }
    return of_white > 0.0 ? std::sqrt(squares / of_white) : 1.0;
}

}  // namespace

smooth_curve smooth(const measurement &data, int between,
                    const std::function<void(double)> &progress) {
    const auto noises = likely_noise(data);
    smooth_curve curve = mixture(data, noises, between, progress);
    if (noises.front().freedom < 3.0) add_slow_noise(curve, data);
    curve.widened = widening_of(curve, data);
    const auto &line = data.line_variance;
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
        const double d = curve.x[i] - data.centre();
        const double shared = std::sqrt(std::max(line[0] + (line[1] + line[2] * d) * d, 0.0));
        curve.more_sigma[i] = std::hypot(curve.more_sigma[i], shared);
    }
    return curve;
}

}  // namespace compbox::fitting
