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
    double sigma_um = 0.0;  // 0: the noise found, else 1
    bool as_json = false;
};

constexpr const char *identify_example =
    R"(Reads position_mm,dx1_um,dy1_um,dz1_um,dx2_um,…,dz3_um. Writes EXX.csv, EYX.csv, EZX.csv,
EAX.csv, EBX.csv, ECX.csv and report.json.

Example:
  compbox identify X.csv --axis X --points plan.json -o identified)";

const char *const line_names[9] = {"dx1_um", "dy1_um", "dz1_um", "dx2_um", "dy2_um",
                                   "dz2_um", "dx3_um", "dy3_um", "dz3_um"};

// out: readings in µm, a row for each position, which ascend; throws input_error with the line
identification::nine_lines read_lines(const std::string &path) {
    std::vector<std::string> names(std::begin(line_names), std::end(line_names));
    names.push_back("position_mm");
    formats::csv_reading how;
    how.units = formats::units_of_names(names);
    const formats::csv_table table = formats::read_csv(path, how);
    const std::size_t position = table.column("position_mm");
    identification::nine_lines lines;
    lines.file = path;
    lines.reading_um.resize(static_cast<Eigen::Index>(table.rows.size()), 9);
    for (int line = 0; line < 9; ++line) {
        const std::size_t column = table.column(line_names[line]);
        for (std::size_t r = 0; r < table.rows.size(); ++r) {
            lines.reading_um(static_cast<Eigen::Index>(r), line) = table.rows[r][column];
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
    return lines;
}

// Subtracts the expansion of a scale that is warmer than 20 degC from the axis' own lines.
void correct_scale(identification::nine_lines &lines, const identify_arguments &arguments) {
    const double per_mm = arguments.scale_ppm_per_degC * (arguments.temperature_degC - 20.0) * 1e-3;
    for (std::size_t r = 0; r < lines.position_mm.size(); ++r) {
        for (int point = 0; point < 3; ++point) {
            lines.reading_um(static_cast<Eigen::Index>(r), 3 * point + arguments.options.axis) -=
                per_mm * lines.position_mm[r];
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
    for (std::size_t k = 0; k < 6; ++k) {
        const auto column = curves.value.col(static_cast<Eigen::Index>(k));
        json one;
        one["unit"] = k < 3 ? "um" : "urad";
        one["range"] = column.maxCoeff() - column.minCoeff();
        one["sigma_mean"] = curves.sigma.col(static_cast<Eigen::Index>(k)).mean();
        one["sigma_for_noise_um"] = improved ? curves.noise_um : 1.0;
        report["errors"][names[k]] = one;
    }
    report["remarks"] = curves.remarks;
    report["outliers"] = json::array();
    for (const auto &outlier : curves.outliers) {
        json one;
        one["position_mm"] = curves.position_mm[outlier.row];
        one["line"] = line_names[outlier.line];
        one["studentised"] = outlier.studentised;
        for (const int line : outlier.or_lines) one["or_lines"].push_back(line_names[line]);
        report["outliers"].push_back(one);
    }
    return report;
}

// in : report_json's object. out: its table for reading
std::string report_text(const json &report) {
    std::string text =
        fmt::format("{} nine-line identification, {} positions",
                    report["method"].get<std::string>(), report["positions"].get<std::size_t>());
    if (report.contains("noise_um")) {
        text += fmt::format(", noise of a reading {:.3f} um", report["noise_um"].get<double>());
    }
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
json compare_methods(const identify_arguments &arguments, const identification::triple_mm &points,
                     const identification::six_curves &curves, const cli::streams &io) {
    identification::monte_carlo_options options;
    options.axis = arguments.options.axis;
    options.runs = arguments.monte_carlo.runs;
    options.seed = arguments.monte_carlo.seed;
    options.sigma_um = arguments.sigma_um > 0.0 ? arguments.sigma_um
                       : curves.noise_um > 1e-6 ? curves.noise_um
                                                : 1.0;
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
    identification::nine_lines lines = read_lines(arguments.data);
    if (arguments.table_readings) lines.reading_um *= -1.0;  // tool relative to workpiece
    correct_scale(lines, arguments);
    identification::triple_mm points = identification::read_plan(arguments.points);
    for (auto &point : points) {
        for (std::size_t k = 0; k < 3; ++k) point[k] -= arguments.frame_offset_mm[k];
    }
    const identification::six_curves curves =
        identification::identify(lines, points, arguments.options, arguments.points);
    json report = report_json(arguments, curves);
    if (arguments.monte_carlo.runs > 0) {
        report["monte_carlo"] = compare_methods(arguments, points, curves, io);
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
    identify
        .add_option("--sigma-um S", arguments.sigma_um,
                    "Monte Carlo: standard deviation of a reading (else the noise found)")
        .check(cli::above_zero());
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
