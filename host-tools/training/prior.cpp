// SPDX-License-Identifier: MIT
#include "host-tools/training/prior.h"

#include <algorithm>
#include <cmath>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/training/bank.h"

namespace compbox::training {

namespace {

constexpr const char *format_of_prior = "compbox-prior/1";
constexpr int first_rounds = 3, rounds = 30;  // of EM: to find strange brothers, and for the rest
constexpr int median_rounds = 100;            // of Weiszfeld's iteration
constexpr double most_distances = 4.0;        // median ones, of a brother that is used

// One brother and output: `precision` times the products, in units in which columns and output have
// a usual spread of 1.
struct evidence_of_brother {
    Eigen::MatrixXd xx;
    Eigen::VectorXd xt;
    double precision;
};

// The spread of weights while EM goes on, and the most probable weights of each brother.
struct weight_estimate {
    Eigen::VectorXd mean;
    Eigen::MatrixXd factor, weights;  // weights: a brother per row
};

// out: a factor of a symmetric matrix that is not negative
Eigen::MatrixXd factor_of(const Eigen::MatrixXd &square) {
    const auto eigen = algebra::eigen_of_symmetric(square);
    const double least = 1e-9 * eigen.values.maxCoeff();
    return eigen.vectors * eigen.values.cwiseMax(least).cwiseSqrt().asDiagonal();
}

// One round of EM: each brother's weights given the spread, then the spread given the weights and
// their doubts.
void next_estimate(weight_estimate &now, const std::vector<evidence_of_brother> &brothers) {
    const Eigen::Index columns = now.mean.size();
    const auto one = Eigen::MatrixXd::Identity(columns, columns);
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(columns, columns);
    now.weights.resize(static_cast<Eigen::Index>(brothers.size()), columns);
    for (std::size_t m = 0; m < brothers.size(); ++m) {
        const evidence_of_brother &of = brothers[m];
        const Eigen::MatrixXd seen = of.precision * now.factor.transpose() * of.xx * now.factor;
        const Eigen::MatrixXd doubt = now.factor *
                                      algebra::factor_positive_definite(seen + one).inverse *
                                      now.factor.transpose();
        now.weights.row(static_cast<Eigen::Index>(m)) =
            now.mean + of.precision * (doubt * (of.xt - of.xx * now.mean));
        square += doubt;
    }
    now.mean = now.weights.colwise().mean();
    const Eigen::MatrixXd off = now.weights.rowwise() - now.mean.transpose();
    square += off.transpose() * off;
    now.factor = factor_of(square / static_cast<double>(brothers.size()));
}

weight_estimate estimate(const std::vector<evidence_of_brother> &brothers, int count) {
    const Eigen::Index columns = brothers.front().xx.rows();
    weight_estimate now{
        Eigen::VectorXd::Zero(columns), Eigen::MatrixXd::Identity(columns, columns), {}};
    for (int round = 0; round < count; ++round) next_estimate(now, brothers);
    return now;
}

// in : products of the brothers' weights by a metric. out: the distance of each from their
// geometric median, which less than half of them cannot move far
Eigen::ArrayXd distances_from_median(const Eigen::MatrixXd &products) {
    const Eigen::Index count = products.rows();
    const double least = 1e-12 * products.trace() / static_cast<double>(count) + 1e-300;
    Eigen::VectorXd share = Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count));
    Eigen::ArrayXd distance;
    for (int round = 0; round < median_rounds; ++round) {
        const Eigen::VectorXd to_centre = products * share;
        distance = (products.diagonal() - 2.0 * to_centre).array() + share.dot(to_centre);
        distance = distance.max(least).sqrt();
        share = distance.inverse().matrix();
        share /= share.sum();
    }
    return distance;
}

// in : lags: columns of each input. out: what a difference of weights changes in the mean square:
// in
//      the states of the brothers, and while one input alone is off by its spread for long
Eigen::MatrixXd metric_of(const std::vector<evidence_of_brother> &brothers, Eigen::Index lags) {
    const Eigen::Index columns = brothers.front().xx.rows();
    Eigen::MatrixXd metric = Eigen::MatrixXd::Zero(columns, columns);
    for (const auto &of : brothers) metric += of.xx / static_cast<double>(brothers.size());
    for (Eigen::Index first = 0; first < columns; first += lags) {
        metric.block(first, first, lags, lags).array() +=
            static_cast<double>(lags) / static_cast<double>(columns);
    }
    return metric;
}

// out: whether each brother is near enough to the others
std::vector<bool> usable(const std::vector<evidence_of_brother> &brothers, Eigen::Index lags) {
    const Eigen::MatrixXd weights = estimate(brothers, first_rounds).weights;
    const Eigen::MatrixXd off = weights.rowwise() - weights.colwise().mean();
    const Eigen::ArrayXd distance =
        distances_from_median(off * metric_of(brothers, lags) * off.transpose());
    std::vector<double> sorted(distance.begin(), distance.end());
    std::sort(sorted.begin(), sorted.end());
    std::vector<bool> near;
    for (const double one : distance) {
        near.push_back(one <= most_distances * sorted[sorted.size() / 2]);
    }
    return near;
}

// Units of one output's problem: the root of the mean square over the brothers.
struct usual_units {
    Eigen::VectorXd x;
    double t;
};

usual_units units_of(const std::vector<bank_moments> &brothers, Eigen::Index output) {
    const double count = static_cast<double>(brothers.size());
    Eigen::VectorXd x = Eigen::VectorXd::Zero(brothers.front().xx.rows());
    double t = 0.0;
    for (const auto &of : brothers) x += of.xx.diagonal() / count, t += of.tt[output] / count;
    return {(x.array() > 0.0).select(x.array().sqrt(), 1.0).matrix(), std::sqrt(t)};
}

std::vector<evidence_of_brother> evidence_of(const std::vector<bank_moments> &brothers,
                                             Eigen::Index output, const usual_units &units) {
    const auto inverse = units.x.cwiseInverse();
    std::vector<evidence_of_brother> found;
    for (const auto &of : brothers) {
        found.push_back({inverse.asDiagonal() * of.xx * inverse.asDiagonal(),
                         inverse.asDiagonal() * of.xt.col(output) / units.t,
                         of.rows[output] / of.noise[output] * units.t * units.t});
    }
    return found;
}

// out: the prior of one space
bank_prior prior_of(const std::vector<bank_moments> &brothers) {
    bank_prior prior;
    prior.space = brothers.front().space;
    const auto lags = static_cast<Eigen::Index>(1 + prior.space.tau_s.size());
    for (std::size_t k = 0; k < prior.space.outputs.size(); ++k) {
        const auto output = static_cast<Eigen::Index>(k);
        const usual_units units = units_of(brothers, output);
        const auto all = evidence_of(brothers, output, units);
        const std::vector<bool> near = usable(all, lags);
        std::vector<evidence_of_brother> some;
        prior.strange.emplace_back();
        for (std::size_t m = 0; m < all.size(); ++m) {
            if (near[m]) some.push_back(all[m]);
            if (!near[m]) prior.strange.back().push_back(brothers[m].file);
        }
        const weight_estimate found = estimate(some, rounds);
        const Eigen::VectorXd to_units = units.t * units.x.cwiseInverse();
        prior.outputs.push_back(
            {to_units.asDiagonal() * found.mean, to_units.asDiagonal() * found.factor});
    }
    return prior;
}

// out: the moments without lags that are longer
bank_moments shortened(const bank_moments &moments, double longest_s) {
    const std::vector<double> &tau_s = moments.space.tau_s;
    const auto kept = std::upper_bound(tau_s.begin(), tau_s.end(), longest_s) - tau_s.begin();
    std::vector<Eigen::Index> columns;
    for (Eigen::Index c = 0; c < moments.xx.cols(); ++c) {
        if (c % static_cast<Eigen::Index>(1 + tau_s.size()) <= kept) columns.push_back(c);
    }
    bank_moments some = moments;
    some.space.tau_s.resize(static_cast<std::size_t>(kept));
    some.xx = moments.xx(columns, columns);
    some.xt = moments.xt(columns, Eigen::all);
    return some;
}

json json_of_space(const bank_prior &prior) {
    json one = json_of(prior.space);
    one["strange"] = prior.strange;
    for (const auto &output : prior.outputs) {
        one["mean"].push_back(lists_of(output.mean.transpose())[0]);
        one["factor"].push_back(lists_of(output.factor));
    }
    return one;
}

// out: the prior of one member of "spaces"; throws input_error for what is none
bank_prior read_space(const json &one, const std::string &path) {
    formats::only_keys(one, {"outputs", "bank", "strange", "mean", "factor"}, path, "spaces");
    bank_prior prior;
    prior.space = space_of(one, path);
    prior.strange = formats::get<std::vector<std::vector<std::string>>>(one, "strange", path);
    const Eigen::Index columns = prior.space.columns();
    const auto outputs = static_cast<Eigen::Index>(prior.space.outputs.size());
    const Eigen::MatrixXd means = matrix_of(one, "mean", outputs, columns, path);
    const json factors = formats::member_or_null(one, "factor");
    if (!factors.is_array() || factors.size() != prior.space.outputs.size() ||
        prior.strange.size() != factors.size()) {
        throw input_error(path, 0, 0, "has not a factor and strange brothers of each output");
    }
    for (Eigen::Index k = 0; k < outputs; ++k) {
        const json factor{{"factor", factors[static_cast<std::size_t>(k)]}};
        prior.outputs.push_back(
            {means.row(k).transpose(), matrix_of(factor, "factor", columns, columns, path)});
    }
    return prior;
}

}  // namespace

bank_priors priors_of(const std::vector<bank_moments> &brothers) {
    const bank_moments &first = brothers.front();
    for (const auto &of : brothers) {
        const std::string text = first.space.difference(of.space);
        if (!text.empty()) throw input_error(of.file, 0, 0, "and {} have {}", first.file, text);
    }
    bank_priors priors;
    priors.machines = brothers.size();
    priors.spaces = {prior_of(brothers)};
    const std::vector<double> &tau_s = first.space.tau_s;
    if (tau_s.empty() || tau_s.back() <= usual_longest_s) return priors;
    std::vector<bank_moments> shorter;
    for (const auto &of : brothers) shorter.push_back(shortened(of, usual_longest_s));
    priors.spaces.push_back(prior_of(shorter));
    return priors;
}

const bank_prior &prior_for(const bank_priors &priors, const std::vector<double> &tau_s) {
    constexpr double equal = 1.05;  // time constants are rounded to two digits
    const double longest_s = tau_s.empty() ? 0.0 : equal * tau_s.back();
    for (const bank_prior &prior : priors.spaces) {
        if (prior.space.tau_s.empty() || prior.space.tau_s.back() <= longest_s) return prior;
    }
    return priors.spaces.back();
}

json json_of(const bank_priors &priors) {
    json file{{"format", format_of_prior}, {"machines", priors.machines}};
    for (const bank_prior &prior : priors.spaces) file["spaces"].push_back(json_of_space(prior));
    return file;
}

bank_priors read_priors(const std::string &path) {
    const json file = formats::read_json(path);
    if (!file.is_object() || formats::member_or_null(file, "format") != format_of_prior) {
        throw input_error(path, 0, 0, "is no file of `compbox prior`");
    }
    formats::only_keys(file, {"format", "machines", "spaces"}, path, "");
    bank_priors priors;
    priors.file = path;
    priors.machines = formats::get<std::size_t>(file, "machines", path);
    const json spaces = formats::member_or_null(file, "spaces");
    if (!spaces.is_array() || spaces.empty() || spaces.size() > 2) {
        throw input_error(path, 0, 0, "has not one or two spaces");
    }
    for (const json &one : spaces) priors.spaces.push_back(read_space(one, path));
    return priors;
}

}  // namespace compbox::training
