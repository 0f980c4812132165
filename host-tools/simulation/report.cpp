// SPDX-License-Identifier: MIT
#include "host-tools/simulation/report.h"

#include <algorithm>
#include <functional>

#include "host-tools/simulation/figures.h"
#include "host-tools/simulation/real_time.h"
#include "host-tools/simulation/table.h"

namespace compbox::simulation {

using namespace table;

namespace {

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

// out: the figures of one direction, µm and %
json figures_json(const direction_figures &one) {
    return {{"before_um", rounded(one.before_um)},
            {"after_um", rounded(one.after_um)},
            {"reduction_percent", rounded(one.percent())},
            {"largest_before_um", rounded(one.largest_before_um)},
            {"largest_after_um", rounded(one.largest_after_um)},
            {"mean_um", rounded(one.mean_um)},
            {"variance_um2", rounded(one.variance_um2)},
            {"between_before_um", rounded(one.between_before_um)},
            {"between_after_um", rounded(one.between_after_um)},
            {"between_percent", rounded(one.between_percent())},
            {"remeasured_before_um", rounded(one.remeasured_before_um)},
            {"remeasured_after_um", rounded(one.remeasured_after_um)},
            {"remeasured_percent", rounded(one.remeasured_percent())},
            {"ceiling_percent", rounded(one.ceiling_percent)},
            {"noise_ceiling_percent", rounded(one.noise_ceiling_percent)}};
}

// out: A and R of one direction of approach; null across the path
json iso_json(const direction_figures &one) {
    if (!(one.A_before_um > 0.0)) return nullptr;
    return {{"A_before_um", rounded(one.A_before_um)},
            {"A_after_um", rounded(one.A_after_um)},
            {"R_before_um", rounded(one.R_before_um)},
            {"R_after_um", rounded(one.R_after_um)}};
}

json run_json(const simulated_run &run, const std::string &letters) {
    json object = {{"seed", run.seed},
                   {"method", run.method},
                   {"path", run.path},
                   {"stops", run.stops_mm.size()},
                   {"coefficients", run.coefficients},
                   {"coefficient_count", run.coefficient_count}};
    for (const char letter : letters) {
        const auto &one = run.figures[static_cast<std::size_t>(twin::axis_index(letter))];
        json &figures = object[std::string(1, letter)] = figures_json(one);
        const json iso = iso_json(one);
        if (!iso.is_null()) figures["iso_230_2"] = iso;
    }
    return object;
}

const char *figure_text(path_figure judged) {
    switch (judged) {
        case path_figure::straightness:
            return "range about its least-squares line";
        case path_figure::range:
            return "range";
        case path_figure::axis:
            break;
    }
    return "range along the path, straightness across it";
}

// out: a row for each method: median error before and after, µm, and reduction, %
std::string path_table(const scenario &plan, const simulation &result, const scenario_path &path) {
    const auto own = runs_of(result, plan.methods.front().name, path.name);
    const auto percent_of = [](const direction_figures &f) { return f.percent(); };
    const bool many = own.size() > 1;
    std::string text = fmt::format(
        "\n{}, {} stops at standstill; true error, {}{}\n\n{}", path.name,
        own.front()->stops_mm.size(), figure_text(path.figure),
        many ? fmt::format(", median of {} machines", own.size()) : "", headings(plan.directions));
    for (const auto &method : plan.methods) {
        const auto runs = runs_of(result, method.name, path.name);
        text += row(method.name, plan.directions, [&](std::size_t a) {
            return fmt::format("{:6.1f}  {:6.2f} {}",
                               median(runs, a, [](const auto &f) { return f.before_um; }),
                               median(runs, a, [](const auto &f) { return f.after_um; }),
                               percent(median(runs, a, percent_of)));
        });
        const auto interval_text = [&](std::size_t a) {
            const auto all = median_interval(values_of(runs, a, percent_of));
            return all ? fmt::format("{:.1f} to {:.1f} %", all->low, all->high) : "";
        };
        if (!interval_text(0).empty())
            text += row("  95 % of the median", plan.directions, interval_text);
        if (many) {
            text += percent_row("  worst machine", plan.directions,
                                [&](std::size_t a) { return lowest(runs, a, percent_of); });
        }
    }
    return text;
}

// out: reductions of the product's method, %: ceiling, between the stops, by laser, the paper's
std::string remeasured_table(const scenario &plan, const simulation &result,
                             const scenario_path &path) {
    const auto own = runs_of(result, plan.methods.front().name, path.name);
    const auto line = [&](const char *name, const figure &what) {
        return percent_row(name, plan.directions,
                           [&](std::size_t a) { return median(own, a, what); });
    };
    std::string text = fmt::format("\n  {}, looked at more closely\n", plan.methods.front().name);
    text += line("its ceiling", [](const auto &f) { return f.ceiling_percent; });
    text += line("between the stops too", [](const auto &f) { return f.between_percent(); });
    text += line("remeasured by laser", [](const auto &f) { return f.remeasured_percent(); });
    text += line("  its noise ceiling", [](const auto &f) { return f.noise_ceiling_percent; });
    if (!plan.paper_percent.empty()) {
        text += percent_row("the paper", plan.directions, [&](std::size_t a) {
            const auto found = plan.paper_percent.find(std::string(1, twin::axis_letters[a]));
            return found == plan.paper_percent.end() ? 0.0 : found->second;
        });
    }
    return text;
}

// out: S2's Table 7: accuracy, repeatability and straightness by the laser; "" for no axis' path
std::string iso_table(const scenario &plan, const simulation &result, const scenario_path &path) {
    const auto own = runs_of(result, plan.methods.front().name, path.name);
    const auto along = static_cast<std::size_t>(path.along);
    if (!(own.front()->figures[along].A_before_um > 0.0)) return "";
    const auto line = [&](const std::string &name, std::size_t a, const figure &before,
                          const figure &after) {
        return fmt::format("  {:30}  {:9.2f} {:9.2f}\n", name, median(own, a, before),
                           median(own, a, after));
    };
    std::string text = fmt::format(
        "\n  remeasured by laser, {}; one direction of approach, µm\n  {:30}  {:>9} {:>9}\n",
        plan.methods.front().name, "", "before", "after");
    text += line(
        "accuracy A (ISO 230-2)", along, [](const auto &f) { return f.A_before_um; },
        [](const auto &f) { return f.A_after_um; });
    text += line(
        "repeatability R (ISO 230-2)", along, [](const auto &f) { return f.R_before_um; },
        [](const auto &f) { return f.R_after_um; });
    for (std::size_t a = 0; a < 3; ++a) {
        if (a == along) continue;
        text += line(
            fmt::format("straightness towards {}", twin::axis_letters[a]), a,
            [](const auto &f) { return f.remeasured_before_um; },
            [](const auto &f) { return f.remeasured_after_um; });
    }
    return text;
}

// out: S1's Table 1, the residual after compensation
std::string residual_table(const scenario &plan, const simulation &result,
                           const scenario_path &path) {
    std::string text = "\n  residual after compensation: range µm, mean µm, variance µm²\n";
    for (const auto &method : plan.methods) {
        const auto runs = runs_of(result, method.name, path.name);
        text += row(method.name, plan.directions, [&](std::size_t a) {
            return fmt::format("{:7.2f} {:7.2f} {:8.2f}",
                               median(runs, a, [](const auto &f) { return f.after_um; }),
                               median(runs, a, [](const auto &f) { return f.mean_um; }),
                               median(runs, a, [](const auto &f) { return f.variance_um2; }));
        });
    }
    return text;
}

// The runs in motion along one path at one feed.
std::vector<const moving_run *> moving_runs(const simulation &result, const std::string &path,
                                            double feed_mm_per_min) {
    std::vector<const moving_run *> some;
    for (const auto &run : result.moving) {
        if (run.path == path && run.feed_mm_per_min == feed_mm_per_min) some.push_back(&run);
    }
    return some;
}

std::vector<double> moving_percent(const std::vector<const moving_run *> &runs, std::size_t a) {
    std::vector<double> values;
    for (const auto *run : runs) {
        values.push_back(direction_figures::reduction(run->before_um[a], run->after_um[a]));
    }
    return values;
}

// out: a row for each path and feed: median ranges in motion, µm; "" without feeds
std::string moving_table(const scenario &plan, const simulation &result) {
    std::string text;
    for (const auto &path : plan.paths) {
        for (const double feed : plan.moving_mm_per_min) {
            const auto runs = moving_runs(result, path.name, feed);
            if (text.empty()) {
                text = fmt::format("\nin motion, virtual time; true error on the way, {}\n\n{}",
                                   plan.methods.front().name, headings(plan.directions));
            }
            text += row(fmt::format("{}, {:.1f} m/min", path.name, 1e-3 * feed), plan.directions,
                        [&](std::size_t a) {
                            std::vector<double> before, after;
                            for (const auto *run : runs) {
                                before.push_back(run->before_um[a]);
                                after.push_back(run->after_um[a]);
                            }
                            return fmt::format("{:6.1f}  {:6.2f} {}", median_of(before),
                                               median_of(after),
                                               percent(median_of(moving_percent(runs, a))));
                        });
        }
    }
    return text;
}

// out: median and lowest figures of the product's method over the seeds; medians of the others
json path_json(const scenario &plan, const simulation &result, const std::string &path) {
    const auto runs = runs_of(result, plan.methods.front().name, path);
    const auto percent_of = [](const direction_figures &f) { return f.percent(); };
    const auto medians = [&](const figure &what) {
        return by_axis(plan.directions, [&](std::size_t a) { return median(runs, a, what); });
    };
    json object;
    object["reduction_percent"] = medians(percent_of);
    object["reduction_percent_worst"] =
        by_axis(plan.directions, [&](std::size_t a) { return lowest(runs, a, percent_of); });
    const json intervals = intervals_by_axis(plan.directions, [&](std::size_t a) {
        return median_interval(values_of(runs, a, percent_of));
    });
    if (!intervals.is_null()) object["reduction_percent_interval"] = intervals;
    object["ceiling_percent"] = medians([](const auto &f) { return f.ceiling_percent; });
    object["between_percent"] = medians([](const auto &f) { return f.between_percent(); });
    object["remeasured_percent"] = medians([](const auto &f) { return f.remeasured_percent(); });
    object["noise_ceiling_percent"] =
        medians([](const auto &f) { return f.noise_ceiling_percent; });
    object["baselines"] = json::object();
    for (const auto &method : plan.methods) {
        if (&method == &plan.methods.front()) continue;
        const auto others = runs_of(result, method.name, path);
        object["baselines"][method.name] =
            by_axis(plan.directions, [&](std::size_t a) { return median(others, a, percent_of); });
    }
    return object;
}

// out: an object for each path and feed: median and lowest reduction, %
json moving_json(const scenario &plan, const simulation &result) {
    json list = json::array();
    for (const auto &path : plan.paths) {
        for (const double feed : plan.moving_mm_per_min) {
            const auto runs = moving_runs(result, path.name, feed);
            std::vector<double> leads;
            for (const auto *run : runs) leads.push_back(run->lead_ms);
            list.push_back(
                {{"path", path.name},
                 {"feed_mm_per_min", feed},
                 {"lead_ms", rounded(median_of(leads))},
                 {"reduction_percent",
                  by_axis(plan.directions,
                          [&](std::size_t a) { return median_of(moving_percent(runs, a)); })},
                 {"reduction_percent_worst", by_axis(plan.directions, [&](std::size_t a) {
                      const auto values = moving_percent(runs, a);
                      return *std::min_element(values.begin(), values.end());
                  })}});
        }
    }
    return list;
}

}  // namespace

// out: report.json (docs/report.schema.json); the first path and method give the headline figures
json report_json(const scenario &plan, const simulation &result, const real_time_run &real) {
    const std::string path = plan.paths.front().name, own = plan.methods.front().name;
    json seeds = json::array();
    for (const auto *run : runs_of(result, own, path)) seeds.push_back(run->seed);
    json report = {{"format", "compbox-report/1"},
                   {"scenario", plan.name},
                   {"seeds", seeds},
                   {"path", path},
                   {"method", own}};
    report.update(path_json(plan, result, path));
    report["paper_percent"] = plan.paper_percent;
    report["paths"] = json::object();
    for (const auto &one : plan.paths) {
        report["paths"][one.name] = path_json(plan, result, one.name);
    }
    if (!result.moving.empty()) report["moving"] = moving_json(plan, result);
    add_real_time(report, real);
    report["runs"] = json::array();
    for (const auto &run : result.runs) report["runs"].push_back(run_json(run, plan.directions));
    return report;
}

std::string report_text(const scenario &plan, const simulation &result, const real_time_run &real) {
    std::string text = plan.name + "\n";
    for (const auto &path : plan.paths) {
        text += path_table(plan, result, path);
        text += remeasured_table(plan, result, path);
        text += iso_table(plan, result, path);
        text += residual_table(plan, result, path);
    }
    return text + moving_table(plan, result) + real_time_text(real);
}

}  // namespace compbox::simulation
