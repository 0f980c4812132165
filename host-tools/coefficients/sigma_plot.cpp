// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>

#include "host-tools/coefficients/sigma.h"
#include "host-tools/formats/plot.h"

namespace compbox::coefficients {

namespace {

constexpr int figure_width = 480, figure_height = 420, heading_height = 50;
constexpr const char *title = "uncertainty U (k = 2) of the compensation, µm";

// One plane through the middle of the other axis.
struct plane {
    std::size_t across, up;
};

std::size_t power(std::size_t base, std::size_t exponent) {
    return exponent == 0 ? 1 : base * power(base, exponent - 1);
}

// out: the nodes of the plane: across, up, U
std::vector<std::vector<double>> nodes_of(const sigma_map &map, const plane &shown) {
    std::vector<std::vector<double>> columns(3);
    for (std::size_t node = 0; node < map.nodes.size(); ++node) {
        bool in_it = true;
        for (std::size_t axis = 0; axis < map.axes.size(); ++axis) {
            const std::size_t step = node / power(map.steps, axis) % map.steps;
            in_it = in_it && (axis == shown.across || axis == shown.up || step == map.steps / 2);
        }
        if (!in_it) continue;
        columns[0].push_back(map.nodes[node][shown.across]);
        columns[1].push_back(map.nodes[node][shown.up]);
        columns[2].push_back(map.nodes[node].back());
    }
    return columns;
}

std::string label(const std::string &axis) {
    const std::size_t cut = axis.rfind('_');
    return formats::plot_text(axis.substr(0, cut) + ", " + axis.substr(cut + 1));
}

// "Z = 500 mm", where the plane is; "" with two axes
std::string middle_of(const sigma_map &map, const plane &shown) {
    for (std::size_t axis = 0; axis < map.axes.size(); ++axis) {
        if (axis == shown.across || axis == shown.up) continue;
        const std::size_t cut = map.axes[axis].rfind('_');
        const double at = map.nodes[map.nodes.size() / 2][axis];
        return fmt::format("{} = {:.6g} {}", map.axes[axis].substr(0, cut), at,
                           map.axes[axis].substr(cut + 1));
    }
    return "";
}

std::string curve_script(const sigma_map &map) {
    std::vector<std::vector<double>> columns(2);
    for (const auto &node : map.nodes) {
        columns[0].push_back(node.front());
        columns[1].push_back(node.back());
    }
    return formats::plot_data("map", columns) +
           fmt::format(
               "set title {}\nset xlabel {}\nset yrange [0:]\nset grid\nplot $map using 1:2 with "
               "lines lw 2.2 lc rgb '{}' notitle\n",
               formats::plot_text(title), label(map.axes[0]), formats::plot_colour::curve);
}

}  // namespace

void plot_sigma_map(const sigma_map &map, const std::string &path) {
    if (map.axes.size() == 1) {
        formats::run_gnuplot(path, curve_script(map));
        return;
    }
    std::vector<plane> planes = {{0, 1}};
    if (map.axes.size() == 3) planes.insert(planes.end(), {{0, 2}, {1, 2}});
    double most = 0.0;
    for (const auto &node : map.nodes) most = std::max(most, node.back());
    std::string script;
    for (std::size_t p = 0; p < planes.size(); ++p) {
        script += formats::plot_data(fmt::format("plane{}", p), nodes_of(map, planes[p]));
    }
    script += fmt::format(
        "set multiplot layout 1,{} title {}\nset palette defined (0 '#f7fbff', 0.5 '{}', 1 "
        "'{}')\nset cbrange [0:{}]\nset autoscale xfix\nset autoscale yfix\nset xtics out nomirror "
        "rotate by -30\nset ytics out nomirror\n",
        planes.size(), formats::plot_text(title), formats::plot_colour::curve,
        formats::plot_colour::second, std::max(most, 1e-6));
    for (std::size_t p = 0; p < planes.size(); ++p) {
        script += fmt::format(
            "set title {}\nset xlabel {}\nset ylabel {}\nplot $plane{} using 1:2:3 with image "
            "notitle\n",
            formats::plot_text(middle_of(map, planes[p])), label(map.axes[planes[p].across]),
            label(map.axes[planes[p].up]), p);
    }
    const int count = static_cast<int>(planes.size());
    formats::run_gnuplot(path, script + "unset multiplot\n", std::max(figure_width * count, 800),
                         figure_height + heading_height);
}

}  // namespace compbox::coefficients
