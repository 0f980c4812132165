// SPDX-License-Identifier: MIT
#include "host-tools/simulation/plots.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox::simulation {

namespace {

constexpr const char *method_colours[] = {formats::plot_colour::curve, formats::plot_colour::second,
                                          "#6a51a3", "#2e8b57"};
constexpr std::size_t most_marks = 30;  // paths with more stops have no marks
constexpr double settling_s = 0.5;
constexpr std::size_t most_log_points = 4000;  // of a figure

std::vector<double> column_of(const std::vector<twin::xyz> &points, std::size_t axis) {
    std::vector<double> values;
    for (const auto &point : points) values.push_back(point[axis]);
    return values;
}

// in : x: abscissa of all panels
// out: gnuplot commands; the keys are in the head room above the curves
std::string panel_style(const std::vector<double> &x) {
    const auto [least, most] = std::minmax_element(x.begin(), x.end());
    return "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
           "set grid lw 0.8 lc rgb '#dddddd'\n"
           "set key top left horizontal maxrows 1 samplen 1.5 font ',11'\n"
           "set lmargin 10\nset rmargin 4\nset offsets 0, 0, graph 0.25, graph 0.05\n" +
           fmt::format("set xrange [{}:{}]\n", *least, *most);
}

std::string curve(const std::string &data, std::size_t column, const std::string &title,
                  const std::string &colour, bool points) {
    return fmt::format("${} using 1:{} with {} lw 1.6 lc rgb '{}' {}", data, column,
                       points ? "linespoints pt 7 ps 0.3" : "lines", colour,
                       title.empty() ? "notitle" : "title " + formats::plot_text(title));
}

// out: positions of the stops on the axis that divides the path, mm
std::vector<double> abscissa(const scenario_path &path, const simulated_run &run) {
    return column_of(run.stops_mm, static_cast<std::size_t>(path.along));
}

// out: gnuplot script; left: before and after by the first method, right: after by every method
std::string path_script(const scenario_path &path, const std::string &directions,
                        const std::vector<const simulated_run *> &runs) {
    std::string script = panel_style(abscissa(path, *runs.front())) +
                         fmt::format("set multiplot layout {},2\n", directions.size());
    const bool marks = runs.front()->stops_mm.size() <= most_marks;
    for (const char letter : directions) {
        const auto a = static_cast<std::size_t>(twin::axis_index(letter));
        const bool first = letter == directions.front(), last = letter == directions.back();
        const std::string data(1, letter);
        std::vector<std::vector<double>> columns{abscissa(path, *runs.front()),
                                                 column_of(runs.front()->before_um, a)};
        for (const auto *run : runs) columns.push_back(column_of(run->after_um, a));
        script += formats::plot_data(data, columns);
        script += fmt::format("set ylabel 'error in {}, µm'\n", data);
        if (last) script += fmt::format("set xlabel '{}, mm'\n", twin::axis_letters[path.along]);
        if (first)
            script += fmt::format("set title {}\n",
                                  formats::plot_text(path.name + ": true error before and after"));
        script +=
            fmt::format("plot {}, {}\n",
                        curve(data, 2, first ? "before" : "", formats::plot_colour::grey, marks),
                        curve(data, 3, first ? "after, " + runs.front()->method : "",
                              method_colours[0], marks));
        if (first) script += "set title 'residual error by method'\n";
        script += "plot ";
        for (std::size_t m = runs.size(); m-- > 0;) {
            script += curve(data, 3 + m, first ? runs[m]->method : "",
                            method_colours[m % std::size(method_colours)], false) +
                      (m ? ", " : "\n");
        }
        script += "unset title\n";
    }
    return script + "unset multiplot\n";
}

// in : curves of one axis, by name
// out: gnuplot script: readings and curves in one panel
std::string curves_script(const std::map<std::string, coefficients::drawn_curve> &curves,
                          char axis) {
    std::string data, plots;
    std::vector<double> travel;
    std::size_t k = 0;
    for (const auto &[name, curve] : curves) {
        if (name.back() != axis) continue;
        const char *colour = method_colours[k++ % std::size(method_colours)];
        travel = curve.at_mm;
        data += formats::plot_data(name, {curve.at_mm, curve.curve_um}) +
                formats::plot_data(name + "_read", {curve.position_mm, curve.mean_um});
        plots += fmt::format(
            "{}${}_read using 1:2 with points pt 7 ps 0.5 lc rgb '{}' notitle, "
            "${} using 1:2 with lines lw 1.8 lc rgb '{}' title '{}'",
            plots.empty() ? "" : ", ", name, colour, name, colour, name);
    }
    if (plots.empty()) return "";
    return panel_style(travel) + data +
           fmt::format("set xlabel '{}, mm'\nset ylabel 'error, µm'\nplot {}\n", axis, plots);
}

// in : curves with the way to their key points
// out: gnuplot script: the largest residual of each over the number of its key points
std::string key_points_script(const std::map<std::string, coefficients::drawn_curve> &curves) {
    std::string data, plots;
    std::size_t k = 0;
    for (const auto &[name, curve] : curves) {
        data += formats::plot_data(name, {curve.key_points, curve.largest_residual_um});
        plots += fmt::format(
            "{}${} using 1:2 with linespoints pt {} ps 0.6 lw 1.4 lc rgb '{}' title '{}'",
            plots.empty() ? "" : ", ", name, 4 + k, method_colours[k % std::size(method_colours)],
            name);
        ++k;
    }
    return "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
           "set grid lw 0.8 lc rgb '#dddddd'\nset logscale y\n"
           "set xlabel 'key points'\nset ylabel 'largest residual, µm'\n" +
           data + fmt::format("plot {}\n", plots);
}

std::string file_name(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

// out: every n-th element, at most most_log_points
template <typename item>
std::vector<item> thinned(const std::vector<item> &all) {
    const std::size_t every = 1 + all.size() / most_log_points;
    std::vector<item> some;
    for (std::size_t i = 0; i < all.size(); i += every) some.push_back(all[i]);
    return some;
}

// out: rows in which the box has been ACTIVE for more than settling_s
std::vector<bool> settled_rows(const plc_log &log) {
    std::vector<bool> settled(log.time_s.size());
    double since_s = 0.0;
    for (std::size_t r = 0; r < settled.size(); ++r) {
        if (!log.active[r]) since_s = log.time_s[r];
        settled[r] = log.time_s[r] - since_s > settling_s;
    }
    return settled;
}

}  // namespace

void plot_paths(const scenario &plan, const simulation &result, const std::string &folder) {
    const std::uint64_t seed = result.runs.front().seed;
    for (const auto &path : plan.paths) {
        std::vector<const simulated_run *> runs;
        for (const auto &run : result.runs) {
            if (run.seed == seed && run.path == path.name) runs.push_back(&run);
        }
        formats::run_gnuplot(fmt::format("{}/{}.svg", folder, file_name(path.name)),
                             path_script(path, plan.directions, runs), 1300, 950);
    }
}

void plot_curves(const simulation &result, const std::string &folder) {
    if (result.drawn.empty()) return;
    for (const char axis : std::string(twin::axis_letters)) {
        const std::string script = curves_script(result.drawn.front().curves, axis);
        if (script.empty()) continue;
        formats::run_gnuplot(fmt::format("{}/curves-{}.svg", folder, axis), script, 900, 420);
    }
    for (const auto &method : result.drawn) {
        if (method.curves.empty() || method.curves.begin()->second.key_points.empty()) continue;
        formats::run_gnuplot(folder + "/key-points.svg", key_points_script(method.curves), 900,
                             420);
        return;
    }
}

void plot_log(const plc_log &log, const std::string &file) {
    const auto time = thinned(log.time_s);
    const auto active = thinned(settled_rows(log));
    std::string script = panel_style(time) + "set multiplot layout 3,2\n";
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string data = std::string(1, twin::axis_letters[a]);
        auto wanted = column_of(thinned(log.before_um), a);
        for (double &value : wanted) value = -value;
        auto left = column_of(thinned(log.after_um), a);
        for (std::size_t i = 0; i < left.size(); ++i) {
            if (!active[i]) left[i] = std::numeric_limits<double>::quiet_NaN();
        }
        script += formats::plot_data(
            data, {time, wanted, column_of(thinned(log.displacement_um), a), left});
        script += fmt::format("set ylabel '{}, µm'\n", data);
        if (a == 2) script += "set xlabel 'time, s'\n";
        if (a == 0) script += "set title 'in real time: compensation in the axes'\n";
        script += fmt::format(
            "plot {}, {}\n",
            curve(data, 2, a == 0 ? "true error, negative" : "", formats::plot_colour::grey, false),
            curve(data, 3, a == 0 ? "compensation" : "", formats::plot_colour::curve, false));
        if (a == 0) script += "set title 'residual error while the box is ACTIVE'\n";
        script += fmt::format("plot {}\nunset title\n",
                              curve(data, 4, "", formats::plot_colour::second, false));
    }
    formats::run_gnuplot(file, script + "unset multiplot\n", 1300, 950);
}

}  // namespace compbox::simulation
