// SPDX-License-Identifier: MIT
// The figure of a fit: readings of each run, mean and curve above, residuals below.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host-tools/fitting/fit.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox {

namespace {

constexpr int curve_points = 800;

std::string text_of(double value, const char *format) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

std::string curve_block(const fit_result &result) {
    std::vector<double> x, y;
    const double from = result.data.from(), to = result.data.to();
    for (int i = 0; i <= curve_points; ++i) {
        x.push_back(from + (to - from) * i / curve_points);
        y.push_back(result.curve.value(x.back()));
    }
    std::vector<double> knots, on_curve;
    if (result.curve.method == fit_method::bspline ||
        result.curve.method == fit_method::bspline_lmc) {
        knots = inner_knots(result.curve.bspline);
    }
    for (const double knot : knots) on_curve.push_back(result.curve.value(knot));
    return plot_data("curve", {x, y}) + plot_data("knots", {knots, on_curve});
}

// The band of the best estimate, about the written curve's zero line: +-2 sigma.
std::string band_block(const fit_result &result) {
    const smooth_curve &best = result.best;
    std::vector<double> low, high;
    for (std::size_t i = 0; i < best.x.size(); ++i) {
        const double off = best.mean[i] - result.curve.value(best.x[i]);
        low.push_back(off - 2.0 * best.sigma[i]);
        high.push_back(off + 2.0 * best.sigma[i]);
    }
    return plot_data("band", {best.x, low, high});
}

std::string readings_block(const fit_result &result) {
    std::string text;
    for (std::size_t r = 0; r < result.data.runs.size(); ++r) {
        const measured_run &run = result.data.runs[r];
        std::vector<double> off;
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            off.push_back(run.error[i] - result.curve.value(run.position[i]));
        }
        text += plot_data("run" + std::to_string(r), {run.position, run.error, off});
    }
    return text + plot_data("mean", {result.data.position, result.data.mean, result.residuals});
}

std::string plot_runs(const fit_result &result, int column) {
    std::string text;
    for (std::size_t r = 0; r < result.data.runs.size(); ++r) {
        const bool backward = result.data.runs[r].direction < 0;
        text += "$run" + std::to_string(r) + " using 1:" + std::to_string(column) +
                " with points pt " + (backward ? "10" : "8") + " ps 0.7 lw 1 lc rgb '" +
                plot_colour::grey + "' " + (r == 0 ? "title 'readings'" : "notitle") + ", ";
    }
    return text;
}

std::string title_of(const fit_result &result, const std::string &unit) {
    return result.options.name + "(" + result.options.signal + "), " +
           name_of(result.options.method) + ", " +
           std::to_string(result.curve.coefficient_count()) +
           (result.curve.coefficient_count() == 1 ? " coefficient; " : " coefficients; ") +
           std::to_string(result.data.runs.size()) +
           (result.data.runs.size() == 1 ? " run" : " runs") + ", noise " +
           text_of(result.noise, "%.2f ") + unit + " a reading";
}

}  // namespace

void plot_fit(const fit_result &result, const std::string &path) {
    const std::string unit = result.data.unit == "urad" ? "µrad" : "µm";
    const bool knots = result.curve.method == fit_method::bspline ||
                       result.curve.method == fit_method::bspline_lmc;
    const std::string range =
        "set xrange [" + shortest(result.data.from()) + ":" + shortest(result.data.to()) + "]\n";
    std::string script = curve_block(result) + band_block(result) + readings_block(result);
    script +=
        "set multiplot layout 2,1\n"
        "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\nset key top right horizontal samplen 2\n"
        "set lmargin 9\nset rmargin 3\n" +
        range + "set offsets 0, 0, graph 0.05, graph 0.12\n";
    script += "set title " + plot_text(title_of(result, unit)) + "\n";
    script += "set size 1,0.58\nset origin 0,0.42\nset format x ''\nset bmargin 0.8\n";
    script += "set ylabel " + plot_text("error, " + unit) + "\n";
    script += "plot " + plot_runs(result, 2) + "$curve with lines lw 2.2 lc rgb '" +
              plot_colour::curve + "' title 'curve', ";
    if (knots) {
        script += std::string("$knots with points pt 2 ps 0.7 lw 1.2 lc rgb '") +
                  plot_colour::second + "' title 'knots', ";
    }
    script += std::string("$mean using 1:2 with points pt 7 ps 0.45 lc rgb '") + plot_colour::mean +
              "' title 'mean'\n";
    script += "unset title\nset size 1,0.42\nset origin 0,0\nset format x '%g'\nset bmargin 3.4\n";
    script += "set tmargin 0.8\nset xlabel " + plot_text(result.options.signal + ", mm") + "\n";
    script += "set ylabel " + plot_text("residual, " + unit) + "\n";
    script += std::string("plot $band using 1:2:3 with filledcurves fc rgb '") + plot_colour::band +
              "' title 'curve ±2σ', 0 with lines lw 1.2 lc rgb '" + plot_colour::curve +
              "' notitle, " + plot_runs(result, 3) +
              "$mean using 1:3 with linespoints pt 7 ps 0.45 lw 0.8 lc rgb '" + plot_colour::mean +
              "' title 'mean of readings'\nunset multiplot\n";
    run_gnuplot(path, script, 1000, 720);
}

}  // namespace compbox
