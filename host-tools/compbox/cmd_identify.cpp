// SPDX-License-Identifier: MIT
// compbox identify: nine lines to the six errors of an axis.
#include <fmt/core.h>

#include <cmath>
#include <map>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/line_sigma.h"
#include "host-tools/compbox/monte_carlo_report.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/identification/identify.h"
#include "host-tools/identification/plan_file.h"
#include "host-tools/identification/plot.h"

namespace compbox {

namespace {

struct identify_arguments {
    std::string data, axis, points, folder;
    std::vector<double> frame_offset_mm{0, 0, 0}, reference_point_mm;
    double scale_ppm_per_degC = 0.0, temperature_degC = 20.0;
    bool table_readings = false;
    identification::identify_options options;
    std::string plot;
    monte_carlo_arguments monte_carlo;
    std::vector<double> preset;
    std::vector<double> sigma_um;  // of a value of the table; empty: its columns
    bool as_json = false;
};

constexpr const char *identify_example =
    R"(Reads position_mm,dx1_um,dy1_um,dz1_um,dx2_um,…,dz3_um, and more lines where the plan has
more points; with sigma_dx1_um,… the sigma of each line. Writes EXX.csv, EYX.csv, EZX.csv, EAX.csv,
EBX.csv, ECX.csv and report.json.

Example:
  compbox identify X.csv --axis X --points plan.json -o identified)";

// out: "dx1" of line 0, "dy1" of line 1 …
std::string short_name(std::size_t line) {
    return fmt::format("d{}{}", "xyz"[line % 3], line / 3 + 1);
}

// out: "dx1_um" of line 0 …
std::string line_name(std::size_t line) {
    return short_name(line) + "_um";
}

// in : names of a column for each line; the table has all of them or none
// out: root mean square of each, above 0; empty without them
Eigen::VectorXd read_of_lines(const formats::csv_table &table,
                              const std::vector<std::string> &names) {
    std::size_t found = 0;
    for (const auto &name : names) found += table.find(name) >= 0;
    if (found == 0) return {};
    Eigen::VectorXd values(static_cast<Eigen::Index>(names.size()));
    for (std::size_t line = 0; line < names.size(); ++line) {
        const std::size_t column = table.column(names[line]);
        double squares = 0.0;
        for (std::size_t r = 0; r < table.rows.size(); ++r) {
            const double one = table.rows[r][column];
            if (!(one > 0.0)) {
                throw input_error(table.file, table.lines[r], 0, "{} must be above 0, not {}",
                                  names[line], one);
            }
            squares += one * one / static_cast<double>(table.rows.size());
        }
        values(static_cast<Eigen::Index>(line)) = std::sqrt(squares);
    }
    return values;
}

// in : points: of the plan, three lines each
// out: readings in µm, a row for each position, which ascend; throws input_error with the line
identification::nine_lines read_lines(const std::string &path, std::size_t points) {
    std::vector<std::string> names{"position_mm"}, sigmas, factors;
    for (std::size_t line = 0; line < 3 * points + 1; ++line) names.push_back(line_name(line));
    for (std::size_t line = 0; line < 3 * points; ++line) {
        sigmas.push_back("sigma_" + line_name(line));
        factors.push_back("slope_factor_" + short_name(line));
    }
    names.insert(names.end(), sigmas.begin(), sigmas.end());
    formats::csv_reading how;
    how.units = formats::units_of_names(names);
    const formats::csv_table table = formats::read_csv(path, how);
    const std::size_t position = table.column("position_mm");
    if (table.find(line_name(3 * points)) >= 0) {
        throw input_error(path, table.header_line, 0,
                          "has lines of point {}, but the plan has {} points", points + 1, points);
    }
    identification::nine_lines lines;
    lines.file = path;
    lines.reading_um.resize(static_cast<Eigen::Index>(table.rows.size()),
                            static_cast<Eigen::Index>(3 * points));
    for (std::size_t line = 0; line < 3 * points; ++line) {
        const std::size_t column = table.column(line_name(line));
        for (std::size_t r = 0; r < table.rows.size(); ++r) {
            lines.reading_um(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(line)) =
                table.rows[r][column];
        }
    }
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        lines.position_mm.push_back(table.rows[r][position]);
        if (r > 0 && lines.position_mm[r] <= lines.position_mm[r - 1]) {
            throw input_error(path, table.lines[r], 0,
                              "positions must ascend, but {} mm comes after {} mm",
                              lines.position_mm[r], lines.position_mm[r - 1]);
        }
    }
    lines.sigma_um = read_of_lines(table, sigmas);
    lines.slope_factor = read_of_lines(table, factors);
    return lines;
}

// Subtracts the expansion of a scale that is warmer than 20 degC from the axis' own lines.
void correct_scale(identification::nine_lines &lines, const identify_arguments &arguments) {
    const double per_mm = arguments.scale_ppm_per_degC * (arguments.temperature_degC - 20.0) * 1e-3;
    for (std::size_t r = 0; r < lines.position_mm.size(); ++r) {
        for (Eigen::Index line = arguments.options.axis; line < lines.reading_um.cols();
             line += 3) {
            lines.reading_um(static_cast<Eigen::Index>(r), line) -= per_mm * lines.position_mm[r];
        }
    }
}

// Writes NAME.csv of each of the six errors into the folder: position, error, sigma.
void write_curves(const identify_arguments &arguments, const identification::six_curves &curves) {
    const auto names = identification::error_names(arguments.options.axis);
    formats::make_folder(arguments.folder);
    for (std::size_t k = 0; k < 6; ++k) {
        const std::string unit = k < 3 ? "um" : "urad";
        std::vector<std::vector<double>> rows;
        for (std::size_t r = 0; r < curves.position_mm.size(); ++r) {
            const auto row = static_cast<Eigen::Index>(r), column = static_cast<Eigen::Index>(k);
            rows.push_back(
                {curves.position_mm[r], curves.value(row, column), curves.sigma(row, column)});
        }
        formats::write_file(
            fmt::format("{}/{}.csv", arguments.folder, names[k]),
            formats::csv_text({"position_mm", "error_" + unit, "sigma_" + unit}, rows));
    }
}

// out: range and mean sigma of each error in its unit, remarks, and outliers
json report_json(const identify_arguments &arguments, const identification::six_curves &curves) {
    const auto names = identification::error_names(arguments.options.axis);
    const bool improved = arguments.options.how == identification::nine_line_method::improved;
    json report;
    report["axis"] = arguments.axis;
    report["side"] = arguments.table_readings ? "workpiece" : "tool";
    if (!arguments.reference_point_mm.empty()) {
        report["reference_point_mm"] = arguments.reference_point_mm;
    }
    report["method"] = improved ? "improved" : "traditional";
    report["setups"] =
        arguments.options.lines == identification::setups::separate ? "separate" : "common";
    report["positions"] = curves.position_mm.size();
    if (improved && curves.freedom > 0) report["noise_um"] = curves.noise_um;
    report["line_sigma_um"] = line_sigma_json(curves.line_sigma_um);
    if (curves.contradiction > 0.0) report["contradiction"] = curves.contradiction;
    for (std::size_t k = 0; k < 6; ++k) {
        const auto column = curves.value.col(static_cast<Eigen::Index>(k));
        json one;
        one["unit"] = k < 3 ? "um" : "urad";
        one["range"] = column.maxCoeff() - column.minCoeff();
        one["sigma_mean"] = curves.sigma.col(static_cast<Eigen::Index>(k)).mean();
        report["errors"][names[k]] = one;
    }
    report["remarks"] = curves.remarks;
    report["outliers"] = json::array();
    for (const auto &outlier : curves.outliers) {
        json one;
        one["position_mm"] = curves.position_mm[outlier.row];
        one["line"] = line_name(static_cast<std::size_t>(outlier.line));
        one["studentised"] = outlier.studentised;
        for (const int line : outlier.or_lines) {
            one["or_lines"].push_back(line_name(static_cast<std::size_t>(line)));
        }
        report["outliers"].push_back(one);
    }
    return report;
}

// in : sigma of each line, µm. out: a row for each point
std::string line_table(const json &sigma_um) {
    std::string text = "  sigma, um        x         y         z\n";
    for (std::size_t line = 0; line < sigma_um.size(); ++line) {
        if (line % 3 == 0) text += fmt::format("  P{:<6}", line / 3 + 1);
        text += fmt::format("{:10.3f}{}", sigma_um[line].get<double>(), line % 3 == 2 ? "\n" : "");
    }
    return text;
}

// in : report_json's object. out: its table for reading
std::string report_text(const json &report) {
    std::string text =
        fmt::format("{} nine-line identification, {} positions",
                    report["method"].get<std::string>(), report["positions"].get<std::size_t>());
    if (report.contains("noise_um")) {
        text += fmt::format(", noise of a reading {:.3f} um", report["noise_um"].get<double>());
    }
    if (report["line_sigma_um"].is_array()) text += "\n\n" + line_table(report["line_sigma_um"]);
    text += "\n\n  error       range     1 sigma\n";
    for (const auto &[name, one] : report["errors"].items()) {
        text += fmt::format("  {}{:13.3f}{:12.3f} {}\n", name, one["range"].get<double>(),
                            one["sigma_mean"].get<double>(), one["unit"].get<std::string>());
    }
    for (const auto &remark : report["remarks"]) text += "\n" + remark.get<std::string>() + "\n";
    for (const auto &outlier : report["outliers"]) {
        text += "\nstands out: " + outlier["line"].get<std::string>();
        for (const auto &line : outlier.value("or_lines", json::array())) {
            text += " or " + line.get<std::string>();
        }
        text += fmt::format(" at {} mm ({:.1f} sigma)", outlier["position_mm"].get<double>(),
                            outlier["studentised"].get<double>());
    }
    if (!report["outliers"].empty()) text += "\nmeasure these again or take them out\n";
    return text;
}

// Compares both methods at these points, with the errors and the noise that were found.
json compare_methods(const identify_arguments &arguments,
                     const identification::line_sigma &sigma_um,
                     const identification::points_mm &points,
                     const identification::six_curves &curves, const cli::streams &io) {
    identification::monte_carlo_options options;
    options.axis = arguments.options.axis;
    options.runs = arguments.monte_carlo.runs;
    options.seed = arguments.monte_carlo.seed;
    const auto lines = 3 * static_cast<Eigen::Index>(points.size());
    options.sigma_um = sigma_um.size() > 0      ? sigma_um
                       : curves.noise_um > 1e-6 ? identification::line_sigma(curves.line_sigma_um)
                                                : identification::line_sigma::Ones(lines);
    for (std::size_t k = 0; k < 6; ++k) {
        const auto column = curves.value.col(static_cast<Eigen::Index>(k));
        options.preset[k] =
            arguments.preset.empty() ? column.maxCoeff() - column.minCoeff() : arguments.preset[k];
    }
    options.progress = cli::progress_of(io, "runs");
    return monte_carlo_json(identification::monte_carlo(points, options), options);
}

// Reads the lines and the plan, identifies, writes curves and report.json, and prints the report.
void run_identify(identify_arguments &arguments, const cli::streams &io) {
    arguments.options.axis = identification::axis_of(arguments.axis);
    identification::points_mm points = identification::read_plan(arguments.points);
    identification::nine_lines lines = read_lines(arguments.data, points.size());
    if (!arguments.sigma_um.empty()) {
        lines.sigma_um = line_sigma_of(arguments.sigma_um, arguments.options.axis, points.size());
    }
    if (arguments.table_readings) lines.reading_um *= -1.0;  // tool relative to workpiece
    correct_scale(lines, arguments);
    for (auto &point : points) {
        for (std::size_t k = 0; k < 3; ++k) point[k] -= arguments.frame_offset_mm[k];
    }
    const identification::six_curves curves =
        identification::identify(lines, points, arguments.options, arguments.points);
    json report = report_json(arguments, curves);
    if (arguments.monte_carlo.runs > 0) {
        report["monte_carlo"] = compare_methods(arguments, lines.sigma_um, points, curves, io);
    }
    if (!arguments.plot.empty())
        identification::plot_identified(curves, arguments.options.axis, arguments.plot);
    write_curves(arguments, curves);
    formats::write_file(arguments.folder + "/report.json", formats::json_text(report));
    if (arguments.as_json) {
        io.out << formats::json_text(report);
    } else {
        io.out << report_text(report);
        if (report.contains("monte_carlo")) {
            io.out << "\n" << monte_carlo_table(report["monte_carlo"]);
        }
    }
}

// Options of the axis' frame and of the temperature of its scale.
void add_frame(cli::command &identify, identify_arguments &arguments) {
    identify
        .add_option("--frame-offset-mm X,Y,Z", arguments.frame_offset_mm,
                    "Origin of the axis' frame in the points' coordinates, x,y,z")
        .expected(3)
        .delimiter(',')
        .check(cli::any_number());
    const std::map<std::string, bool> sides = {{"tool", false}, {"workpiece", true}};
    identify.add_choice("--side SIDE", arguments.table_readings, sides,
                        "tool (default): readings are of the tool relative to the workpiece; "
                        "workpiece: of a table that moved, so their signs are inverted");
    identify
        .add_option("--reference-point X,Y,Z", arguments.reference_point_mm,
                    "The same origin in machine coordinates with all axes at 0, noted in "
                    "report.json for `volumetric`")
        .expected(3)
        .delimiter(',')
        .check(cli::any_number());
    identify
        .add_option("--scale-ppm-per-degC A", arguments.scale_ppm_per_degC,
                    "Expansion of the axis' scale, corrected to 20 degC")
        .check(cli::any_number());
    identify.add_option("--temperature-degC T", arguments.temperature_degC, "Its temperature (20)")
        .check(cli::any_number());
}

// Options of the errors and the noise of Monte Carlo.
void add_trials(cli::command &identify, identify_arguments &arguments) {
    add_monte_carlo(identify, arguments.monte_carlo);
    identify
        .add_option("--preset DX,DY,DZ,EX,EY,EZ", arguments.preset,
                    "Monte Carlo: the true errors, um and urad (else the ranges found)")
        .expected(6)
        .delimiter(',')
        .check(cli::any_number());
    add_line_sigma(identify, arguments.sigma_um,
                   "Standard deviation of a value of the table: of all lines, of those along the "
                   "axis and across it, or of each (else the table's sigma columns)");
}

}  // namespace

void add_identify(cli::command &app) {
    auto arguments = std::make_shared<identify_arguments>();
    cli::command identify = app.add_subcommand("identify", "Six errors of an axis from nine lines");
    identify.footer(identify_example);
    identify.add_option("DATA", arguments->data, "Table, MEASURED.csv").required();
    identify.add_option("--axis AXIS", arguments->axis, "Axis that moved: X, Y or Z")
        .required()
        .check(cli::one_of({"X", "Y", "Z"}));
    identify.add_option("--points PLAN.json", arguments->points, "Measuring points, plan.json")
        .required();
    const std::map<std::string, identification::nine_line_method> methods = {
        {"improved", identification::nine_line_method::improved},
        {"traditional", identification::nine_line_method::traditional}};
    identify.add_choice("--method METHOD", arguments->options.how, methods,
                        "improved (default) or traditional");
    const std::map<std::string, identification::setups> kinds = {
        {"separate", identification::setups::separate}, {"common", identification::setups::common}};
    identify.add_choice("--setups KIND", arguments->options.lines, kinds,
                        "separate (default): each line has its own offset and slope; common: all "
                        "lines share one frame");
    add_frame(identify, *arguments);
    add_trials(identify, *arguments);
    identify.add_option("--plot F.svg", arguments->plot,
                        "Six curves with their 2 sigma bands, F.svg, F.png or F.pdf");
    identify.add_flag("--json", arguments->as_json, "Print the report as JSON");
    identify.add_option("-o,--output DIR", arguments->folder, "Folder for the curves, DIR")
        .required();
    identify.callback([arguments](const cli::streams &io) { run_identify(*arguments, io); });
}

}  // namespace compbox
