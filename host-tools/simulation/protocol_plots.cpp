// SPDX-License-Identifier: MIT
#include "host-tools/simulation/protocol_plots.h"

#include <fmt/core.h>

#include "host-tools/formats/plot.h"

namespace compbox::simulation {

namespace {

constexpr const char *colours[] = {formats::plot_colour::curve, formats::plot_colour::second,
                                   "#6a51a3", "#2e8b57"};

std::vector<double> column_of(const std::vector<cut_point> &points, std::size_t axis,
                              twin::xyz cut_point::*which) {
    std::vector<double> values;
    for (const auto &point : points) values.push_back((point.*which)[axis]);
    return values;
}

// in : runs of the judged choice, one for each method. Writes one figure with a panel for each
// axis.
void plot_protocol(const part_protocol &protocol, const std::vector<const part_result *> &runs,
                   const std::string &path) {
    std::string script =
        "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\nset grid lw 0.8 lc rgb '#dddddd'\n"
        "set key top left horizontal samplen 1.5 font ',11'\nset lmargin 10\nset rmargin 4\n"
        "set offsets 0, 0, graph 0.2, graph 0.05\nset multiplot layout 3,1\n";
    for (std::size_t a = 0; a < 3; ++a) {
        const auto &first = runs.front()->points;
        std::vector<double> number;
        for (std::size_t i = 0; i < first.size(); ++i) number.push_back(static_cast<double>(i + 1));
        std::vector<std::vector<double>> columns{number,
                                                 column_of(first, a, &cut_point::before_um)};
        for (const auto *run : runs) {
            columns.push_back(column_of(run->points, a, &cut_point::after_um));
        }
        const std::string data = fmt::format("axis{}", a);
        script += formats::plot_data(data, columns);
        script += fmt::format("set ylabel 'error in {}, µm'\n", twin::axis_letters[a]);
        if (a == 0) {
            script += fmt::format(
                "set title {}\n",
                formats::plot_text(fmt::format("{}, {}: true error of each probed point, as cut",
                                               protocol.name, protocol.judge.name)));
        }
        if (a == 2) script += "set xlabel 'point'\n";
        script += fmt::format("plot ${} using 1:2 with lines lw 1.4 lc rgb '{}' {}", data,
                              formats::plot_colour::grey, a ? "notitle" : "title 'without'");
        for (std::size_t m = runs.size(); m-- > 0;) {
            script += fmt::format(", ${} using 1:{} with lines lw {} lc rgb '{}' {}", data, m + 3,
                                  m ? "0.8" : "1.6", colours[m % std::size(colours)],
                                  a ? "notitle" : "title " + formats::plot_text(runs[m]->method));
        }
        script += "\nunset title\n";
    }
    formats::run_gnuplot(path, script + "unset multiplot\n", 1100, 800);
}

}  // namespace

void plot_parts(const part_scenario &plan, const part_results &results, const std::string &folder) {
    for (const auto &protocol : plan.protocols) {
        std::vector<const part_result *> runs;
        for (const auto &run : results.runs) {
            if (run.seed == results.runs.front().seed && run.protocol == protocol.name &&
                run.choice == protocol.judge.name) {
                runs.push_back(&run);
            }
        }
        plot_protocol(protocol, runs, fmt::format("{}/{}.svg", folder, protocol.name));
    }
}

}  // namespace compbox::simulation
