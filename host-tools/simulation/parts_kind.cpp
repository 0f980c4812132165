// SPDX-License-Identifier: MIT
// The kind "parts": parts cut and probed on a machine that warms up; its report.
#include <algorithm>
#include <cmath>
#include <functional>

#include "host-tools/formats/file.h"
#include "host-tools/simulation/figures.h"
#include "host-tools/simulation/kinds.h"
#include "host-tools/simulation/protocol_plots.h"
#include "host-tools/simulation/protocols.h"

namespace compbox::simulation {

namespace {

constexpr const char *directions_and_largest[] = {"X", "Y", "Z", "largest"};

using part_figure = std::function<double(const part_figures &, std::size_t)>;

double reduction_percent(const part_figures &f, std::size_t i) {
    return part_figures::reduction(f.before_um[i], f.after_um[i]);
}

double to_thousandths(double value) {
    return std::round(value * 1000.0) / 1000.0;
}

struct series {
    std::vector<const part_result *> runs;

    std::vector<double> values(const part_figure &what, std::size_t i) const {
        std::vector<double> all;
        for (const auto *run : runs) all.push_back(what(run->figures, i));
        return all;
    }
    double median(const part_figure &what, std::size_t i) const {
        return median_of(values(what, i));
    }
    double worst(const part_figure &what, std::size_t i) const {
        const auto all = values(what, i);
        return *std::min_element(all.begin(), all.end());
    }
};

series of(const part_results &results, const std::string &protocol, const std::string &method,
          const std::string &choice) {
    series some;
    for (const auto &run : results.runs) {
        if (run.protocol == protocol && run.method == method && run.choice == choice) {
            some.runs.push_back(&run);
        }
    }
    return some;
}

template <typename function>
json by_name(function value) {
    json object = json::object();
    for (std::size_t i = 0; i < 4; ++i)
        object[directions_and_largest[i]] = to_thousandths(value(i));
    return object;
}

double ceiling(const part_figures &f, std::size_t i) {
    return part_figures::reduction(f.before_um[i], f.unexplained_um[i]);
}

double touched(const part_figures &f, std::size_t i) {
    return part_figures::reduction(f.touched_before_um[i], f.touched_after_um[i]);
}

double touched_ceiling(const part_figures &f, std::size_t i) {
    return part_figures::reduction(f.touched_before_um[i], f.touched_ideal_um[i]);
}

// out: reductions of these runs, %: median, its interval, worst, ceiling, and by the probe
json figures_json(const series &some) {
    const auto median = [&](const part_figure &what) {
        return by_name([&](std::size_t i) { return some.median(what, i); });
    };
    json all;
    all["reduction_percent"] = median(reduction_percent);
    all["reduction_percent_worst"] =
        by_name([&](std::size_t i) { return some.worst(reduction_percent, i); });
    if (median_interval(some.values(reduction_percent, 0))) {
        for (std::size_t i = 0; i < 4; ++i) {
            const interval all_machines = *median_interval(some.values(reduction_percent, i));
            all["reduction_percent_interval"][directions_and_largest[i]] = {
                to_thousandths(all_machines.low), to_thousandths(all_machines.high)};
        }
    }
    all["ceiling_percent"] = median(ceiling);
    all["remeasured_percent"] = median(touched);
    all["noise_ceiling_percent"] = median(touched_ceiling);
    return all;
}

// out: the figures of the first method; the other methods are baselines
json protocol_json(const part_protocol &protocol, const part_results &results) {
    const std::string own = protocol.methods.front().name;
    json all = figures_json(of(results, protocol.name, own, protocol.judge.name));
    all["method"] = own;
    all["baselines"] = json::object();
    for (const auto &method : protocol.methods) {
        if (method.name == own) continue;
        const series some = of(results, protocol.name, method.name, protocol.judge.name);
        all["baselines"][method.name] =
            by_name([&](std::size_t i) { return some.median(reduction_percent, i); });
    }
    for (const auto &[key, list] :
         {std::pair{"also", &protocol.also}, std::pair{"outside", &protocol.outside}}) {
        for (const auto &choice : *list) {
            all[key][choice.name] = figures_json(of(results, protocol.name, own, choice.name));
        }
    }
    return all;
}

// out: the figures of one run for report.json, in µm and %
json run_json(const part_result &run) {
    json one = {{"seed", run.seed},
                {"method", run.method},
                {"protocol", run.protocol},
                {"path", run.choice},
                {"stops", run.points.size()},
                {"coefficients", run.coefficients},
                {"coefficient_count", json::object()}};
    for (std::size_t i = 0; i < 4; ++i) {
        const part_figures &f = run.figures;
        one["errors"][directions_and_largest[i]] = {
            {"before_um", to_thousandths(f.before_um[i])},
            {"after_um", to_thousandths(f.after_um[i])},
            {"reduction_percent", to_thousandths(reduction_percent(f, i))},
            {"ceiling_percent", to_thousandths(ceiling(f, i))},
            {"remeasured_before_um", to_thousandths(f.touched_before_um[i])},
            {"remeasured_after_um", to_thousandths(f.touched_after_um[i])},
            {"remeasured_percent", to_thousandths(touched(f, i))},
            {"noise_ceiling_percent", to_thousandths(touched_ceiling(f, i))}};
    }
    return one;
}

// out: report.json (docs/report.schema.json); the first protocol gives the headline figures
json report_of(const part_scenario &plan, const part_results &results,
               const std::vector<std::uint64_t> &seeds) {
    const part_protocol &first = plan.protocols.front();
    json report = {{"format", "compbox-report/1"},
                   {"scenario", plan.name},
                   {"seeds", seeds},
                   {"path", first.judge.name}};
    const json figures = protocol_json(first, results);
    for (const char *key :
         {"method", "reduction_percent", "reduction_percent_worst", "reduction_percent_interval",
          "ceiling_percent", "remeasured_percent", "noise_ceiling_percent", "baselines"}) {
        if (figures.contains(key)) report[key] = figures[key];
    }
    report["paper_percent"] = {{"largest", plan.paper_percent}};
    for (const auto &protocol : plan.protocols) {
        report["protocols"][protocol.name] = protocol_json(protocol, results);
    }
    report["runs"] = json::array();
    for (const auto &run : results.runs) report["runs"].push_back(run_json(run));
    return report;
}

std::string row_of(const std::string &title, const series &some) {
    std::string text = fmt::format("{:34}", title);
    for (std::size_t i = 0; i < 4; ++i) {
        const auto before = [](const part_figures &f, std::size_t k) { return f.before_um[k]; };
        text += fmt::format("  {:6.1f} {:5.1f} {:5.1f}", some.median(before, i),
                            some.median(reduction_percent, i), some.worst(reduction_percent, i));
    }
    return text + "\n";
}

// out: one protocol as a table: medians and worst values over the seeds, in µm and %
std::string table_of(const part_protocol &protocol, const part_results &results) {
    std::string text = fmt::format(
        "\nprotocol {}: trained on {}, judged by {}\n"
        "largest error before, µm; median and lowest reduction, %\n{:>37}{:>20}{:>20}{:>27}\n",
        protocol.name, protocol.train.day, protocol.judge.name, "X", "Y", "Z", "in space");
    for (const auto &method : protocol.methods) {
        text += row_of(method.name, of(results, protocol.name, method.name, protocol.judge.name));
    }
    const std::string own = protocol.methods.front().name;
    for (const auto *list : {&protocol.also, &protocol.outside}) {
        for (const auto &choice : *list) {
            text += row_of(fmt::format("{}: {}", own, choice.name),
                           of(results, protocol.name, own, choice.name));
        }
    }
    const series judged = of(results, protocol.name, own, protocol.judge.name);
    text += "ceiling by the unexplained part:   ";
    for (std::size_t i = 0; i < 4; ++i) {
        text += fmt::format("{:{}.1f}", judged.median(ceiling, i), i ? 20 : 13);
    }
    text += "\nas the touch probe shows it:       ";
    for (std::size_t i = 0; i < 4; ++i) {
        text += fmt::format("{:{}.1f}", judged.median(touched, i), i ? 20 : 13);
    }
    return text + "\n";
}

}  // namespace

simulate_outcome run_parts(const simulate_request &request) {
    const part_scenario plan = load_part_scenario(request.scenario);
    twin::twin_config machine = twin::load_twin(plan.twin);
    std::vector<std::uint64_t> seeds = request.seeds.empty() ? plan.seeds : request.seeds;
    if (seeds.empty()) seeds.push_back(machine.seed);
    part_results results;
    for (const std::uint64_t seed : seeds) {
        machine.seed = seed;
        run_part_protocols(plan, machine, fmt::format("{}/seed-{}", request.folder, seed),
                           request.commands, request.progress, results);
    }
    if (!request.plots.empty()) plot_parts(plan, results, request.plots);
    simulate_outcome outcome;
    outcome.report = report_of(plan, results, seeds);
    outcome.text = plan.name + "\n";
    for (const auto &protocol : plan.protocols) outcome.text += table_of(protocol, results);
    outcome.warnings = results.warnings;
    return outcome;
}

}  // namespace compbox::simulation
