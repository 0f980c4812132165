// SPDX-License-Identifier: MIT
// S2's choice of measuring points: every triple of a grid, in closed form.
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

enum class criterion {
    mean_cv,  // mean of sigma_k / |preset_k| (S2)
    a,        // trace of cov(e / preset): mean square instead of the mean
    d,        // determinant of cov(e): volume of the confidence ellipsoid
};

struct plan_options {
    criterion rank_by = criterion::mean_cv;
    six preset{1, 1, 1, 1, 1, 1};  // µm and µrad, none zero: the expected size of the errors
    std::size_t best = 10;
    unsigned threads = 2;
    std::function<void(double)> progress;  // 0 … 1, from one thread; may be empty
};

struct ranked_triple {
    triple_mm points{};
    double merit = 0.0;  // smaller is better; sigma = 1 µm
    std::array<std::uint32_t, 3> node{};
};

struct plan_result {
    std::vector<ranked_triple> best;  // ascending merit; equal merits in order of their nodes
    std::uint64_t triples = 0;        // number examined
    std::uint64_t degenerate = 0;     // rejected: on a line
};

// Examines every triple of the nodes. Deterministic for any number of threads. nodes.size() >= 3
// and <= 65 535.
plan_result plan_points(const std::vector<point_mm> &nodes, const plan_options &options);

// Orders the three points so that the traditional sequence of `axis` is solvable and as exact as
// possible; false if no order is.
bool order_for_traditional(triple_mm &points, int axis);

// In words: "the two ends of the longest edge, the third in the middle of the opposite edge".
std::string describe(const triple_mm &points, const grid &box);

}  // namespace compbox::identification
