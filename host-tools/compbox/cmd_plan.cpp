// SPDX-License-Identifier: MIT
// compbox plan: the three measuring points of a nine-line measurement.
#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/monte_carlo_report.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/identification/plan.h"
#include "host-tools/identification/plan_file.h"
#include "host-tools/identification/plot.h"

namespace compbox {

namespace {

struct plan_arguments {
    std::string box, forbidden, axis = "X", output, plot;
    double sigma_um = 1.0;
    std::vector<double> preset;
    identification::plan_options options;
    monte_carlo_arguments monte_carlo;
    bool as_json = false;
};

constexpr const char *plan_example =
    R"(Evaluates every triple of nodes where a reflector can be mounted, in the axis' own frame. The third
number of each axis is how many nodes it has, ends included, not their distance: -300:300:10 has a
node every 66.7 mm. A box has at most 4000 nodes; that of the example has 1000.

Example:
  compbox plan --box=-300:300:10,-200:200:10,-100:150:10 -o plan.json)";

// "x0:x1:nx,y0:y1:ny,z0:z1:nz" in mm.
identification::grid parse_box(const std::string &text) {
    identification::grid box;
    const char *at = text.data(), *end = at + text.size();
    for (std::size_t k = 0; k < 3; ++k) {
        double count = 0.0;
        for (double *value : {&box.low_mm[k], &box.high_mm[k], &count}) {
            const auto result = std::from_chars(at, end, *value);
            const char *separator = value == &count ? "," : ":";
            const bool last = k == 2 && value == &count;
            if (result.ec != std::errc() || !std::isfinite(*value) ||
                (last ? result.ptr != end : result.ptr == end || *result.ptr != *separator)) {
                throw cli::usage_error("--box",
                                       "must read x0:x1:nx,y0:y1:ny,z0:z1:nz: from and to in mm, "
                                       "and how many nodes, for each axis");
            }
            at = result.ptr + (last ? 0 : 1);
        }
        if (!(count >= 1 && count <= 1000) || count != std::floor(count) ||
            (count > 1 && !(box.low_mm[k] < box.high_mm[k]))) {
            throw cli::usage_error("--box",
                                   "needs low < high, and as third number 1 to 1000 nodes (their "
                                   "count, not a step)");
        }
        box.counts[k] = static_cast<int>(count);
    }
    return box;
}

// Throws input_error for a box with more nodes than the search takes, before any of them is made.
void check_nodes(const identification::grid &box) {
    constexpr double most = 4000.0;
    const double count = 1.0 * box.counts[0] * box.counts[1] * box.counts[2];
    const double largest = std::floor(std::cbrt(most));
    if (count <= most) return;
    throw input_error(fmt::format(
        "--box has {} x {} x {} = {:.0f} nodes, and 3 to {:.0f} can be searched. The third number "
        "of each axis is its count of nodes, not a step: {:.0f} for each axis are enough",
        box.counts[0], box.counts[1], box.counts[2], count, most, largest));
}

// The grid's nodes less those of the forbidden file (columns x_mm, y_mm, z_mm).
std::vector<identification::point_mm> allowed_nodes(const identification::grid &box,
                                                    const std::string &forbidden) {
    auto nodes = box.nodes();
    if (forbidden.empty()) return nodes;
    formats::csv_reading how;
    how.units = formats::units_of_names({"x_mm", "y_mm", "z_mm"});
    const formats::csv_table table = formats::read_csv(forbidden, how);
    const std::size_t x = table.column("x_mm"), y = table.column("y_mm"), z = table.column("z_mm");
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const auto &row = table.rows[r];
        const auto near = [&](const identification::point_mm &node) {
            return std::hypot(node[0] - row[x], node[1] - row[y], node[2] - row[z]) < 1e-6;
        };
        const auto last = std::remove_if(nodes.begin(), nodes.end(), near);
        if (last == nodes.end()) {
            throw input_error(forbidden, table.lines[r], 0, "is not a node of the box");
        }
        nodes.erase(last, nodes.end());
    }
    return nodes;
}

json sigma_json(const identification::six &sigma, double sigma_um) {
    json all;
    for (std::size_t k = 0; k < 3; ++k) all["delta_um"].push_back(sigma[k] * sigma_um);
    for (std::size_t k = 3; k < 6; ++k) all["epsilon_urad"].push_back(sigma[k] * sigma_um);
    return all;
}

// out: the points in mm, sigma of the six errors for the reading's sigma, and how many triples
json plan_json(const plan_arguments &arguments, const identification::grid &box,
               const identification::plan_result &result) {
    const int axis = identification::axis_of(arguments.axis);
    identification::triple_mm points = result.best.front().points;
    const bool solvable = identification::order_for_traditional(points, axis);
    json plan;
    plan["points_mm"] = identification::points_json(points);
    plan["explanation"] = identification::describe(points, box);
    plan["axis"] = arguments.axis;
    plan["reading_sigma_um"] = arguments.sigma_um;
    plan["sigma"] = sigma_json(identification::closed_form_sigma(points), arguments.sigma_um);
    identification::six traditional;
    plan["traditional_solvable"] = solvable;
    if (solvable && identification::traditional_sigma(points, axis, traditional)) {
        plan["traditional_sigma"] = sigma_json(traditional, arguments.sigma_um);
    }
    plan["triples"] = result.triples;
    plan["degenerate_triples"] = result.degenerate;
    for (const auto &triple : result.best) {
        json one;
        one["merit"] = triple.merit;
        one["points_mm"] = identification::points_json(triple.points);
        one["explanation"] = identification::describe(triple.points, box);
        plan["best"].push_back(one);
    }
    return plan;
}

// The closed form checked by runs with noise, at the chosen points.
json check_by_runs(const plan_arguments &arguments, const json &plan, const cli::streams &io) {
    identification::monte_carlo_options options;
    options.axis = identification::axis_of(arguments.axis);
    options.preset = arguments.options.preset;
    options.sigma_um = arguments.sigma_um;
    options.runs = arguments.monte_carlo.runs;
    options.seed = arguments.monte_carlo.seed;
    options.progress = cli::progress_of(io, "runs");
    identification::triple_mm points;
    for (std::size_t p = 0; p < 3; ++p) {
        for (std::size_t k = 0; k < 3; ++k) points[p][k] = plan["points_mm"][p][k].get<double>();
    }
    return monte_carlo_json(identification::monte_carlo(points, options), options);
}

std::string numbers_of(const json &values) {
    std::string text;
    for (const auto &value : values) text += fmt::format("{:10.3f}", value.get<double>());
    return text;
}

// in : plan_json's object. out: the same for reading
std::string plan_text(const json &plan) {
    std::string text = fmt::format("{} triples looked at, {} of them on a line\n\nMeasure at\n",
                                   plan["triples"].dump(), plan["degenerate_triples"].dump());
    for (const auto &point : plan["points_mm"]) text += fmt::format("  {} mm\n", numbers_of(point));
    text += fmt::format(
        "{}\n\n"
        "standard deviation of the results for readings with {} um\n"
        "                 delta x, y, z (um)            epsilon x, y, z (urad)\n"
        "  improved    {}{}\n",
        plan["explanation"].get<std::string>(), plan["reading_sigma_um"].get<double>(),
        numbers_of(plan["sigma"]["delta_um"]), numbers_of(plan["sigma"]["epsilon_urad"]));
    if (!plan.contains("traditional_sigma")) {
        return text + "  traditional  cannot be solved at these points\n";
    }
    return text + fmt::format("  traditional {}{}\n",
                              numbers_of(plan["traditional_sigma"]["delta_um"]),
                              numbers_of(plan["traditional_sigma"]["epsilon_urad"]));
}

// Searches the nodes that are allowed for the best three points, and writes and prints the plan.
void run_plan(plan_arguments &arguments, const cli::streams &io) {
    cli::different_files({{"-o", arguments.output}, {"--plot", arguments.plot}});
    const identification::grid box = parse_box(arguments.box);
    check_nodes(box);
    const auto nodes = allowed_nodes(box, arguments.forbidden);
    if (nodes.size() < 3) {
        throw input_error(fmt::format(
            "--box leaves {} nodes and three are needed: give more nodes for an axis, its third "
            "number",
            nodes.size()));
    }
    for (std::size_t k = 0; k < arguments.preset.size(); ++k) {
        if (arguments.preset[k] == 0.0) {
            throw cli::usage_error("--preset", "a preset error must not be zero");
        }
        arguments.options.preset[k] = std::fabs(arguments.preset[k]);
    }
    arguments.options.progress = cli::progress_of(io, "triples");
    const identification::plan_result result =
        identification::plan_points(nodes, arguments.options);
    if (result.best.empty() || !std::isfinite(result.best.front().merit)) {
        throw input_error("--box: every triple of its nodes lies on one line: give it more nodes");
    }
    json plan = plan_json(arguments, box, result);
    if (arguments.monte_carlo.runs > 0) plan["monte_carlo"] = check_by_runs(arguments, plan, io);
    if (!arguments.plot.empty()) {
        identification::triple_mm points = result.best.front().points;
        identification::order_for_traditional(points, identification::axis_of(arguments.axis));
        identification::plot_plan(points, nodes, arguments.axis, arguments.plot);
    }
    formats::write_file(arguments.output, formats::json_text(plan), &io.out);
    if (arguments.as_json) {
        io.out << formats::json_text(plan);
    } else {
        io.out << plan_text(plan);
        if (plan.contains("monte_carlo")) {
            io.out << "\n" << monte_carlo_table(plan["monte_carlo"]);
        }
    }
}

}  // namespace

void add_plan(cli::command &app) {
    auto arguments = std::make_shared<plan_arguments>();
    cli::command plan = app.add_subcommand("plan", "Choose the points of a nine-line measurement");
    plan.footer(plan_example);
    plan.add_option("--box x0:x1:nx,…", arguments->box,
                    "Grid of nodes: for X, Y and Z from and to in mm and the number of nodes, "
                    "x0:x1:nx,y0:y1:ny,z0:z1:nz")
        .required();
    plan.add_option("--sigma-um S", arguments->sigma_um, "Standard deviation of one reading")
        .check(cli::above_zero());
    plan.add_option("--axis AXIS", arguments->axis,
                    "Axis that will move, which orders the points (X)")
        .check(cli::one_of({"X", "Y", "Z"}));
    const std::map<std::string, identification::criterion> criteria = {
        {"mean-cv", identification::criterion::mean_cv},
        {"a", identification::criterion::a},
        {"d", identification::criterion::d}};
    plan.add_choice("--criterion C", arguments->options.rank_by, criteria,
                    "mean-cv (default): mean of sigma over preset error; a: its mean square; "
                    "d: volume of the confidence ellipsoid");
    plan.add_option("--preset DX,DY,DZ,EX,EY,EZ", arguments->preset,
                    "Size of the six errors looked for, um and urad (1 each)")
        .expected(6)
        .delimiter(',')
        .check(cli::any_number());
    plan.add_option("--forbid F.csv", arguments->forbidden,
                    "Nodes to leave out, CSV x_mm,y_mm,z_mm");
    plan.add_option("--best N", arguments->options.best, "How many triples to list (10)")
        .check(cli::whole_between(1, 1000));
    plan.add_option("--plot F.svg", arguments->plot, "Points in the box, F.svg, F.png or F.pdf");
    add_monte_carlo(plan, arguments->monte_carlo);
    plan.add_flag("--json", arguments->as_json, "Print the plan as JSON");
    plan.add_option("-o,--output PLAN.json", arguments->output, "Plan to write, plan.json")
        .required();
    plan.callback([arguments](const cli::streams &io) { run_plan(*arguments, io); });
}

}  // namespace compbox
