// SPDX-License-Identifier: MIT
#include "host-tools/test_report/etve_report.h"

#include <fmt/core.h>

#include <algorithm>

#include "host-tools/formats/json.h"
#include "host-tools/formats/plot.h"

namespace compbox::test_report {

namespace {

using metrology::drift_record;
using series_list = std::vector<metrology::logged_series>;

constexpr double s_per_min = 60.0, s_per_h = 3600.0;

json figures_of_all(const drift_record &record, const series_list &all, double window_min) {
    json result = json::object();
    for (const auto &one : all) {
        const auto figures =
            metrology::evaluate_drift(record.time_s, one.values, window_min * s_per_min);
        result[one.name] = {
            {"range", figures.range},
            {"in_window", figures.in_window},
            {"window_from_min", (figures.window_from_s - record.time_s.front()) / s_per_min},
            {"change", figures.change}};
    }
    return result;
}

std::string rows_of(const json &all) {
    std::string text;
    for (const auto &[name, one] : all.items()) {
        text += fmt::format("  {:26}{:12.3f}{:14.3f}{:+12.3f}\n", name, one["range"].get<double>(),
                            one["in_window"].get<double>(), one["change"].get<double>());
    }
    return text;
}

// The data of one panel. relative: each series from its first reading
std::string panel_of(const std::vector<double> &hours, const series_list &all, bool relative,
                     std::string &blocks) {
    std::string plots;
    for (const auto &one : all) {
        std::vector<double> values = one.values;
        const double zero = relative ? values.front() : 0.0;
        for (double &value : values) value -= zero;
        const std::string block = fmt::format("{}{}", relative ? 'd' : 't', &one - all.data());
        blocks += formats::plot_data(block, {hours, values});
        plots += fmt::format("{}${} using 1:2 with lines lw 1.6 title {}",
                             plots.empty() ? "plot " : ", ", block, formats::plot_text(one.name));
    }
    return plots + "\n";
}

}  // namespace

json etve_figures(const drift_record &record, double window_min) {
    json figures;
    figures["hours"] = (record.time_s.back() - record.time_s.front()) / s_per_h;
    figures["readings"] = record.time_s.size();
    figures["window_min"] = window_min;
    figures["displacements"] = figures_of_all(record, record.displacements, window_min);
    figures["temperatures"] = figures_of_all(record, record.temperatures, window_min);
    figures["remarks"] = record.remarks;
    return figures;
}

std::string etve_text(const json &figures) {
    const double window_min = figures["window_min"].get<double>();
    std::string text =
        fmt::format("  ETVE, ISO 230-3: {:.2f} h, {} readings\n\n", figures["hours"].get<double>(),
                    figures["readings"].get<std::size_t>());
    text += fmt::format("  {:26}{:>12}{:>14}{:>12}\n", "", "range",
                        fmt::format("in {:g} min", window_min), "change");
    text += rows_of(figures["displacements"]) + rows_of(figures["temperatures"]);
    double worst = 0.0;
    for (const auto &[name, one] : figures["displacements"].items()) {
        if (name.back() == 'm') worst = std::max(worst, one["in_window"].get<double>());
    }
    if (worst > 0.0) {
        text += fmt::format(
            "\n  for a measurement of {:g} min: compbox report --budget "
            "eve-um={:.3g}\n",
            window_min, worst);
    }
    for (const auto &remark : figures["remarks"]) text += "\n  " + remark.get<std::string>();
    return text + (figures["remarks"].empty() ? "" : "\n");
}

void plot_etve(const drift_record &record, const std::string &title, const std::string &path) {
    std::vector<double> hours;
    for (const double t : record.time_s) hours.push_back((t - record.time_s.front()) / s_per_h);
    std::string blocks;
    const std::string above = panel_of(hours, record.displacements, true, blocks);
    const bool two = !record.temperatures.empty();
    const std::string below = two ? panel_of(hours, record.temperatures, false, blocks) : "";
    formats::run_gnuplot(
        path,
        fmt::format("{}set multiplot layout {},1 title {}\nset grid lw 0.5 lc rgb '#dddddd'\n"
                    "set key outside right\n"
                    "set lmargin 10\nset rmargin 22\nset xlabel 'time, h'\nset ylabel {}\n{}"
                    "set ylabel {}\n{}unset multiplot\n",
                    blocks, two ? 2 : 1, formats::plot_text(title),
                    formats::plot_text("displacement, µm (µrad)"), above,
                    formats::plot_text("temperature, °C"), below),
        1000, two ? 700 : 400);
}

}  // namespace compbox::test_report
