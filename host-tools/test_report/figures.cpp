// SPDX-License-Identifier: MIT
#include "host-tools/test_report/figures.h"

#include <algorithm>
#include <cmath>

#include "host-tools/fitting/signs.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/straightness.h"
#include "host-tools/test_report/gaps.h"

namespace compbox::test_report {

namespace {

json number(const std::optional<double> &value) {
    return value ? json(*value) : json(nullptr);
}

json direction_json(const metrology::approach_figures &figures) {
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
json positioning_json(const metrology::axis_readings &axis) {
    const auto figures = metrology::evaluate_positioning(axis);
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
json straightness_json(const fitting::measurement &data) {
    json one;
    const auto &x = data.position, &y = data.mean;
    const std::pair<const char *, metrology::straight_line> lines[] = {
        {"end_point", metrology::end_point_line(x, y)},
        {"least_squares", metrology::least_squares_line(x, y)},
        {"minimum_zone", metrology::minimum_zone_line(x, y)}};
    for (const auto &[name, line] : lines) {
        one[name]["deviation"] = metrology::deviation_about(line, x, y);
        if (data.unit == "um") {
            one[name]["slope_urad"] = 1e3 * line.slope;  // um/mm
        } else {
            one[name]["slope_urad_per_mm"] = line.slope;
        }
    }
    return one;
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

}  // namespace

const std::vector<figure> positioning_figures = {
    {"A", "A", "accuracy A", "/positioning/A"},
    {"R", "R", "repeatability R", "/positioning/R"},
    {"E", "E", "systematic error E", "/positioning/E"},
    {"M", "M", "range of mean error M", "/positioning/M"},
    {"B", "B", "reversal B", "/positioning/B"},
    {"A+", "A↑", "forward A", "/positioning/forward/A"},
    {"R+", "R↑", "forward R", "/positioning/forward/R"},
    {"E+", "E↑", "forward E", "/positioning/forward/E"},
    {"A-", "A↓", "backward A", "/positioning/backward/A"},
    {"R-", "R↓", "backward R", "/positioning/backward/R"},
    {"E-", "E↓", "backward E", "/positioning/backward/E"}};

const std::vector<figure> straightness_figures = {
    {"end-point", "end points", "the end-point line", "/straightness/end_point/deviation"},
    {"least-squares", "least squares", "the least-squares line",
     "/straightness/least_squares/deviation"},
    {"minimum-zone", "minimum zone", "the minimum zone", "/straightness/minimum_zone/deviation"}};

const figure &figure_of(const std::string &file, const std::string &key) {
    std::string keys;
    for (const auto *all : {&positioning_figures, &straightness_figures}) {
        for (const figure &one : *all) {
            if (key == one.key) return one;
            keys += (keys.empty() ? "" : ", ") + std::string(one.key);
        }
    }
    throw input_error(file, 0, 0, "'{}' is no figure of a report; the figures are {}", key, keys);
}

std::optional<double> value_of(const json &figures, const figure &one) {
    const json::json_pointer place(one.place);
    if (!figures.contains(place) || figures.at(place).is_null()) return {};
    return figures.at(place).get<double>();
}

metrology::axis_readings readings_of(const fitting::measurement &data) {
    metrology::axis_readings axis;
    axis.target_mm = data.position;
    refuse_gaps(data);
    for (const auto &run : data.runs) {
        auto &side = run.direction < 0 ? axis.backward : axis.forward;
        side.resize(axis.target_mm.size());
        for (std::size_t i = 0; i < run.error.size(); ++i) side[i].push_back(run.error[i]);
    }
    return axis;
}

json figures_of(const fitting::measurement &data) {
    if (data.position.size() < 2)
        throw input_error(data.file, 0, 0, "needs at least two positions");
    json report;
    report["file"] = data.file;
    report["unit"] = data.unit;
    if (data.environment) report["environment"] = formats::environment_text(*data.environment);
    report["positioning"] = positioning_json(readings_of(data));
    report["straightness"] = straightness_json(data);
    const auto warnings = fitting::mirrored_run_warnings(data);
    if (!warnings.empty()) report["warnings"] = warnings;
    return report;
}

json comparison_of(const std::vector<fitting::measurement> &files) {
    json report;
    report["before"] = figures_of(files.front());
    if (files.size() < 2) return report;
    const fitting::measurement &before = files.front(), &after = files.back();
    if (after.unit != before.unit) {
        throw input_error(after.file, 0, 0, "is in another unit than " + before.file);
    }
    report["after"] = figures_of(after);
    compare_travel(report["before"], report["after"]);
    const auto doubled = fitting::doubled_error_warning(before, after);
    if (doubled) report["after"]["warnings"].push_back(*doubled);
    return report;
}

}  // namespace compbox::test_report
