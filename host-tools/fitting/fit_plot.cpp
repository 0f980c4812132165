// SPDX-License-Identifier: MIT
// The figure of a fit: readings of each run, mean and curve above, residuals below.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host-tools/fitting/fit.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox::fitting {

namespace {

constexpr int curve_points = 800;

std::string curve_block(const fit_result &result, const std::string &branch) {
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
    return formats::plot_data("curve" + branch, {x, y}) +
           formats::plot_data("knots" + branch, {knots, on_curve});
}

// The band about the curve and about its zero line: +-2 sigma of the best estimate.
std::string band_block(const fit_result &result, const std::string &branch) {
    const smooth_curve &best = result.best;
    std::vector<double> low, high, low_off, high_off;
    for (std::size_t i = 0; i < best.x.size(); ++i) {
        const double curve = result.curve.value(best.x[i]);
        const double sigma = std::hypot(best.sigma[i], best.more_sigma[i]);
        low.push_back(best.mean[i] - 2.0 * sigma);
        high.push_back(best.mean[i] + 2.0 * sigma);
        low_off.push_back(low.back() - curve);
        high_off.push_back(high.back() - curve);
    }
    return formats::plot_data("band" + branch, {best.x, low, high, low_off, high_off});
}

std::string readings_block(const fit_result &result, const std::string &branch) {
    std::string text;
    for (std::size_t r = 0; r < result.data.runs.size(); ++r) {
        const measured_run &run = result.data.runs[r];
        std::vector<double> off;
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            off.push_back(run.error[i] - result.curve.value(run.position[i]));
        }
        text +=
            formats::plot_data(fmt::format("run{}{}", branch, r), {run.position, run.error, off});
    }
    return text + formats::plot_data("mean" + branch,
                                     {result.data.position, result.data.mean, result.residuals});
}

std::string all_blocks(const fit_result &result, const std::string &branch) {
    return curve_block(result, branch) + band_block(result, branch) +
           readings_block(result, branch);
}

// Readings of both directions differ in colour and marker; each is named once.
std::string plot_runs(const fit_result &result, const std::string &branch, int column) {
    std::string text;
    bool titled[2] = {false, false};
    for (std::size_t r = 0; r < result.data.runs.size(); ++r) {
        const int direction = result.data.runs[r].direction;
        bool &named = titled[direction < 0];
        text += fmt::format(
            "$run{}{} using 1:{} with points pt {} ps 0.6 lw 1 lc rgb '{}' {}, ", branch, r, column,
            direction < 0 ? "10" : "8",
            direction < 0 ? formats::plot_colour::backward : formats::plot_colour::forward,
            named           ? "notitle"
            : direction < 0 ? "title 'readings backward'"
            : direction > 0 ? "title 'readings forward'"
                            : "title 'readings'");
        named = true;
    }
    return text;
}

std::string plot_band(const std::string &branch, const char *columns) {
    return fmt::format("$band{} using {} with filledcurves fc rgb '{}' {}", branch, columns,
                       formats::plot_colour::band,
                       branch.empty() ? "title 'curve ±2σ', " : "notitle, ");
}

// One branch in the upper panel: curve, knots and means.
std::string plot_curve(const fit_result &result, const std::string &branch) {
    const bool knots = result.curve.method == fit_method::bspline ||
                       result.curve.method == fit_method::bspline_lmc;
    const std::string colour =
        branch.empty() ? formats::plot_colour::curve : formats::plot_colour::second;
    const std::string title = !branch.empty()           ? "curve backward"
                              : result.backward.empty() ? "curve"
                                                        : "curve forward";
    std::string text = fmt::format("$curve{} with lines lw 2.2 dt {} lc rgb '{}' title '{}', ",
                                   branch, branch.empty() ? 1 : 2, colour, title);
    if (knots) {
        text += fmt::format("$knots{} with points pt 2 ps 0.7 lw 1.2 lc rgb '{}' {}", branch,
                            formats::plot_colour::second,
                            branch.empty() ? "title 'knots', " : "notitle, ");
    }
    return fmt::format("{}$mean{} using 1:2 with points pt 7 ps 0.45 lc rgb '{}' {}", text, branch,
                       formats::plot_colour::mean, branch.empty() ? "title 'mean'" : "notitle");
}

// One branch in the lower panel: residuals of the means.
std::string plot_residuals(const fit_result &result, const std::string &branch) {
    const bool one = result.backward.empty() && branch.empty();
    return fmt::format(
        "$mean{} using 1:3 with linespoints pt {} ps 0.6 lw 1 dt {} lc rgb '{}' title 'mean{}'",
        branch,
        one              ? 7
        : branch.empty() ? 9
                         : 11,
        branch.empty() ? 1 : 2,
        one              ? formats::plot_colour::mean
        : branch.empty() ? formats::plot_colour::curve
                         : formats::plot_colour::second,
        one              ? ""
        : branch.empty() ? " forward"
                         : " backward");
}

// The third panel, for bspline-lmc: the largest residual over the number of key points (S1).
std::string key_points_panel(const fit_result &result, const std::string &unit) {
    std::vector<double> count, residual;
    for (const key_step &step : result.key_steps) {
        count.push_back(static_cast<double>(step.key_points));
        residual.push_back(step.largest_residual);
    }
    return formats::plot_data("keys", {count, residual}) +
           fmt::format(
               "set size 1,0.27\nset origin 0,0\nset tmargin 0.8\nset bmargin 3.4\n"
               "set xrange [{}:{}]\nset yrange [0:*]\nset xlabel 'key points'\nset ylabel {}\n"
               "plot $keys with linespoints pt 7 ps 0.6 lw 1.6 lc rgb '{}' title 'largest "
               "residual', "
               "{} with lines dt 2 lw 1.2 lc rgb '{}' title 'tolerance'\n",
               count.front() - 1.0, count.back() + 1.0, formats::plot_text("residual, " + unit),
               formats::plot_colour::curve, result.options.tolerance_um,
               formats::plot_colour::second);
}

// "Größe 5, axis X, EXX.rtl": what the file states, and its name.
std::string source_of(const measurement &data) {
    std::string text = data.about.machine;
    if (!data.about.axis.empty()) text += (text.empty() ? "axis " : ", axis ") + data.about.axis;
    const std::string file = std::filesystem::path(data.file).filename().string();
    return text.empty() ? file : text + ", " + file;
}

std::string title_of(const fit_result &result, const std::string &unit) {
    std::size_t runs = result.data.runs.size();
    for (const auto &backward : result.backward) runs += backward.data.runs.size();
    return fmt::format("{} over {}: {}; {}, {}{}{}{}, noise {:.2f} {} a reading",
                       result.options.name, result.options.signal, source_of(result.data),
                       name_of(result.options.method), result.curve.coefficient_count(),
                       result.curve.coefficient_count() == 1 ? " coefficient; " : " coefficients; ",
                       runs, runs == 1 ? " run" : " runs", result.noise,
                       result.data.sigma_given ? "of its sigma" : unit);
}

}  // namespace

void plot_fit(const fit_result &result, const std::string &path) {
    const std::string unit = result.data.unit == "urad" ? "µrad" : "µm";
    std::string script = all_blocks(result, "");
    std::string upper = plot_band("", "1:2:3"), lower = plot_band("", "1:4:5");
    std::string upper_end = plot_curve(result, ""), lower_end = plot_residuals(result, "");
    upper += plot_runs(result, "", 2);
    lower += fmt::format("0 with lines lw 1.2 lc rgb '{}' notitle, {}", formats::plot_colour::curve,
                         plot_runs(result, "", 3));
    for (const auto &backward : result.backward) {
        script += all_blocks(backward, "b");
        upper += plot_band("b", "1:2:3") + plot_runs(backward, "b", 2);
        lower += plot_runs(backward, "b", 3);
        upper_end += ", " + plot_curve(backward, "b");
        lower_end += ", " + plot_residuals(result, "b");
    }
    const bool keys = !result.key_steps.empty();
    script += fmt::format(
        "set multiplot\n"
        "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\nset key top right horizontal samplen 2\n"
        "set lmargin 9\nset rmargin 3\n"
        "set xrange [{}:{}]\nset offsets 0, 0, graph 0.05, graph 0.12\n"
        "set title {}\n"
        "set size 1,{}\nset origin 0,{}\nset format x ''\nset bmargin 0.8\n"
        "set ylabel {}\n"
        "plot {}{}\n"
        "unset title\nset size 1,{}\nset origin 0,{}\nset format x '%g'\nset bmargin 3.4\n"
        "set tmargin 0.8\nset xlabel {}\n"
        "set ylabel {}\n"
        "plot {}{}\n{}unset multiplot\n",
        result.data.from(), result.data.to(), formats::plot_text(title_of(result, unit)),
        keys ? 0.44 : 0.58, keys ? 0.56 : 0.42, formats::plot_text("error, " + unit), upper,
        upper_end, keys ? 0.29 : 0.42, keys ? 0.27 : 0.0,
        formats::plot_text(result.options.signal + ", mm"), formats::plot_text("residual, " + unit),
        lower, lower_end, keys ? key_points_panel(result, unit) : "");
    formats::run_gnuplot(path, script, 1000, keys ? 960 : 720);
}

}  // namespace compbox::fitting
