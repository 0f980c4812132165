// SPDX-License-Identifier: MIT
#include "host-tools/simulation/plots.h"

#include <algorithm>
#include <limits>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"

namespace compbox::simulation {

namespace {

constexpr const char *method_colours[] = {plot_colour::curve, plot_colour::second, "#6a51a3",
                                          "#2e8b57"};
constexpr std::size_t most_marks = 30;  // stops of a path that are marked
constexpr double settling_s = 0.5;
constexpr std::size_t most_log_points = 4000;  // a figure shows no more

std::vector<double> column_of(const std::vector<xyz> &points, std::size_t axis) {
    std::vector<double> values;
    for (const auto &point : points) values.push_back(point[axis]);
    return values;
}

// xrange: of all panels; the keys stand in the head room above the curves.
std::string panel_style(const std::vector<double> &x) {
    const auto [least, most] = std::minmax_element(x.begin(), x.end());
    return "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
           "set grid lw 0.8 lc rgb '#dddddd'\n"
           "set key top left horizontal maxrows 1 samplen 1.5 font ',11'\n"
           "set lmargin 10\nset rmargin 4\nset offsets 0, 0, graph 0.25, graph 0.05\n"
           "set xrange [" +
           shortest(*least) + ":" + shortest(*most) + "]\n";
}

std::string curve(const std::string &data, std::size_t column, const std::string &title,
                  const std::string &colour, bool points) {
    return "$" + data + " using 1:" + std::to_string(column) + " with " +
           (points ? "linespoints pt 7 ps 0.3" : "lines") + " lw 1.6 lc rgb '" + colour + "' " +
           (title.empty() ? "notitle" : "title " + plot_text(title));
}

// The position along a path, as the axis shows it that the path is divided by.
std::vector<double> abscissa(const scenario_path &path, const simulated_run &run) {
    return column_of(run.stops_mm, static_cast<std::size_t>(path.along));
}

// Left: before and after by the first method. Right: after, by every method.
std::string path_script(const scenario_path &path, const std::string &directions,
                        const std::vector<const simulated_run *> &runs) {
    std::string script = panel_style(abscissa(path, *runs.front())) + "set multiplot layout " +
                         std::to_string(directions.size()) + ",2\n";
    const bool marks = runs.front()->stops_mm.size() <= most_marks;
    for (const char letter : directions) {
        const auto a = static_cast<std::size_t>(axis_index(letter));
        const bool first = letter == directions.front(), last = letter == directions.back();
        const std::string data(1, letter);
        std::vector<std::vector<double>> columns{abscissa(path, *runs.front()),
                                                 column_of(runs.front()->before_um, a)};
        for (const auto *run : runs) columns.push_back(column_of(run->after_um, a));
        script += plot_data(data, columns);
        script += "set ylabel " + plot_text("error in " + data + ", µm") + "\n";
        if (last)
            script +=
                "set xlabel " + plot_text(std::string(1, axis_letters[path.along]) + ", mm") + "\n";
        if (first)
            script += "set title " + plot_text(path.name + ": true error before and after") + "\n";
        script += "plot " + curve(data, 2, first ? "before" : "", plot_colour::grey, marks) + ", " +
                  curve(data, 3, first ? "after, " + runs.front()->method : "", method_colours[0],
                        marks) +
                  "\n";
        if (first) script += "set title 'what is left, by method'\n";
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

std::string file_name(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

// Every n-th element, so that not too many are left.
template <typename item>
std::vector<item> thinned(const std::vector<item> &all) {
    const std::size_t every = 1 + all.size() / most_log_points;
    std::vector<item> some;
    for (std::size_t i = 0; i < all.size(); i += every) some.push_back(all[i]);
    return some;
}

// Rows in which the box has been ACTIVE for a while: no longer on its way there.
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
        run_gnuplot(folder + "/" + file_name(path.name) + ".svg",
                    path_script(path, plan.directions, runs), 1300, 950);
    }
}

void plot_log(const plc_log &log, const std::string &file) {
    const auto time = thinned(log.time_s);
    const auto active = thinned(settled_rows(log));
    std::string script = panel_style(time) + "set multiplot layout 3,2\n";
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string data = std::string(1, axis_letters[a]);
        auto wanted = column_of(thinned(log.before_um), a);
        for (double &value : wanted) value = -value;
        auto left = column_of(thinned(log.after_um), a);
        for (std::size_t i = 0; i < left.size(); ++i) {
            if (!active[i]) left[i] = std::numeric_limits<double>::quiet_NaN();
        }
        script += plot_data(data, {time, wanted, column_of(thinned(log.displacement_um), a), left});
        script += "set ylabel " + plot_text(data + ", µm") + "\n";
        if (a == 2) script += "set xlabel 'time, s'\n";
        if (a == 0) script += "set title 'in real time: compensation in the axes'\n";
        script += "plot " +
                  curve(data, 2, a == 0 ? "true error, negative" : "", plot_colour::grey, false) +
                  ", " + curve(data, 3, a == 0 ? "compensation" : "", plot_colour::curve, false) +
                  "\n";
        if (a == 0) script += "set title 'what is left while the box is ACTIVE'\n";
        script += "plot " + curve(data, 4, "", plot_colour::second, false) + "\nunset title\n";
    }
    run_gnuplot(file, script + "unset multiplot\n", 1300, 950);
}

}  // namespace compbox::simulation
