// SPDX-License-Identifier: MIT
// compbox plan: the measuring points of a nine-line measurement.
#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/line_sigma.h"
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
    std::string box, given, forbidden, axis = "X", output, plot;
    std::vector<double> sigma_um;  // empty: 1 µm
    std::vector<double> preset;
    identification::plan_options options;
    monte_carlo_arguments monte_carlo;
    bool as_json = false;
};

constexpr const char *plan_example =
    R"(Evaluates every triple of nodes where a reflector can be mounted, in the axis' own frame, by
what identify will solve. The third number of each axis is how many nodes it has, ends included, not
their distance: -300:300:10 has a node every 66.7 mm. A box has at most 4000 nodes; that of the
example has 1000. --points instead judges three or more points of your own.

Example:
  compbox plan --box=-300:300:10,-200:200:10,-100:150:10 --axis X --sigma-um 0.2,1.5 -o plan.json)";

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

json sigma_json(const identification::six &sigma) {
    json all;
    for (std::size_t k = 0; k < 3; ++k) all["delta_um"].push_back(sigma[k]);
    for (std::size_t k = 3; k < 6; ++k) all["epsilon_urad"].push_back(sigma[k]);
    return all;
}

// in : points in the order to measure them; `traditional`, sigma of that method, if solvable
// out: the points in mm, sigma of the six errors, and what they belong to
json points_report(const plan_arguments &arguments, const identification::points_mm &points,
                   const identification::six *traditional) {
    const identification::plan_options &options = arguments.options;
    const bool separate = options.model.lines == identification::setups::separate;
    json plan;
    plan["points_mm"] = identification::points_json(points);
    plan["axis"] = arguments.axis;
    plan["setups"] = separate ? "separate" : "common";
    if (separate) plan["positions"] = options.model.positions;
    plan["reading_sigma_um"] = options.along_um;
    if (options.along_um != options.across_um) {
        plan["reading_sigma_um"] = {options.along_um, options.across_um};
    }
    plan["sigma"] = sigma_json(identification::planned_sigma(points, options));
    plan["traditional_solvable"] = traditional != nullptr;
    if (traditional) plan["traditional_sigma"] = sigma_json(*traditional);
    return plan;
}

// out: report of the best triple, how many triples there are, and the list of the best
json search_json(const plan_arguments &arguments, const identification::grid &box,
                 const identification::plan_result &result) {
    identification::points_mm points = result.best.front().points;
    identification::six traditional;
    const bool solvable =
        identification::order_for_traditional(points, arguments.options, traditional);
    json plan = points_report(arguments, points, solvable ? &traditional : nullptr);
    plan["explanation"] = identification::describe(points, box);
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
json check_by_runs(const plan_arguments &arguments, const identification::points_mm &points,
                   const cli::streams &io) {
    identification::monte_carlo_options options;
    options.axis = arguments.options.model.axis;
    options.preset = arguments.options.preset;
    options.sigma_um = identification::sigma_of_lines(
        arguments.options.along_um, arguments.options.across_um, options.axis, points.size());
    options.runs = arguments.monte_carlo.runs;
    options.seed = arguments.monte_carlo.seed;
    options.progress = cli::progress_of(io, "runs");
    return monte_carlo_json(identification::monte_carlo(points, options), options);
}

std::string numbers_of(const json &values) {
    std::string text;
    for (const auto &value : values) text += fmt::format("{:10.3f}", value.get<double>());
    return text;
}

// in : the plan's object. out: the same for reading
std::string plan_text(const json &plan) {
    std::string text;
    if (plan.contains("triples")) {
        text = fmt::format("{} triples looked at, {} of them cannot be identified\n\n",
                           plan["triples"].dump(), plan["degenerate_triples"].dump());
    }
    text += "Measure at\n";
    for (const auto &point : plan["points_mm"]) text += fmt::format("  {} mm\n", numbers_of(point));
    if (plan.contains("explanation")) text += plan["explanation"].get<std::string>() + "\n";
    const json &sigma = plan["reading_sigma_um"];
    const std::string readings =
        sigma.is_number() ? fmt::format("{} um", sigma.get<double>())
                          : fmt::format("{} um along {} and {} um across", sigma[0].get<double>(),
                                        plan["axis"].get<std::string>(), sigma[1].get<double>());
    text += fmt::format(
        "\nstandard deviation of the results for readings with {}{}\n"
        "                 delta x, y, z (um)            epsilon x, y, z (urad)\n"
        "  improved    {}{}\n",
        readings,
        plan.contains("positions")
            ? fmt::format(", each line a set-up of its own with {} positions",
                          plan["positions"].get<int>())
            : "",
        numbers_of(plan["sigma"]["delta_um"]), numbers_of(plan["sigma"]["epsilon_urad"]));
    if (!plan.contains("traditional_sigma")) {
        return text + "  traditional  cannot be solved at these points\n";
    }
    return text + fmt::format("  traditional {}{}\n",
                              numbers_of(plan["traditional_sigma"]["delta_um"]),
                              numbers_of(plan["traditional_sigma"]["epsilon_urad"]));
}

// Throws input_error: no triple of the box can be identified. Names what its nodes lack.
[[noreturn]] void refuse_box(const plan_arguments &arguments,
                             const std::vector<identification::point_mm> &nodes) {
    const std::string fault = identification::obstacle(nodes, arguments.options.model);
    const char axis = "XYZ"[arguments.options.model.axis];
    const bool on_line = identification::height_mm(nodes) < identification::least_height_mm;
    if (fault.empty() || on_line) {
        throw input_error("--box: every triple of its nodes lies on one line: give it more nodes");
    }
    throw input_error(fmt::format(
        "--box: seen along {0}, every triple of its nodes lies on one line, so the lines along {0} "
        "cannot show pitch and yaw: give it nodes at two places or more in both directions across "
        "{0}",
        axis));
}

// Searches the nodes that are allowed for the best three points. out: the plan; nodes: for its plot
json search_box(plan_arguments &arguments, std::vector<identification::point_mm> &nodes,
                const cli::streams &io) {
    const identification::grid box = parse_box(arguments.box);
    check_nodes(box);
    nodes = allowed_nodes(box, arguments.forbidden);
    if (nodes.size() < 3) {
        throw input_error(fmt::format(
            "--box leaves {} nodes and three are needed: give more nodes for an axis, its third "
            "number",
            nodes.size()));
    }
    arguments.options.progress = cli::progress_of(io, "triples");
    const identification::plan_result result =
        identification::plan_points(nodes, arguments.options);
    if (result.best.empty() || !std::isfinite(result.best.front().merit)) {
        refuse_box(arguments, nodes);
    }
    return search_json(arguments, box, result);
}

// Judges the points of a file, in their order. Throws input_error if they cannot be identified.
json judge_points(const plan_arguments &arguments) {
    const identification::points_mm points = identification::read_plan(arguments.given);
    const identification::plan_options &options = arguments.options;
    const std::string fault = identification::obstacle(points, options.model);
    if (!fault.empty()) throw input_error(arguments.given, 0, 0, "{}", fault);
    const identification::line_sigma sigma =
        identification::sigma_of_lines(options.along_um, options.across_um, options.model.axis, 3);
    identification::six one, traditional;
    const bool solvable = identification::traditional_sigma(points, options.model.axis, sigma, one);
    if (solvable) {
        traditional = identification::sigma_over_positions({points.begin(), points.begin() + 3},
                                                           sigma, one, options.model);
    }
    return points_report(arguments, points, solvable ? &traditional : nullptr);
}

// Takes the options that depend on each other. Throws usage_error that names the option.
void check_usage(plan_arguments &arguments) {
    cli::different_files({{"-o", arguments.output}, {"--plot", arguments.plot}});
    if (arguments.box.empty() == arguments.given.empty()) {
        throw cli::usage_error("--box", "or --points is needed, one of them");
    }
    if (!arguments.given.empty() && !arguments.forbidden.empty()) {
        throw cli::usage_error("--forbid", "leaves nodes of --box out, not of --points");
    }
    identification::plan_options &options = arguments.options;
    options.model.axis = identification::axis_of(arguments.axis);
    if (arguments.sigma_um.size() > 2) {
        throw cli::usage_error("--sigma-um", "needs one number or two, ALONG,ACROSS");
    }
    if (!arguments.sigma_um.empty()) {
        options.along_um = arguments.sigma_um.front();
        options.across_um = arguments.sigma_um.back();
    }
    for (std::size_t k = 0; k < arguments.preset.size(); ++k) {
        if (arguments.preset[k] == 0.0) {
            throw cli::usage_error("--preset", "a preset error must not be zero");
        }
        options.preset[k] = std::fabs(arguments.preset[k]);
    }
}

// Chooses or judges the points, and writes and prints the plan.
void run_plan(plan_arguments &arguments, const cli::streams &io) {
    check_usage(arguments);
    std::vector<identification::point_mm> nodes;
    json plan =
        arguments.given.empty() ? search_box(arguments, nodes, io) : judge_points(arguments);
    identification::points_mm points;
    for (const auto &point : plan["points_mm"]) {
        points.push_back({point[0].get<double>(), point[1].get<double>(), point[2].get<double>()});
    }
    if (arguments.monte_carlo.runs > 0) plan["monte_carlo"] = check_by_runs(arguments, points, io);
    if (!arguments.plot.empty()) {
        identification::plot_plan(points, nodes.empty() ? points : nodes, arguments.axis,
                                  arguments.plot);
    }
    formats::write_file(arguments.output, formats::json_text(plan), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    if (arguments.as_json) {
        io.out << formats::json_text(plan);
    } else {
        io.out << plan_text(plan);
        if (plan.contains("monte_carlo")) {
            io.out << "\n" << monte_carlo_table(plan["monte_carlo"]);
        }
    }
}

// The options of how identify will solve the lines.
void add_model(cli::command &plan, plan_arguments &arguments) {
    add_line_sigma(plan, arguments.sigma_um,
                   "Standard deviation of a reading: of all lines, or of those along the axis and "
                   "across it (1)");
    const std::map<std::string, identification::setups> kinds = {
        {"separate", identification::setups::separate}, {"common", identification::setups::common}};
    plan.add_choice("--setups KIND", arguments.options.model.lines, kinds,
                    "separate (default): each line has its own offset and slope; common: all "
                    "lines share one frame");
    plan.add_option("--positions N", arguments.options.model.positions,
                    "Targets of each line, over which sigma is taken (21)")
        .check(cli::whole_between(3, 100000));
}

}  // namespace

void add_plan(cli::command &app) {
    auto arguments = std::make_shared<plan_arguments>();
    cli::command plan = app.add_subcommand("plan", "Choose the points of a nine-line measurement");
    plan.footer(plan_example);
    plan.add_option("--box x0:x1:nx,…", arguments->box,
                    "Grid of nodes: for X, Y and Z from and to in mm and the number of nodes, "
                    "x0:x1:nx,y0:y1:ny,z0:z1:nz");
    plan.add_option("--points PLAN.json", arguments->given,
                    "Judge these three or more points, not a box");
    plan.add_option("--axis AXIS", arguments->axis, "Axis that will move (X)")
        .check(cli::one_of({"X", "Y", "Z"}));
    add_model(plan, *arguments);
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
