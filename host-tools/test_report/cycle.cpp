// SPDX-License-Identifier: MIT
#include "host-tools/test_report/cycle.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/json.h"
#include "host-tools/metrology/targets.h"

namespace compbox::test_report {

namespace {

// Index of a run's first reading in the order of measurement.
std::size_t first_measured(const fitting::measured_run &run) {
    return run.direction < 0 ? run.position.size() - 1 : 0;
}

}  // namespace

std::optional<formats::repeated_target> take_off_repeat(fitting::measurement &data) {
    if (data.about.repeated) return data.about.repeated;
    const auto &runs = data.runs;
    if (runs.size() < 2 || runs.back().position.size() != 1) return {};
    const bool others_are_whole = std::all_of(
        runs.begin(), runs.end() - 1, [](const auto &run) { return run.position.size() > 1; });
    if (!others_are_whole) return {};
    const fitting::measured_run &first = runs.front(), &again = runs.back();
    const std::size_t at = first_measured(first);
    if (std::fabs(again.position[0] - first.position[at]) > fitting::closest_positions(runs)) {
        return {};
    }
    const formats::repeated_target repeated{first.position[at], first.error[at], again.error[0]};
    data.runs.pop_back();
    fitting::average_runs(data);
    return repeated;
}

void add_cycle(json &figures, const std::optional<formats::repeated_target> &repeated,
               std::optional<double> period_mm) {
    json &remarks = figures["positioning"]["remarks"];
    if (repeated) {
        const double change = repeated->again - repeated->first;
        figures["drift"] = {{"target_mm", repeated->position_mm},
                            {"first", repeated->first},
                            {"again", repeated->again},
                            {"change", change}};
        remarks.push_back(fmt::format(
            "the first target, {:g} mm, read {:+.2f} {} more at the end: drift of the measurement",
            repeated->position_mm, change, figures["unit"].get<std::string>()));
    }
    const auto targets = figures["positioning"]["targets_mm"].get<std::vector<double>>();
    const std::string hidden = metrology::hidden_period(targets, period_mm);
    if (!hidden.empty()) remarks.push_back(hidden);
}

}  // namespace compbox::test_report
