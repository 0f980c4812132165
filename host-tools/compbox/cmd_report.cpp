// SPDX-License-Identifier: MIT
// compbox report: ISO 230-1 and 230-2 figures of a measurement, before and after.
#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/fitting/report_plot.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/straightness.h"

namespace compbox {

namespace {

struct report_arguments {
    std::string before, after, plot, output;
    reading_options reading;
    bool as_json = false;
};

constexpr const char *report_example =
    R"(Computes positioning by ISO 230-2 and straightness by ISO 230-1 from the same readings; use the
one that the set-up measured.

Example:
  compbox report before.rtl --after after.rtl --plot report.svg)";

json number(const std::optional<double> &value) {
    return value ? json(*value) : json(nullptr);
}

json direction_json(const approach_figures &figures) {
    json one;
    one["E"] = figures.E;
    one["A"] = number(figures.A);
    one["R"] = number(figures.R);
    for (const auto &target : figures.targets) {
        one["mean"].push_back(target.mean);
        one["s"].push_back(number(target.s));
    }
    return one;
}

// out: ISO 230-2 figures in the file's unit; null where the runs do not suffice for one
json positioning_json(const axis_readings &axis) {
    const auto figures = evaluate_positioning(axis);
    json one;
    one["targets_mm"] = axis.target_mm;
    one["runs_forward"] = axis.runs_forward();
    one["runs_backward"] = axis.runs_backward();
    for (const auto &[name, value] : {std::pair{"A", figures.A},
                                      {"R", figures.R},
                                      {"E", figures.E},
                                      {"M", figures.M},
                                      {"B", figures.B},
                                      {"B_mean", figures.B_mean}}) {
        one[name] = number(value);
    }
    if (figures.forward) one["forward"] = direction_json(*figures.forward);
    if (figures.backward) one["backward"] = direction_json(*figures.backward);
    if (!figures.reversal.empty()) one["reversal"] = figures.reversal;
    if (!figures.repeatability.empty()) one["repeatability"] = figures.repeatability;
    one["conforming"] = figures.remarks.empty();
    one["remarks"] = figures.remarks;
    if (figures.long_axis) {
        one["remarks"].push_back(
            "axis over 2000 mm with fewer than 5 runs: E, M and B only, "
            "A and R take 5 runs over 2000 mm of the working range");
    }
    return one;
}

// out: deviation and slope about each of the three reference lines of ISO 230-1
json straightness_json(const measurement &data) {
    json one;
    const auto &x = data.position, &y = data.mean;
    const std::pair<const char *, straight_line> lines[] = {
        {"end_point", end_point_line(x, y)},
        {"least_squares", least_squares_line(x, y)},
        {"minimum_zone", minimum_zone_line(x, y)}};
    for (const auto &[name, line] : lines) {
        one[name]["deviation"] = deviation_about(line, x, y);
        if (data.unit == "um") {
            one[name]["slope_urad"] = 1e3 * line.slope;  // um/mm
        } else {
            one[name]["slope_urad_per_mm"] = line.slope;
        }
    }
    return one;
}

json report_of_file(const std::string &path, const reading_options &reading) {
    const measurement data = read_measurement(path, reading);
    if (data.position.size() < 2) throw input_error(path, 0, 0, "needs at least two positions");
    json report;
    report["file"] = path;
    report["unit"] = data.unit;
    if (data.environment) report["environment"] = environment_text(*data.environment);
    report["positioning"] = positioning_json(readings_of(data));
    report["straightness"] = straightness_json(data);
    return report;
}

// Every figure grows with the travel, so different travels are not comparable.
void compare_travel(const json &before, json &after) {
    const auto ends = [](const json &report) {
        const auto x = report["positioning"]["targets_mm"].get<std::vector<double>>();
        const auto [low, high] = std::minmax_element(x.begin(), x.end());
        return std::pair{*low, *high};
    };
    const auto [low, high] = ends(before);
    const auto [after_low, after_high] = ends(after);
    const double apart = std::max(std::abs(after_low - low), std::abs(after_high - high));
    if (apart <= 0.05 * (high - low)) return;
    after["positioning"]["remarks"].push_back(fmt::format(
        "measured from {:g} to {:g} mm, before from {:g} to {:g} mm: what is less is not by the "
        "compensation alone",
        after_low, after_high, low, high));
}

std::string cell_of(const json &value) {
    return value.is_null() ? fmt::format("{:>12}", "-")
                           : fmt::format("{:12.3f}", value.get<double>());
}

// out: a row of the table: a figure of the first file, and of the second if there is one
std::string row_of(const std::string &name, const json &before, const json *after) {
    std::string row = fmt::format("  {:34}{}", name, cell_of(before));
    if (after != nullptr) row += cell_of(*after);
    if (after != nullptr && !before.is_null() && !after->is_null() && before.get<double>() != 0.0) {
        row +=
            fmt::format("{:10.1f} %", 100.0 * (1.0 - after->get<double>() / before.get<double>()));
    }
    return row + "\n";
}

// in : report["before"] and report["after"] of run_report, the latter may be null
// out: the table for reading, and the remarks on both files
std::string report_text(const json &before, const json *after) {
    std::string text =
        fmt::format("  {:34}{:>12}", before["unit"] == "um" ? "figures in um" : "figures in urad",
                    after ? "before" : "");
    if (after != nullptr) text += fmt::format("{:>12}{:>12}", "after", "less");
    text += "\n\n  positioning, ISO 230-2\n";
    const std::pair<const char *, const char *> rows[] = {{"A", "accuracy A"},
                                                          {"R", "repeatability R"},
                                                          {"E", "systematic error E"},
                                                          {"M", "range of mean error M"},
                                                          {"B", "reversal B"}};
    const auto in = [](const json &report, const char *part, const char *key) -> const json & {
        static const json none;
        return report[part].contains(key) ? report[part][key] : none;
    };
    for (const auto &[key, name] : rows) {
        const json *second = after ? &in(*after, "positioning", key) : nullptr;
        text += row_of(name, in(before, "positioning", key), second);
    }
    for (const char *direction : {"forward", "backward"}) {
        if (!before["positioning"].contains(direction)) continue;
        for (const char *key : {"A", "R", "E"}) {
            const bool there = after && (*after)["positioning"].contains(direction);
            text +=
                row_of(fmt::format("{} {}", direction, key), before["positioning"][direction][key],
                       there ? &(*after)["positioning"][direction][key] : nullptr);
        }
    }
    text += "\n  straightness of the mean, ISO 230-1, about\n";
    for (const auto &[key, name] : {std::pair{"end_point", "the end-point line"},
                                    {"least_squares", "the least-squares line"},
                                    {"minimum_zone", "the minimum zone"}}) {
        text += row_of(name, before["straightness"][key]["deviation"],
                       after ? &(*after)["straightness"][key]["deviation"] : nullptr);
    }
    for (const json *report : {&before, after}) {
        if (report == nullptr) continue;
        if (report->contains("environment")) {
            text += fmt::format("\n  {}: {}", (*report)["file"].get<std::string>(),
                                (*report)["environment"].get<std::string>());
        }
        for (const auto &remark : (*report)["positioning"]["remarks"]) {
            text += fmt::format("\n  {}: {}", (*report)["file"].get<std::string>(),
                                remark.get<std::string>());
        }
    }
    return text + "\n";
}

// Reports one file, or two and their difference, as text or JSON. Throws input_error where the
// units differ.
void run_report(const report_arguments &arguments, const cli::streams &io) {
    json report;
    report["before"] = report_of_file(arguments.before, arguments.reading);
    const bool both = !arguments.after.empty();
    if (both) {
        report["after"] = report_of_file(arguments.after, arguments.reading);
        if (report["after"]["unit"] != report["before"]["unit"]) {
            throw input_error(arguments.after, 0, 0, "is in another unit than " + arguments.before);
        }
        compare_travel(report["before"], report["after"]);
    }
    if (!arguments.plot.empty()) {
        std::vector<measurement> data{read_measurement(arguments.before, arguments.reading)};
        if (both) data.push_back(read_measurement(arguments.after, arguments.reading));
        plot_report(data, arguments.plot);
    }
    if (!arguments.output.empty()) write_file(arguments.output, json_text(report), &io.out);
    if (arguments.as_json) {
        io.out << json_text(report);
    } else {
        io.out << report_text(report["before"], both ? &report["after"] : nullptr);
    }
}

}  // namespace

void add_report(cli::command &app) {
    auto arguments = std::make_shared<report_arguments>();
    cli::command report =
        app.add_subcommand("report", "ISO 230-1 and 230-2 figures, before and after");
    report.footer(report_example);
    report.add_option("DATA", arguments->before, "Measurement, DATA.csv or DATA.rtl").required();
    report.add_option("--after DATA.csv", arguments->after, "The same after compensation");
    add_unit(report, arguments->reading);
    report.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    report
        .add_option("--columns position_mm,error_um,run,…", arguments->reading.columns,
                    "Names of the columns of a file without a header")
        .delimiter(',');
    report.add_flag("--json", arguments->as_json, "Print the figures as JSON");
    report.add_option("-o,--output F.json", arguments->output, "Write the figures as JSON, F.json");
    report.callback([arguments](const cli::streams &io) { run_report(*arguments, io); });
}

}  // namespace compbox
