// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/curve_range.h"

#include <algorithm>

#include "host-tools/formats/json.h"

namespace compbox::coefficients {

travel_range range_of_curve(const json &term) {
    const auto number = [](const json &value) {
        return value.is_number() ? value.get<double>() : 0.0;
    };
    if (term.contains("from") && term.contains("to")) {
        return {number(term["from"]), number(term["to"])};
    }
    const bool spline = term.contains("knots");
    const json points = term.value(spline ? "knots" : "positions", json::array());
    const json degree = term.value("degree", json(0));
    const std::size_t end = spline && degree.is_number_unsigned() ? degree.get<std::size_t>() : 0;
    if (!points.is_array() || points.empty() || end > (points.size() - 1) / 2) return {0.0, 0.0};
    return {number(points[end]), number(points[points.size() - 1 - end])};
}

std::optional<travel_range> range_of_curves(const json &terms, const std::string &signal) {
    std::optional<travel_range> range;
    for (const auto &term : terms) {
        if (term.value("signal", json()) != signal) continue;
        const travel_range one = range_of_curve(term);
        if (!(one.from_mm < one.to_mm)) continue;
        if (!range) range = one;
        range->from_mm = std::min(range->from_mm, one.from_mm);
        range->to_mm = std::max(range->to_mm, one.to_mm);
    }
    return range;
}

}  // namespace compbox::coefficients
