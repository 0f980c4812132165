// SPDX-License-Identifier: MIT
#include "host-tools/test_report/drift_report.h"

#include <fmt/core.h>

#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/formats/plot.h"

namespace compbox::test_report {

namespace {

using metrology::drift_options;
using metrology::model_drift;
using metrology::residual_series;

// out: one sentence: whether, when and by how much the model has drifted
std::string finding_of(const model_drift &drift, const drift_options &options) {
    if (drift.reference == 0) {
        return fmt::format("{} periods are too few to notice a drift (10 are needed)",
                           drift.periods.size());
    }
    if (!drift.noticed) {
        return fmt::format(
            "no drift: the means stay with those of the first {} periods "
            "({:.2f} um, standard deviation {:.2f} um)",
            drift.reference, drift.mean_um, drift.spread_um);
    }
    return fmt::format(
        "the model has drifted since {}: noticed on {}, {:+.2f} um from the mean of the first {} "
        "periods ({:.2f} um, standard deviation {:.2f} um); train it again with newer rows",
        period_name(drift.periods[*drift.since], options),
        period_name(drift.periods[*drift.noticed], options), drift.change_um, drift.reference,
        drift.mean_um, drift.spread_um);
}

std::string table_of(const residual_series &series, const model_drift &drift,
                     const drift_options &options) {
    std::string text = fmt::format(
        "{}: {} measurements, {}\n  {:<12}{:>8}{:>9}{:>9}{:>9}{:>9}{:>9}\n", series.name,
        series.time_s.size(), series.what, "", "number", "mean", "rms", "95 %", "largest", "CUSUM");
    for (const auto &period : drift.periods) {
        const double sum = period.up >= period.down ? period.up : -period.down;
        text += fmt::format("  {:<12}{:>8}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.1f}\n",
                            period_name(period, options), period.count, period.mean_um,
                            period.rms_um, period.p95_um, period.largest_um, sum);
    }
    return text + finding_of(drift, options) + "\n";
}

// out: the periods with their figures, and when a drift began and was noticed (null: never)
json json_of(const model_drift &drift, const drift_options &options) {
    json report{{"periods", json::array()},
                {"reference_periods", drift.reference},
                {"finding", finding_of(drift, options)}};
    for (const auto &period : drift.periods) {
        report["periods"].push_back({{"period", period_name(period, options)},
                                     {"count", period.count},
                                     {"mean_um", formats::five_digits(period.mean_um)},
                                     {"rms_um", formats::five_digits(period.rms_um)},
                                     {"p95_um", formats::five_digits(period.p95_um)},
                                     {"largest_um", formats::five_digits(period.largest_um)},
                                     {"cusum_up", formats::five_digits(period.up)},
                                     {"cusum_down", formats::five_digits(period.down)}});
    }
    report["drifted_since"] = nullptr, report["noticed"] = nullptr;
    if (drift.noticed) {
        report["drifted_since"] = period_name(drift.periods[*drift.since], options);
        report["noticed"] = period_name(drift.periods[*drift.noticed], options);
        report["change_um"] = formats::five_digits(drift.change_um);
    }
    return report;
}

// out: a panel with each residual and the means of the periods, and a line where the drift began
void add_panel(std::string &data, std::string &panels, const residual_series &series,
               const model_drift &drift, const drift_options &options) {
    const double zero_s = drift.periods.front().start_s;
    const auto number = [&](double time_s) { return (time_s - zero_s) / options.period_s + 1.0; };
    std::vector<double> x, mean_x, mean, spread;
    for (const double time_s : series.time_s) x.push_back(number(time_s));
    for (const auto &period : drift.periods) {
        mean_x.push_back(number(period.start_s) + 0.5), mean.push_back(period.mean_um);
        spread.push_back(period.rms_um);
    }
    const std::string name = fmt::format("all{}", data.size());
    data += formats::plot_data(name, {x, series.left_um});
    data += formats::plot_data("of_" + name, {mean_x, mean, spread});
    panels += fmt::format("set ylabel {}\nunset arrow\n",
                          formats::plot_text(series.name + ", residual, um"));
    if (drift.since) {
        panels += fmt::format(
            "set arrow from {0},graph 0 to {0},graph 1 nohead lw 1.6 dt 2 lc rgb '{1}'\n",
            number(drift.periods[*drift.since].start_s), formats::plot_colour::second);
    }
    panels += fmt::format(
        "plot 0 with lines lw 0.8 lc rgb '#444444' notitle, ${0} using 1:2 with points pt 7 ps "
        "0.25 lc rgb '{1}' title 'each probe', $of_{0} using 1:2 with linespoints pt 7 ps 0.5 lw 2 "
        "lc rgb '{2}' title 'mean'\n",
        name, formats::plot_colour::grey, formats::plot_colour::curve);
}

}  // namespace

std::vector<series_drift> drifts_of(const std::vector<residual_series> &all,
                                    const drift_options &options) {
    std::vector<series_drift> drifts;
    for (const auto &series : all) drifts.push_back({series, drift_of(series, options)});
    return drifts;
}

json drift_figures(const std::vector<series_drift> &all, const drift_options &options) {
    json figures;
    for (const auto &[series, drift] : all) figures[series.name] = json_of(drift, options);
    return figures;
}

std::string drift_text(const std::vector<series_drift> &all, const drift_options &options) {
    std::string text;
    for (const auto &[series, drift] : all) text += table_of(series, drift, options);
    return text;
}

void plot_drifts(const std::vector<series_drift> &all, const drift_options &options,
                 const std::string &path) {
    std::string data, panels;
    for (const auto &[series, drift] : all) add_panel(data, panels, series, drift, options);
    data += fmt::format(
        "set multiplot layout {},1\nset border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\nset xlabel '{}'\nset lmargin 10\n{}unset "
        "multiplot\n",
        all.size(), options.period_s > 86400.0 ? "week" : "day", panels);
    formats::run_gnuplot(path, data, 1000, 80 + 340 * static_cast<int>(all.size()));
}

}  // namespace compbox::test_report
