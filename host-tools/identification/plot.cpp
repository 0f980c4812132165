// SPDX-License-Identifier: MIT
#include "host-tools/identification/plot.h"

#include <fmt/core.h>

#include <algorithm>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox::identification {

namespace {

std::string block_of(const six_curves &curves, Eigen::Index k, const std::string &name) {
    std::vector<double> value, low, high;
    for (Eigen::Index row = 0; row < curves.value.rows(); ++row) {
        const double v = curves.value(row, k), band = 2.0 * curves.sigma(row, k);
        value.push_back(v);
        low.push_back(v - band);
        high.push_back(v + band);
    }
    return formats::plot_data(name, {curves.position_mm, value, low, high});
}

}  // namespace

void plot_identified(const six_curves &curves, int axis, const std::string &path) {
    const auto names = error_names(axis);
    std::string blocks, panels;
    for (std::size_t k = 0; k < 6; ++k) {
        blocks += block_of(curves, static_cast<Eigen::Index>(k), names[k]);
        panels += fmt::format(
            "set title {}\n"
            "set ylabel {}\n"
            "plot ${} using 1:3:4 with filledcurves fc rgb '{}' notitle, ${} using 1:2 with "
            "linespoints pt 7 ps 0.4 lc rgb '{}' notitle\n",
            formats::plot_text(names[k]),
            formats::plot_text(names[k] + (k < 3 ? ", µm" : ", µrad")), names[k],
            formats::plot_colour::band, names[k], formats::plot_colour::curve);
    }
    const std::string script = fmt::format(
        "{}set multiplot layout 2,3 title {}\n"
        "set border lw 0.8 lc rgb '#444444'\n"
        "set tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\n"
        "set offsets 0, 0, graph 0.05, graph 0.05\n"
        "set xlabel 'position, mm'\n"
        "set xrange [{}:{}]\n"
        "{}unset multiplot\n",
        blocks,
        formats::plot_text(fmt::format("Errors of axis {} by nine lines, with ±2σ", "XYZ"[axis])),
        curves.position_mm.front(), curves.position_mm.back(), panels);
    formats::run_gnuplot(path, script, 1300, 700);
}

namespace {

// out: the 12 edges of the smallest box around the nodes, as arrows without heads
std::string edges_of(const std::vector<point_mm> &nodes) {
    point_mm low = nodes.front(), high = nodes.front();
    for (const auto &node : nodes) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], node[k]);
            high[k] = std::max(high[k], node[k]);
        }
    }
    std::string text;
    for (std::size_t along = 0; along < 3; ++along) {
        for (unsigned corner = 0; corner < 4; ++corner) {
            point_mm from = low;
            if (corner & 1u) from[(along + 1) % 3] = high[(along + 1) % 3];
            if (corner & 2u) from[(along + 2) % 3] = high[(along + 2) % 3];
            point_mm to = from;
            to[along] = high[along];
            text +=
                fmt::format("set arrow from {},{},{} to {},{},{} nohead lw 1 lc rgb '#444444'\n",
                            from[0], from[1], from[2], to[0], to[1], to[2]);
        }
    }
    return text;
}

}  // namespace

void plot_plan(const points_mm &points, const std::vector<point_mm> &nodes, const std::string &axis,
               const std::string &path) {
    std::vector<std::vector<double>> all(3), chosen(3);
    std::string labels;
    for (const auto &node : nodes) {
        for (std::size_t k = 0; k < 3; ++k) all[k].push_back(node[k]);
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
        const point_mm &at = points[p];
        for (std::size_t k = 0; k < 3; ++k) chosen[k].push_back(at[k]);
        labels += fmt::format(
            "set label {} at {},{},{} offset 1.2,0.6 front font ',13'\n",
            formats::plot_text(fmt::format("P{} ({:g}, {:g}, {:g})", p + 1, at[0], at[1], at[2])),
            at[0], at[1], at[2]);
    }
    for (auto &column : chosen) column.push_back(column.front());  // a closed triangle
    const std::string script = fmt::format(
        "{}{}{}{}"
        "set title {}\n"
        "set xlabel 'X, mm'\nset ylabel 'Y, mm'\nset zlabel 'Z, mm' rotate\n"
        "set border 0\nset xyplane relative 0.06\nset view 62,32\nset view equal xyz\n"
        "set key bottom horizontal samplen 2\n"
        "splot $nodes with points pt 7 ps 0.25 lc rgb '{}' title 'nodes', $points with lines lw "
        "1.6 "
        "dt 2 lc rgb '{}' notitle, $points with points pt 7 ps 1.6 lc rgb '{}' title 'points to "
        "measure'\n",
        formats::plot_data("nodes", all), formats::plot_data("points", chosen), edges_of(nodes),
        labels, formats::plot_text("Measuring points of nine lines, axis " + axis),
        formats::plot_colour::grey, formats::plot_colour::curve, formats::plot_colour::second);
    formats::run_gnuplot(path, script, 900, 700);
}

}  // namespace compbox::identification
