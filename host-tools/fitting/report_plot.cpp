// SPDX-License-Identifier: MIT
#include "host-tools/fitting/report_plot.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/plot.h"

namespace compbox {

namespace {

// Mean and mean -+ 2 s of one direction as a data block.
std::string band_block(const std::string &name, const axis_readings &axis,
                       const approach_figures &figures) {
    std::vector<double> mean, low, high;
    for (const auto &target : figures.targets) {
        mean.push_back(target.mean);
        low.push_back(target.mean - 2.0 * target.s.value_or(0.0));
        high.push_back(target.mean + 2.0 * target.s.value_or(0.0));
    }
    return plot_data(name, {axis.target_mm, mean, low, high});
}

struct panel {
    std::string blocks, commands;
    double low = INFINITY, high = -INFINITY;
};

// in : number: makes the names of its data blocks unique
// out: blocks and commands for gnuplot, and the range of the errors
panel panel_of(const measurement &data, std::size_t number) {
    const std::string id = "f" + std::to_string(number);
    const axis_readings axis = readings_of(data);
    const auto figures = evaluate_positioning(axis);
    panel result;
    std::string bands, lines, runs;
    const std::pair<const char *, const std::optional<approach_figures> *> directions[] = {
        {"forward", &figures.forward}, {"backward", &figures.backward}};
    for (const auto &[name, one] : directions) {
        if (!*one) continue;
        const std::string block = id + name;
        const std::string colour = std::string(" lc rgb '") +
                                   (*name == 'f' ? plot_colour::curve : plot_colour::second) + "'";
        result.blocks += band_block(block, axis, **one);
        bands += "$" + block + " using 1:3:4 with filledcurves fs transparent solid 0.18" + colour +
                 " title '±2s " + name + "', ";
        lines += "$" + block + " using 1:2 with linespoints pt 7 ps 0.5 lw 2" + colour +
                 " title 'mean " + name + "', ";
    }
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        const auto &error = data.runs[r].error;
        for (const double e : error) {
            result.low = std::min(result.low, e);
            result.high = std::max(result.high, e);
        }
        const std::string block = id + "run" + std::to_string(r);
        result.blocks += plot_data(block, {data.runs[r].position, error});
        runs += "$" + block + " using 1:2 with lines lw 0.8 lc rgb '" + plot_colour::grey + "' " +
                (r == 0 ? "title 'runs'" : "notitle") + ", ";
    }
    result.commands = "set title " + plot_text(data.file) + "\nplot " + bands + runs + lines +
                      "0 with lines lw 0.6 lc rgb '#444444' notitle\n";
    return result;
}

}  // namespace

axis_readings readings_of(const measurement &data) {
    axis_readings axis;
    axis.target_mm = data.position;
    for (const auto &run : data.runs) {
        auto &side = run.direction < 0 ? axis.backward : axis.forward;
        side.resize(axis.target_mm.size());
        if (run.position.size() != axis.target_mm.size()) {
            throw input_error(data.file, 0, 0,
                              "run '" + run.name + "' has " + std::to_string(run.position.size()) +
                                  " of the " + std::to_string(axis.target_mm.size()) +
                                  " targets; the figures need a reading of each run at each");
        }
        for (std::size_t i = 0; i < run.error.size(); ++i) side[i].push_back(run.error[i]);
    }
    return axis;
}

void plot_report(const std::vector<measurement> &files, const std::string &path) {
    std::string blocks, commands;
    double low = INFINITY, high = -INFINITY;
    for (std::size_t f = 0; f < files.size(); ++f) {
        const panel one = panel_of(files[f], f);
        blocks += one.blocks;
        commands += one.commands;
        low = std::min(low, one.low);
        high = std::max(high, one.high);
    }
    const double margin = std::max(0.15 * (high - low), 1e-6);
    const std::string unit = files.front().unit == "urad" ? "µrad" : "µm";
    const std::string script =
        blocks + "set multiplot layout 1," + std::to_string(files.size()) +
        "\nset border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\nset key below horizontal maxrows 2 samplen 2\n"
        "set lmargin 9\nset rmargin 3\nset bmargin 6\nset xlabel 'position, mm'\nset ylabel " +
        plot_text("deviation, " + unit) + "\nset xrange [" + shortest(files.front().from()) + ":" +
        shortest(files.front().to()) + "]\nset yrange [" + shortest(low - margin) + ":" +
        shortest(high + margin) + "]\n" + commands + "unset multiplot\n";
    run_gnuplot(path, script, static_cast<int>(files.size() > 1 ? 640 * files.size() : 1000), 460);
}

}  // namespace compbox
