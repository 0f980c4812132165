// SPDX-License-Identifier: MIT
// A triple of points in a metrologist's words.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/identification/plan.h"

namespace compbox::identification {

namespace {

constexpr const char *axis_names[3] = {"X", "Y", "Z"};

double distance(const point_mm &a, const point_mm &b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Index of the box's longest edge.
std::size_t longest_edge(const grid &box) {
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 3; ++k) {
        if (box.high_mm[k] - box.low_mm[k] > box.high_mm[longest] - box.low_mm[longest])
            longest = k;
    }
    return longest;
}

bool at_end(double value, double low, double high) {
    return std::min(std::fabs(value - low), std::fabs(value - high)) < 1e-9 * (high - low + 1.0);
}

// Place of the third point along the longest edge.
std::string place_along(double value, double low, double high) {
    if (at_end(value, low, high)) return "at an end";
    const double part = (value - low) / (high - low);
    if (std::fabs(part - 0.5) < 0.1) return "in the middle";
    return fmt::format("at {} %", static_cast<int>(std::lround(100 * part)));
}

// Place of a point in the box: "X low, Y high, Z 75 %".
std::string place_in(const point_mm &point, const grid &box) {
    std::string text;
    for (std::size_t k = 0; k < 3; ++k) {
        const double low = box.low_mm[k], high = box.high_mm[k];
        text += std::string(k > 0 ? ", " : "") + axis_names[k];
        if (high > low && at_end(point[k], low, high)) {
            text += point[k] > 0.5 * (low + high) ? " high" : " low";
        } else if (high > low) {
            const double part = (point[k] - low) / (high - low);
            text += fmt::format(" {} %", static_cast<int>(std::lround(100 * part)));
        } else {
            text += " fixed";
        }
    }
    return text;
}

bool on_longest_edge(const point_mm &a, const point_mm &b, const grid &box, std::size_t along) {
    for (std::size_t k = 0; k < 3; ++k) {
        const bool ends = at_end(a[k], box.low_mm[k], box.high_mm[k]) &&
                          at_end(b[k], box.low_mm[k], box.high_mm[k]);
        if (!ends || (a[k] == b[k]) == (k == along)) return false;
    }
    return true;
}

}  // namespace

std::string describe(const points_mm &points, const grid &box) {
    const std::size_t along = longest_edge(box);
    for (std::size_t third = 0; third < 3; ++third) {
        const point_mm &a = points[(third + 1) % 3], &b = points[(third + 2) % 3];
        const point_mm &c = points[third];
        if (!on_longest_edge(a, b, box, along)) continue;
        bool opposite = true;
        for (std::size_t k = 0; k < 3; ++k) {
            opposite &= k == along || (at_end(c[k], box.low_mm[k], box.high_mm[k]) && c[k] != a[k]);
        }
        return std::string("two points at the ends of a longest edge (along ") + axis_names[along] +
               "), the third " + place_along(c[along], box.low_mm[along], box.high_mm[along]) +
               (opposite ? " of the opposite edge" : " of the edge's length, beside it");
    }
    const double sides[3] = {distance(points[0], points[1]), distance(points[1], points[2]),
                             distance(points[2], points[0])};
    return fmt::format("a triangle with sides of {}, {} and {} mm: P1 {}; P2 {}; P3 {}",
                       static_cast<long>(std::lround(sides[0])),
                       static_cast<long>(std::lround(sides[1])),
                       static_cast<long>(std::lround(sides[2])), place_in(points[0], box),
                       place_in(points[1], box), place_in(points[2], box));
}

}  // namespace compbox::identification
