// SPDX-License-Identifier: MIT
#include "host-tools/compbox/simulate_report.h"

#include <algorithm>
#include <cstdio>
#include <functional>

#include "host-tools/compbox/figures.h"

extern "C" {
#include "firmware/mode.h"
}

namespace compbox {

namespace {

// What the report takes over from compboxd's statistics.
constexpr const char *real_time_keys[] = {"cycles",      "overruns",    "period_us", "jitter_us",
                                          "interval_us", "exchange_us", "step_us",   "drift_us",
                                          "realtime",    "box",         "plc"};

constexpr const char *heading = "before   after     less";

using figure = std::function<double(const direction_figures &)>;

// The runs of one method on one path, one for each seed.
std::vector<const simulated_run *> runs_of(const simulation &result, const std::string &method,
                                           const std::string &path) {
    std::vector<const simulated_run *> some;
    for (const auto &run : result.runs) {
        if (run.method == method && run.path == path) some.push_back(&run);
    }
    return some;
}

std::vector<double> values_of(const std::vector<const simulated_run *> &runs, std::size_t direction,
                              const figure &what) {
    std::vector<double> values;
    for (const auto *run : runs) values.push_back(what(run->figures[direction]));
    return values;
}

double median(const std::vector<const simulated_run *> &runs, std::size_t direction,
              const figure &what) {
    return median_of(values_of(runs, direction, what));
}

double lowest(const std::vector<const simulated_run *> &runs, std::size_t direction,
              const figure &what) {
    const auto values = values_of(runs, direction, what);
    return *std::min_element(values.begin(), values.end());
}

double rounded(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4f", value);
    return std::stod(text);
}

json by_axis(const std::function<double(std::size_t)> &value) {
    json object = json::object();
    for (std::size_t a = 0; a < 3; ++a) {
        object[std::string(1, axis_letters[a])] = rounded(value(a));
    }
    return object;
}

json figures_json(const direction_figures &one) {
    return {{"before_um", rounded(one.before_um)},
            {"after_um", rounded(one.after_um)},
            {"reduction_percent", rounded(one.percent())},
            {"mean_um", rounded(one.mean_um)},
            {"variance_um2", rounded(one.variance_um2)},
            {"between_before_um", rounded(one.between_before_um)},
            {"between_after_um", rounded(one.between_after_um)},
            {"between_percent", rounded(one.between_percent())},
            {"remeasured_before_um", rounded(one.remeasured_before_um)},
            {"remeasured_after_um", rounded(one.remeasured_after_um)},
            {"remeasured_percent", rounded(one.remeasured_percent())},
            {"noise_ceiling_percent", rounded(one.ceiling_percent)}};
}

json run_json(const simulated_run &run) {
    json object = {{"seed", run.seed},
                   {"method", run.method},
                   {"path", run.path},
                   {"stops", run.stops_mm.size()},
                   {"coefficients", run.coefficients},
                   {"coefficient_count", run.coefficient_count}};
    for (std::size_t a = 0; a < 3; ++a) {
        object[std::string(1, axis_letters[a])] = figures_json(run.figures[a]);
    }
    return object;
}

// "%-12s" and such, as a string.
template <typename... arguments>
std::string format(const char *pattern, arguments... values) {
    char text[256];
    std::snprintf(text, sizeof text, pattern, values...);
    return text;
}

std::string percent(double value) {
    return format("%6.1f %%", value);
}

// One line with three columns of text, each as wide as the heading above it.
std::string row(const std::string &name, const std::array<std::string, 3> &cells) {
    std::string line = format("  %-22s", name.c_str());
    for (const auto &cell : cells) line += format("  %26s", cell.c_str());
    return line + "\n";
}

std::string percent_row(const std::string &name, const std::function<double(std::size_t)> &value) {
    return row(name, {percent(value(0)), percent(value(1)), percent(value(2))});
}

std::string path_table(const scenario &plan, const simulation &result, const scenario_path &path) {
    const auto own = runs_of(result, plan.methods.front().name, path.name);
    const auto percent_of = [](const direction_figures &f) { return f.percent(); };
    const bool many = own.size() > 1;
    std::string text = "\n" + path.name + ", " + std::to_string(own.front()->stops_mm.size()) +
                       " stops at standstill; true error, range about its least-squares line" +
                       (many ? ", median of " + std::to_string(own.size()) + " machines" : "") +
                       "\n\n";
    text += row("", {"X", "Y", "Z"});
    text +=
        row("", {"before   after     less", "before   after     less", "before   after     less"});
    for (const auto &method : plan.methods) {
        const auto runs = runs_of(result, method.name, path.name);
        std::array<std::string, 3> cells;
        for (std::size_t a = 0; a < 3; ++a) {
            cells[a] = format("%6.1f  %6.2f %s",
                              median(runs, a, [](const auto &f) { return f.before_um; }),
                              median(runs, a, [](const auto &f) { return f.after_um; }),
                              percent(median(runs, a, percent_of)).c_str());
        }
        text += row(method.name, cells);
        if (many) {
            text += percent_row("  worst machine",
                                [&](std::size_t a) { return lowest(runs, a, percent_of); });
        }
    }
    return text;
}

std::string remeasured_table(const scenario &plan, const simulation &result,
                             const scenario_path &path) {
    const auto own = runs_of(result, plan.methods.front().name, path.name);
    std::string text = "\n  " + plan.methods.front().name + ", looked at more closely\n";
    text += percent_row("between the stops too", [&](std::size_t a) {
        return median(own, a, [](const auto &f) { return f.between_percent(); });
    });
    text += percent_row("remeasured by laser", [&](std::size_t a) {
        return median(own, a, [](const auto &f) { return f.remeasured_percent(); });
    });
    text += percent_row("  its noise ceiling", [&](std::size_t a) {
        return median(own, a, [](const auto &f) { return f.ceiling_percent; });
    });
    if (!plan.paper_percent.empty()) {
        text += percent_row("S1, on its XY diagonal", [&](std::size_t a) {
            const auto found = plan.paper_percent.find(std::string(1, axis_letters[a]));
            return found == plan.paper_percent.end() ? 0.0 : found->second;
        });
    }
    return text;
}

// S1's Table 1: what is left after compensation.
std::string residual_table(const scenario &plan, const simulation &result,
                           const scenario_path &path) {
    std::string text = "\n  residual after compensation: range µm, mean µm, variance µm²\n";
    for (const auto &method : plan.methods) {
        const auto runs = runs_of(result, method.name, path.name);
        std::array<std::string, 3> cells;
        for (std::size_t a = 0; a < 3; ++a) {
            cells[a] = format("%7.2f %7.2f %8.2f",
                              median(runs, a, [](const auto &f) { return f.after_um; }),
                              median(runs, a, [](const auto &f) { return f.mean_um; }),
                              median(runs, a, [](const auto &f) { return f.variance_um2; }));
        }
        text += row(method.name, cells);
    }
    return text;
}

std::string motion_table(const motion_figures &motion) {
    if (motion.duration_s == 0.0) return "";
    std::string text = format("\nin real time, %.1f s at %.1f m/min; true error while moving\n\n",
                              motion.duration_s, 1e-3 * motion.feed_mm_per_min);
    std::array<std::string, 3> cells;
    for (std::size_t a = 0; a < 3; ++a) {
        const double before = motion.before_um[a], after = motion.after_um[a];
        cells[a] = format("%6.1f  %6.2f %s", before, after,
                          percent(direction_figures::reduction(before, after)).c_str());
    }
    return text + row("", {"X", "Y", "Z"}) + row("", {heading, heading, heading}) +
           row("compboxd", cells);
}

// What stands under a key of somebody's statistics, where it is of that kind.
double number_at(const json &object, const char *key) {
    const json value = object.is_object() ? object.value(key, json()) : json();
    return value.is_number() ? value.get<double>() : 0.0;
}

std::string text_at(const json &object, const char *key) {
    const json value = object.is_object() ? object.value(key, json()) : json();
    return value.is_string() ? value.get<std::string>() : "";
}

// "p50 75, p99 118, max 4078": one line of a statistic in µs.
std::string spread(const json &statistics, const char *key) {
    const auto value = statistics.find(key);
    if (value == statistics.end() || !value->is_object()) return "not recorded";
    const auto part = [&](const char *name) { return number_at(*value, name); };
    return format("p50 %7.1f   p99 %7.1f   max %7.1f", part("p50"), part("p99"), part("max"));
}

std::string statistics_table(const json &statistics) {
    if (!statistics.is_object()) return "";
    const auto number = [&](const char *key) { return number_at(statistics, key); };
    std::string text =
        format("\ncompboxd: %.0f cycles of %.1f ms, %.0f overrun%s\n\n", number("cycles"),
               1e-3 * number("period_us"), number("overruns"), number("overruns") == 1 ? "" : "s");
    text += "  wake-up jitter, µs       " + spread(statistics, "jitter_us") + "\n";
    text += "  exchange with PLC, µs    " + spread(statistics, "exchange_us") + "\n";
    text += "  one step of the box, µs  " + spread(statistics, "step_us") + "\n";
    return text;
}

// Why the row of the real-time run is not the model's doing, if compensation was interrupted: when
// compboxd left ACTIVE after it had been there, other than when it was asked to stop.
std::string interruptions(const json &statistics) {
    if (!statistics.is_object() || !statistics.contains("history")) return "";
    std::string text;
    bool was_active = false;
    for (const json &entry : statistics["history"]) {
        const std::string mode = text_at(entry, "mode"), reason = text_at(entry, "reason");
        if (reason == cb_reason_text(CB_REASON_STOP)) break;
        if (was_active && mode != "ACTIVE") {
            text += format("  at %.1f s %s: %s\n", number_at(entry, "time_s"), mode.c_str(),
                           reason.c_str());
        }
        was_active = was_active || mode == "ACTIVE";
    }
    if (text.empty()) return "";
    return "\n  compensation was interrupted, which the figures in motion show; is this machine "
           "busy?\n" +
           text;
}

void add_real_time(json &report, const real_time_run &real) {
    for (const char *key : real_time_keys) {
        if (real.statistics.is_object() && real.statistics.contains(key)) {
            report[key] = real.statistics[key];
        }
    }
    if (real.motion.duration_s == 0.0) return;
    report["in_motion"] = {{"duration_s", rounded(real.motion.duration_s)},
                           {"feed_mm_per_min", rounded(real.motion.feed_mm_per_min)},
                           {"before_um", by_axis([&](auto a) { return real.motion.before_um[a]; })},
                           {"after_um", by_axis([&](auto a) { return real.motion.after_um[a]; })}};
}

}  // namespace

json report_json(const scenario &plan, const simulation &result, const real_time_run &real) {
    const std::string path = plan.paths.front().name;
    const std::string own = plan.methods.front().name;
    const auto runs = runs_of(result, own, path);
    const auto percent_of = [](const direction_figures &f) { return f.percent(); };
    const auto median_by_axis = [&](const auto &some, const figure &what) {
        return by_axis([&](std::size_t a) { return median(some, a, what); });
    };
    json seeds = json::array();
    for (const auto *run : runs) seeds.push_back(run->seed);
    json report = {{"format", "compbox-report/1"},
                   {"scenario", plan.name},
                   {"seeds", seeds},
                   {"path", path},
                   {"method", own}};
    report["reduction_percent"] = median_by_axis(runs, percent_of);
    report["reduction_percent_worst"] =
        by_axis([&](std::size_t a) { return lowest(runs, a, percent_of); });
    report["between_percent"] =
        median_by_axis(runs, [](const auto &f) { return f.between_percent(); });
    report["remeasured_percent"] =
        median_by_axis(runs, [](const auto &f) { return f.remeasured_percent(); });
    report["noise_ceiling_percent"] =
        median_by_axis(runs, [](const auto &f) { return f.ceiling_percent; });
    report["baselines"] = json::object();
    for (const auto &method : plan.methods) {
        if (method.name == own) continue;
        report["baselines"][method.name] =
            median_by_axis(runs_of(result, method.name, path), percent_of);
    }
    report["paper_percent"] = plan.paper_percent;
    add_real_time(report, real);
    report["runs"] = json::array();
    for (const auto &run : result.runs) report["runs"].push_back(run_json(run));
    return report;
}

std::string report_text(const scenario &plan, const simulation &result, const real_time_run &real) {
    std::string text = plan.name + "\n";
    for (const auto &path : plan.paths) {
        text += path_table(plan, result, path);
        text += remeasured_table(plan, result, path);
        text += residual_table(plan, result, path);
    }
    return text + motion_table(real.motion) + interruptions(real.statistics) +
           statistics_table(real.statistics);
}

}  // namespace compbox
