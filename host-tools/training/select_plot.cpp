// SPDX-License-Identifier: MIT
// Plot of a selection: the grade of each candidate, cluster by cluster.
#include <fmt/core.h>

#include <algorithm>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"
#include "host-tools/training/select_inputs.h"

namespace compbox::training {

namespace {

// Candidates cluster by cluster, the best grade of each first.
std::vector<std::size_t> order_of(const selection &result) {
    std::vector<std::size_t> order;
    for (std::size_t c = 0; c < result.candidates; ++c) order.push_back(c);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const std::size_t of_a = result.clusters.cluster[a], of_b = result.clusters.cluster[b];
        return of_a != of_b ? of_a < of_b : result.grade[a] > result.grade[b];
    });
    return order;
}

}  // namespace

void plot_selection(const selection &result, const std::string &path) {
    std::vector<double> place, grade, chosen_place, chosen_grade;
    std::string tics, borders;
    double at = 0.0;
    std::size_t cluster = 0;
    for (const std::size_t c : order_of(result)) {
        at += 1.0;
        if (result.clusters.cluster[c] != cluster) {
            cluster = result.clusters.cluster[c];
            const std::string x = fmt::format("{}", at - 0.1);
            borders += fmt::format(
                "set arrow from {}, graph 0 to {}, graph 1 nohead lw 0.8 lc rgb '#444444'\n", x, x);
            at += 0.8;
        }
        const bool is_chosen = std::count(result.chosen.begin(), result.chosen.end(), c) > 0;
        (is_chosen ? chosen_place : place).push_back(at);
        (is_chosen ? chosen_grade : grade).push_back(result.grade[c]);
        tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ",
                            formats::plot_text(result.data.inputs[c]), at);
    }
    const auto bars = [](const std::string &name, const std::string &title, const char *colour) {
        return fmt::format("${} using 1:2 with boxes fs solid 1 noborder lc rgb '{}' title {}",
                           name, colour, formats::plot_text(title));
    };
    std::string blocks = formats::plot_data("chosen", {chosen_place, chosen_grade}), others;
    if (!place.empty()) {
        blocks += formats::plot_data("others", {place, grade});
        others = ", " + bars("others", "in the same cluster", formats::plot_colour::band);
    }
    formats::run_gnuplot(path,
                         fmt::format("{}{}set boxwidth 0.8\n"
                                     "set xtics rotate by -60 nomirror ({})\n"
                                     "set xrange [0:{}]\n"
                                     "set yrange [0:1]\n"
                                     "set ylabel 'grey relational grade'\n"
                                     "set grid ytics lw 0.5 lc rgb '#dddddd'\n"
                                     "set key outside top horizontal\n"
                                     "plot {}{}\n",
                                     blocks, borders, tics, at + 1.0,
                                     bars("chosen", "chosen", formats::plot_colour::curve), others),
                         std::max(600, 40 * static_cast<int>(result.candidates) + 200), 500);
}

}  // namespace compbox::training
