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
    const std::string id = fmt::format("f{}", number);
    const axis_readings axis = readings_of(data);
    const auto figures = evaluate_positioning(axis);
    panel result;
    std::string bands, lines, runs;
    const std::pair<const char *, const std::optional<approach_figures> *> directions[] = {
        {"forward", &figures.forward}, {"backward", &figures.backward}};
    for (const auto &[name, one] : directions) {
        if (!*one) continue;
        const std::string block = id + name;
        const std::string colour =
            fmt::format(" lc rgb '{}'", *name == 'f' ? plot_colour::curve : plot_colour::second);
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
        const std::string block = fmt::format("{}run{}", id, r);
        result.blocks += plot_data(block, {data.runs[r].position, error});
        runs += fmt::format("${} using 1:2 with lines lw 0.8 lc rgb '{}' {}, ", block,
                            plot_colour::grey, r == 0 ? "title 'runs'" : "notitle");
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
            throw input_error(
                data.file, 0, 0,
                "run '{}' has {} of the {} targets; the figures need a reading of each run at each",
                run.name, run.position.size(), axis.target_mm.size());
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
    const std::string script = fmt::format(
        "{}set multiplot layout 1,{}\n"
        "set border lw 0.8 lc rgb '#444444'\n"
        "set tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\n"
        "set key below horizontal maxrows 2 samplen 2\n"
        "set lmargin 9\n"
        "set rmargin 3\n"
        "set bmargin 6\n"
        "set xlabel 'position, mm'\n"
        "set ylabel {}\n"
        "set xrange [{}:{}]\n"
        "set yrange [{}:{}]\n"
        "{}unset multiplot\n",
        blocks, files.size(), plot_text("deviation, " + unit), files.front().from(),
        files.front().to(), low - margin, high + margin, commands);
    run_gnuplot(path, script, static_cast<int>(files.size() > 1 ? 640 * files.size() : 1000), 460);
}

}  // namespace compbox
