// SPDX-License-Identifier: MIT
#include "host-tools/identification/plot.h"

#include <fmt/core.h>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox {

namespace {

std::string block_of(const six_curves &curves, Eigen::Index k, const std::string &name) {
    std::vector<double> value, low, high;
    for (Eigen::Index row = 0; row < curves.value.rows(); ++row) {
        const double v = curves.value(row, k), band = 2.0 * curves.sigma(row, k);
        value.push_back(v);
        low.push_back(v - band);
        high.push_back(v + band);
    }
    return plot_data(name, {curves.position_mm, value, low, high});
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
            plot_text(names[k] + ", ±2σ"), plot_text(k < 3 ? "µm" : "µrad"), names[k],
            plot_colour::band, names[k], plot_colour::curve);
    }
    const std::string script = fmt::format(
        "{}set multiplot layout 2,3\n"
        "set border lw 0.8 lc rgb '#444444'\n"
        "set tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\n"
        "set offsets 0, 0, graph 0.05, graph 0.05\n"
        "set xlabel 'position, mm'\n"
        "set xrange [{}:{}]\n"
        "{}unset multiplot\n",
        blocks, curves.position_mm.front(), curves.position_mm.back(), panels);
    run_gnuplot(path, script, 1300, 700);
}

}  // namespace compbox
