// SPDX-License-Identifier: MIT
#include "host-tools/metrology/straightness.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace compbox::metrology {

namespace {

// Indices of the hull's lower (sign 1) or upper (sign -1) chain, from left to right.
std::vector<std::size_t> hull_chain(const std::vector<double> &x, const std::vector<double> &y,
                                    double sign) {
    std::vector<std::size_t> chain;
    for (std::size_t i = 0; i < x.size(); ++i) {
        while (chain.size() >= 2) {
            const std::size_t a = chain[chain.size() - 2], b = chain.back();
            const double turn = (x[b] - x[a]) * (y[i] - y[a]) - (y[b] - y[a]) * (x[i] - x[a]);
            if (sign * turn > 0.0) break;
            chain.pop_back();
        }
        chain.push_back(i);
    }
    return chain;
}

struct zone {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
};

zone zone_about(double slope, const std::vector<double> &x, const std::vector<double> &y) {
    zone result;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double rest = y[i] - slope * x[i];
        result.low = std::min(result.low, rest);
        result.high = std::max(result.high, rest);
    }
    return result;
}

}  // namespace

straight_line end_point_line(const std::vector<double> &x, const std::vector<double> &y) {
    const double slope = (y.back() - y.front()) / (x.back() - x.front());
    return {y.front() - slope * x.front(), slope};
}

straight_line least_squares_line(const std::vector<double> &x, const std::vector<double> &y) {
    const double n = static_cast<double>(x.size());
    double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        mean_x += x[i] / n;
        mean_y += y[i] / n;
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += (x[i] - mean_x) * (x[i] - mean_x);
        xy += (x[i] - mean_x) * (y[i] - mean_y);
    }
    const double slope = xy / xx;
    return {mean_y - slope * mean_x, slope};
}

// The zone's width is a convex, piecewise linear function of the slope. It bends only at the slopes
// of the hull's edges, so its minimum is at one of them.
straight_line minimum_zone_line(const std::vector<double> &x, const std::vector<double> &y) {
    double best_width = std::numeric_limits<double>::infinity();
    straight_line best;
    for (const double sign : {1.0, -1.0}) {
        const auto chain = hull_chain(x, y, sign);
        for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
            const std::size_t a = chain[k], b = chain[k + 1];
            const double slope = (y[b] - y[a]) / (x[b] - x[a]);
            const zone about = zone_about(slope, x, y);
            if (about.high - about.low >= best_width) continue;
            best_width = about.high - about.low;
            best = {0.5 * (about.low + about.high), slope};
        }
    }
    return best;
}

double deviation_about(const straight_line &line, const std::vector<double> &x,
                       const std::vector<double> &y) {
    const zone about = zone_about(line.slope, x, y);
    return about.high - about.low;
}

}  // namespace compbox::metrology
