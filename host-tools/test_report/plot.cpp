// SPDX-License-Identifier: MIT
#include "host-tools/test_report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host-tools/formats/plot.h"
#include "host-tools/test_report/figures.h"

namespace compbox::test_report {

namespace {

// Mean and mean -+ 2 s of one direction as a data block.
std::string band_block(const std::string &name, const metrology::axis_readings &axis,
                       const metrology::approach_figures &figures) {
    std::vector<double> mean, low, high;
    for (const auto &target : figures.targets) {
        mean.push_back(target.mean);
        low.push_back(target.mean - 2.0 * target.s.value_or(0.0));
        high.push_back(target.mean + 2.0 * target.s.value_or(0.0));
    }
    return formats::plot_data(name, {axis.target_mm, mean, low, high});
}

struct panel {
    std::string blocks, commands;
    double low = INFINITY, high = -INFINITY;
};

// Line, colour and marker of a direction: they differ without colour too.
struct direction_style {
    const char *name, *style;
};
constexpr direction_style styles[] = {{"forward", "pt 9 dt 1"}, {"backward", "pt 11 dt 2"}};

const char *colour_of(const direction_style &one) {
    return &one == styles ? formats::plot_colour::curve : formats::plot_colour::second;
}

// in : id: makes the names of data blocks unique. Adds the runs' blocks and the range of errors.
// out: the plot command's elements for the runs
std::string plot_runs(const fitting::measurement &data, const std::string &id, panel &into) {
    std::string runs;
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        const auto &error = data.runs[r].error;
        for (const double e : error) {
            into.low = std::min(into.low, e);
            into.high = std::max(into.high, e);
        }
        const std::string block = fmt::format("{}run{}", id, r);
        into.blocks += formats::plot_data(block, {data.runs[r].position, error});
        runs += fmt::format("${} using 1:2 with lines lw 0.8 lc rgb '{}' {}, ", block,
                            formats::plot_colour::grey, r == 0 ? "title 'runs'" : "notitle");
    }
    return runs;
}

// in : number: of the file; title: of the panel
// out: blocks and commands for gnuplot, and the range of the errors
panel panel_of(const fitting::measurement &data, std::size_t number, const std::string &title) {
    const std::string id = fmt::format("f{}", number);
    const metrology::axis_readings axis = readings_of(data);
    const auto figures = metrology::evaluate_positioning(axis);
    panel result;
    std::string bands, lines;
    for (const direction_style &one : styles) {
        const auto &side = &one == styles ? figures.forward : figures.backward;
        if (!side) continue;
        const std::string block = id + one.name, colour = colour_of(one);
        result.blocks += band_block(block, axis, *side);
        bands += fmt::format(
            "${} using 1:3:4 with filledcurves fs transparent solid 0.18 lc rgb '{}' "
            "title '±2s {}', ",
            block, colour, one.name);
        lines += fmt::format(
            "${} using 1:2 with linespoints {} ps 0.6 lw 2 lc rgb '{}' title 'mean {}', ", block,
            one.style, colour, one.name);
    }
    const std::string runs = plot_runs(data, id, result);
    result.commands = "set title " + formats::plot_text(title) + "\nplot " + bands + runs + lines +
                      "0 with lines lw 0.6 lc rgb '#444444' notitle\n";
    return result;
}

// out: the script of one panel for each file, all with the same scale; heading may be empty
std::string script_of(const std::vector<fitting::measurement> &files, const std::string &heading,
                      bool with_key) {
    std::string blocks, commands;
    double low = INFINITY, high = -INFINITY, from = INFINITY, to = -INFINITY;
    for (std::size_t f = 0; f < files.size(); ++f) {
        std::string title = std::filesystem::path(files[f].file).filename().string();
        if (files.size() > 1) title = (f == 0 ? "before: " : "after: ") + title;
        const panel one = panel_of(files[f], f, title);
        blocks += one.blocks;
        commands += one.commands;
        low = std::min(low, one.low);
        high = std::max(high, one.high);
        from = std::min(from, files[f].from());
        to = std::max(to, files[f].to());
    }
    const double margin = std::max(0.15 * (high - low), 1e-6);
    const std::string unit = files.front().unit == "urad" ? "µrad" : "µm";
    return fmt::format(
        "{}set multiplot layout 1,{}{}\n"
        "set border lw 0.8 lc rgb '#444444'\n"
        "set tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\n"
        "{}\n"
        "set lmargin 9\n"
        "set rmargin 3\n"
        "set xlabel 'position, mm'\n"
        "set ylabel {}\n"
        "set xrange [{}:{}]\n"
        "set yrange [{}:{}]\n"
        "{}unset multiplot\n",
        blocks, files.size(), heading.empty() ? "" : " title " + formats::plot_text(heading),
        with_key ? "set key below horizontal maxrows 2 samplen 3\nset bmargin 6" : "unset key",
        formats::plot_text("deviation, " + unit), from, to, low - margin, high + margin, commands);
}

}  // namespace

void plot_report(const std::vector<fitting::measurement> &files, const std::string &heading,
                 const std::string &path) {
    formats::run_gnuplot(path, script_of(files, heading, true),
                         static_cast<int>(files.size() > 1 ? 640 * files.size() : 1000),
                         heading.empty() ? 460 : 490);
}

std::string report_svg(const std::vector<fitting::measurement> &files) {
    return formats::gnuplot_svg(script_of(files, "", false), 880, 290);
}

}  // namespace compbox::test_report
