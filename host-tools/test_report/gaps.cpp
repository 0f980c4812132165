// SPDX-License-Identifier: MIT
#include "host-tools/test_report/gaps.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host-tools/formats/error.h"

namespace compbox::test_report {

namespace {

using fitting::measured_run;

std::string run_text(const measured_run &run) {
    const char *way = run.direction == 0 ? "" : run.direction < 0 ? " backward" : " forward";
    return (run.name.empty() ? "the run" : "run '" + run.name + "'") + way;
}

// "300,400"
std::string list_of(const std::vector<double> &targets) {
    std::string text;
    for (const double x : targets) text += (text.empty() ? "" : ",") + fmt::format("{:g}", x);
    return text;
}

bool has(const measured_run &run, double target, double closest) {
    return std::any_of(run.position.begin(), run.position.end(),
                       [&](double x) { return std::fabs(x - target) <= closest; });
}

std::vector<double> missing_in(const measured_run &run, const fitting::measurement &data) {
    const double closest = fitting::closest_positions(data.runs);
    std::vector<double> missing;
    std::copy_if(data.position.begin(), data.position.end(), std::back_inserter(missing),
                 [&](double target) { return !has(run, target, closest); });
    return missing;
}

// out: "--drop-target 300 (10 of 11 targets remain)"; without the option where the list is long
std::string target_remedy(const std::set<double> &missing, std::size_t targets) {
    constexpr std::size_t most_named = 8;
    const std::vector<double> all(missing.begin(), missing.end());
    return fmt::format(
        "{} ({} of {} targets remain)",
        all.size() > most_named ? "leave these targets out" : "--drop-target " + list_of(all),
        targets - all.size(), targets);
}

// out: "--drop-run 3 (8 of 10 runs remain)"
std::string run_remedy(const std::set<std::string> &names, const fitting::measurement &data) {
    const auto remain = std::count_if(data.runs.begin(), data.runs.end(),
                                      [&](const auto &run) { return names.count(run.name) == 0; });
    std::string list;
    for (const auto &name : names) list += (list.empty() ? "" : ",") + name;
    return fmt::format("--drop-run {} ({} of {} runs remain)", list, remain, data.runs.size());
}

// out: whether the measurement had this run
bool drop_run(fitting::measurement &data, const std::string &name) {
    const auto end = std::remove_if(data.runs.begin(), data.runs.end(),
                                    [&](const auto &run) { return run.name == name; });
    const bool found = end != data.runs.end();
    data.runs.erase(end, data.runs.end());
    return found;
}

// out: whether a run of the measurement had this target
bool drop_target(fitting::measurement &data, double target) {
    const double closest = fitting::closest_positions(data.runs);
    bool found = false;
    for (auto &run : data.runs) {
        const auto near = std::find_if(run.position.begin(), run.position.end(),
                                       [&](double x) { return std::fabs(x - target) <= closest; });
        if (near == run.position.end()) continue;
        const auto at = near - run.position.begin();
        run.position.erase(near);
        run.error.erase(run.error.begin() + at);
        run.sigma.erase(run.sigma.begin() + at);
        found = true;
    }
    return found;
}

}  // namespace

void refuse_gaps(const fitting::measurement &data) {
    std::set<double> missing;
    std::set<std::string> names;
    std::string first;
    for (const auto &run : data.runs) {
        const std::vector<double> here = missing_in(run, data);
        if (here.empty()) continue;
        names.insert(run.name);
        missing.insert(here.begin(), here.end());
        if (!first.empty()) continue;
        first = run_text(run) + " has no reading at " +
                (here.size() > 4
                     ? fmt::format("{} of the {} targets", here.size(), data.position.size())
                     : list_of(here) + " mm");
    }
    if (missing.empty()) return;
    throw input_error(data.file, 0, 0,
                      "{}; the figures need a reading of each run at each target: {} or {}", first,
                      target_remedy(missing, data.position.size()), run_remedy(names, data));
}

void drop(std::vector<fitting::measurement> &files, const std::vector<std::string> &runs,
          const std::vector<double> &targets_mm) {
    if (runs.empty() && targets_mm.empty()) return;
    const std::string &first = files.front().file;
    for (const auto &name : runs) {
        bool found = false;
        for (auto &data : files) found |= drop_run(data, name);
        if (!found) throw input_error(first, 0, 0, "has no run '{}'", name);
    }
    for (const double target : targets_mm) {
        bool found = false;
        for (auto &data : files) found |= drop_target(data, target);
        if (!found) throw input_error(first, 0, 0, "has no target at {:g} mm", target);
    }
    for (auto &data : files) {
        const bool gone = std::any_of(data.runs.begin(), data.runs.end(),
                                      [](const auto &run) { return run.position.empty(); });
        if (data.runs.empty() || gone) {
            throw input_error(data.file, 0, 0, "has no readings beside those that are dropped");
        }
        fitting::average_runs(data);
    }
}

}  // namespace compbox::test_report
