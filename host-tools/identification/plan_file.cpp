// SPDX-License-Identifier: MIT
#include "host-tools/identification/plan_file.h"

#include <cmath>

#include "host-tools/formats/json.h"

namespace compbox::identification {

points_mm read_plan(const std::string &path) {
    const json plan = formats::read_json(path);
    const json points = formats::get<json>(plan, "points_mm", path);
    constexpr std::size_t most = 100;
    const auto wrong = [&]() {
        return input_error(path, 0, 0,
                           "points_mm must hold three or more points (up to {}) of three numbers, "
                           "[x, y, z] in mm",
                           most);
    };
    if (!points.is_array() || points.size() < 3 || points.size() > most) throw wrong();
    points_mm all(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (!points[p].is_array() || points[p].size() != 3) throw wrong();
        for (std::size_t k = 0; k < 3; ++k) {
            if (!points[p][k].is_number()) throw wrong();
            all[p][k] = points[p][k].get<double>();
        }
    }
    return all;
}

json points_json(const points_mm &points) {
    json all = json::array();
    for (const auto &point : points) all.push_back({point[0], point[1], point[2]});
    return all;
}

int axis_of(const std::string &name) {
    const std::string axes = "XYZxyz";
    const auto found = name.size() == 1 ? axes.find(name[0]) : std::string::npos;
    if (found == std::string::npos) throw input_error("'" + name + "' is no axis; use X, Y or Z");
    return static_cast<int>(found % 3);
}

}  // namespace compbox::identification
