// SPDX-License-Identifier: MIT
#include "host-tools/regression/clusters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "host-tools/algebra/solvers.h"

namespace compbox::regression {

namespace {

constexpr int most_passes = 500;
constexpr double settled = 1e-9;

// Points whose scalar products are the similarity: a sensor in each row.
Eigen::MatrixXd points_of(const Eigen::MatrixXd &similarity) {
    const algebra::symmetric_eigen eigen = algebra::eigen_of_symmetric(similarity);
    return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// The most central sensor first, then repeatedly the one furthest from all centres so far.
Eigen::MatrixXd far_centres(const Eigen::MatrixXd &points, std::size_t count) {
    std::vector<Eigen::Index> chosen;
    Eigen::Index next = 0;
    (points.rowwise() - points.colwise().mean()).rowwise().squaredNorm().minCoeff(&next);
    Eigen::VectorXd nearest = Eigen::VectorXd::Constant(points.rows(), 1e300);
    while (chosen.size() < count) {
        chosen.push_back(next);
        nearest = nearest.cwiseMin((points.rowwise() - points.row(next)).rowwise().squaredNorm());
        nearest.maxCoeff(&next);
    }
    return points(chosen, Eigen::all);
}

Eigen::MatrixXd square_distances(const Eigen::MatrixXd &points, const Eigen::MatrixXd &centres) {
    Eigen::MatrixXd squares(points.rows(), centres.rows());
    for (Eigen::Index c = 0; c < centres.rows(); ++c) {
        squares.col(c) = (points.rowwise() - centres.row(c)).rowwise().squaredNorm();
    }
    return squares;
}

// Numbers clusters in order of their first sensor, and reorders the columns of membership.
clustering numbered(const std::vector<std::size_t> &raw) {
    clustering result;
    std::map<std::size_t, std::size_t> numbers;
    for (const std::size_t one : raw) {
        const auto [place, is_new] = numbers.insert({one, numbers.size()});
        (void)is_new;
        result.cluster.push_back(place->second);
    }
    result.count = numbers.size();
    return result;
}

// in : count of clusters, 1 … rows of points
// out: Bezdek's fuzzy c-means; each sensor in the cluster of its largest membership
clustering c_means(const Eigen::MatrixXd &points, std::size_t count) {
    Eigen::MatrixXd centres = far_centres(points, count), membership;
    for (int round = 0; round < most_passes; ++round) {
        // m = 2: memberships are proportional to 1 / distance^2
        const Eigen::ArrayXXd near = 1.0 / square_distances(points, centres).array().max(1e-12);
        membership = (near.colwise() / near.rowwise().sum()).matrix();
        const Eigen::MatrixXd weight = membership.array().square();
        const Eigen::MatrixXd next =
            weight.colwise().sum().cwiseInverse().asDiagonal() * (weight.transpose() * points);
        const double moved = (next - centres).cwiseAbs().maxCoeff();
        centres = next;
        if (moved < settled) break;
    }
    std::vector<std::size_t> raw;
    for (Eigen::Index s = 0; s < points.rows(); ++s) {
        Eigen::Index best = 0;
        membership.row(s).maxCoeff(&best);
        raw.push_back(static_cast<std::size_t>(best));
    }
    clustering result = numbered(raw);
    result.membership = membership;
    // Xie-Beni: compactness over separation
    double separation = std::numeric_limits<double>::infinity();
    for (Eigen::Index a = 0; a < centres.rows(); ++a) {
        for (Eigen::Index b = 0; b < a; ++b) {
            separation = std::min(separation, (centres.row(a) - centres.row(b)).squaredNorm());
        }
    }
    const double spread =
        (membership.array().square() * square_distances(points, centres).array()).sum();
    result.validity = spread / (static_cast<double>(points.rows()) * std::max(separation, 1e-12));
    return result;
}

// R after R o R o … (max-min) no longer changes.
Eigen::MatrixXd closure_of(Eigen::MatrixXd r) {
    const Eigen::Index n = r.rows();
    for (Eigen::Index via = 0; via < n; ++via) {
        for (Eigen::Index a = 0; a < n; ++a) {
            for (Eigen::Index b = 0; b < n; ++b) {
                r(a, b) = std::max(r(a, b), std::min(r(a, via), r(via, b)));
            }
        }
    }
    return r;
}

clustering cut(const Eigen::MatrixXd &closure, double level) {
    std::vector<std::size_t> raw;
    for (Eigen::Index a = 0; a < closure.rows(); ++a) {
        Eigen::Index first = 0;
        while (first < a && closure(a, first) < level) ++first;
        raw.push_back(static_cast<std::size_t>(first));
    }
    return numbered(raw);
}

// Spread between the classes over spread within, each by its degrees of freedom.
double f_statistic(const Eigen::MatrixXd &points, const clustering &classes) {
    const auto n = static_cast<double>(points.rows()), c = static_cast<double>(classes.count);
    const Eigen::RowVectorXd mean = points.colwise().mean();
    double between = 0.0, within = 0.0;
    for (std::size_t k = 0; k < classes.count; ++k) {
        std::vector<Eigen::Index> members;
        for (std::size_t s = 0; s < classes.cluster.size(); ++s) {
            if (classes.cluster[s] == k) members.push_back(static_cast<Eigen::Index>(s));
        }
        const Eigen::MatrixXd some = points(members, Eigen::all);
        const Eigen::RowVectorXd centre = some.colwise().mean();
        between += static_cast<double>(members.size()) * (centre - mean).squaredNorm();
        within += (some.rowwise() - centre).squaredNorm();
    }
    return between / (c - 1.0) / std::max(within / (n - c), 1e-12);
}

}  // namespace

Eigen::MatrixXd similarity_of(const Eigen::MatrixXd &sensors) {
    const Eigen::MatrixXd centred = sensors.rowwise() - sensors.colwise().mean();
    const Eigen::VectorXd scale = centred.colwise().norm().cwiseInverse();
    Eigen::MatrixXd similarity =
        (scale.asDiagonal() * (centred.transpose() * centred) * scale.asDiagonal())
            .cwiseAbs()
            .cwiseMin(1.0);
    similarity.diagonal().setOnes();
    return similarity;
}

clustering fuzzy_c_means(const Eigen::MatrixXd &similarity, std::size_t count) {
    const Eigen::MatrixXd points = points_of(similarity);
    const auto sensors = static_cast<std::size_t>(similarity.rows());
    if (count > 0 || sensors < 4) return c_means(points, count > 0 ? count : sensors);
    clustering best;
    best.validity = std::numeric_limits<double>::infinity();
    const auto root = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(sensors))));
    // The index falls towards zero as the count nears the number of sensors, hence the limit at the
    // root.
    for (std::size_t c = 2; c <= std::min(root, sensors - 2); ++c) {
        clustering one = c_means(points, c);
        if (one.validity < best.validity) best = std::move(one);
    }
    return best;
}

clustering transitive_closure(const Eigen::MatrixXd &similarity, std::size_t count) {
    const Eigen::MatrixXd closure = closure_of(similarity), points = points_of(similarity);
    const auto sensors = static_cast<std::size_t>(similarity.rows());
    std::vector<double> levels(closure.data(), closure.data() + closure.size());
    std::sort(levels.begin(), levels.end());
    levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
    clustering best;
    for (const double level : levels) {  // from few classes to many
        clustering one = cut(closure, level);
        if (count > 0) {
            best = std::move(one);
            best.validity = level;
            if (best.count >= count) break;
        } else if (one.count > 1 && one.count < sensors) {
            one.validity = f_statistic(points, one);
            if (best.count == 0 || one.validity > best.validity) best = std::move(one);
        } else if (best.count == 0 && one.count == sensors) {
            best = std::move(one);
        }
    }
    return best;
}

}  // namespace compbox::regression
