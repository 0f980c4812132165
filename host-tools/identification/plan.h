// SPDX-License-Identifier: MIT
// S2's choice of measuring points: every triple of a grid, in closed form, by the model that
// identify will solve.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/identification/points.h"

namespace compbox::identification {

// Nodes of a box in the axis' own frame: counts[k] equidistant values from low[k] to high[k].
struct grid {
    point_mm low_mm{}, high_mm{};
    std::array<int, 3> counts{};
    std::vector<point_mm> nodes() const;  // x slowest, z fastest
};

// sigma_k: root mean square over the positions, of separate set-ups with their offsets and slopes
// (sigma_over_positions).
enum class criterion {
    mean_cv,  // mean of sigma_k / |preset_k| (S2)
    a,        // mean of its square: trace of cov(e / preset)
    d,        // volume of the confidence ellipsoid of all positions' errors
};

struct plan_options {
    line_model model;
    double along_um = 1.0, across_um = 1.0;  // sigma of a reading along the axis and across it
    criterion rank_by = criterion::mean_cv;
    six preset{1, 1, 1, 1, 1, 1};  // µm and µrad, none zero: the expected size of the errors
    std::size_t best = 10;
    unsigned threads = 2;
    std::function<void(double)> progress;  // 0 … 1, from one thread; may be empty
};

struct ranked_triple {
    points_mm points = {};
    double merit = 0.0;  // smaller is better
    std::array<std::uint32_t, 3> node{};
};

struct plan_result {
    std::vector<ranked_triple> best;  // ascending merit; equal merits in order of their nodes
    std::uint64_t triples = 0;        // number examined
    std::uint64_t degenerate = 0;     // rejected: they have an obstacle()
};

// Examines every triple of the nodes. Deterministic for any number of threads. nodes.size() >= 3
// and <= 65 535.
plan_result plan_points(const std::vector<point_mm> &nodes, const plan_options &options);

// Orders three points so that the traditional sequence of the model's axis is solvable and as exact
// as possible; false if no order is. Its sigma goes to `sigma`.
bool order_for_traditional(points_mm &points, const plan_options &options, six &sigma);

// Sigma of the points by the options' model and readings: of the improved method.
six planned_sigma(const points_mm &points, const plan_options &options);

// Three points in words: "the two ends of the longest edge, the third in the middle of the opposite
// edge".
std::string describe(const points_mm &points, const grid &box);

}  // namespace compbox::identification
