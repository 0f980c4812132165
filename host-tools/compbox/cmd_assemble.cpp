// SPDX-License-Identifier: MIT
// compbox assemble: nine or more instrument files to the table that identify reads.
#include <cmath>
#include <filesystem>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/line_sigma.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/identification/noise.h"
#include "host-tools/identification/plan_file.h"

namespace compbox {

namespace {

struct assemble_arguments {
    std::vector<std::string> files;
    std::string output, axis;
    std::vector<double> sigma_um;  // of a reading; empty: by the runs
    fitting::reading_options reading;
    bool as_json = false;
};

constexpr const char *assemble_example =
    R"(Averages the runs of each file. The files (.rtl or CSV) belong to one axis, point by point, and
x, y, z within a point: nine for three points, twelve for four. The scatter of the runs becomes the
sigma of each line, by which identify weights it: the columns sigma_dx1_um ….

Example:
  compbox assemble P1x.rtl P1y.rtl P1z.rtl P2x.rtl P2y.rtl P2z.rtl P3x.rtl P3y.rtl P3z.rtl -o X.csv)";

constexpr double same_position_mm = 1e-3;

void check_positions(const fitting::measurement &first, const fitting::measurement &other) {
    if (other.unit != "um")
        throw input_error(other.file, 0, 0, "holds angles; nine lines are in um");
    if (other.position.size() != first.position.size()) {
        throw input_error(other.file, 0, 0, "has {} positions, {} has {}", other.position.size(),
                          first.file, first.position.size());
    }
    for (std::size_t i = 0; i < first.position.size(); ++i) {
        if (std::fabs(first.position[i] - other.position[i]) > same_position_mm) {
            throw input_error(other.file, 0, 0, "measures at {} mm where {} measures at {}",
                              other.position[i], first.file, first.position[i]);
        }
    }
}

// Throws input_error for a file that is given twice, also by different paths.
void check_no_file_twice(const std::vector<std::string> &files) {
    for (std::size_t i = 0; i < files.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            std::error_code ignored;
            if (files[i] != files[k] && !std::filesystem::equivalent(files[i], files[k], ignored)) {
                continue;
            }
            const auto place = [](std::size_t n) {
                return fmt::format("P{}{}", n / 3 + 1, "xyz"[n % 3]);
            };
            throw input_error(
                files[i], 0, 0,
                "is given for {} and for {}; each of the nine lines has a file of its own",
                place(k), place(i));
        }
    }
}

// out: dx1 dy1 dz1 dx2 …
std::vector<std::string> line_names(std::size_t lines) {
    std::vector<std::string> names;
    for (std::size_t line = 0; line < lines; ++line) {
        names.push_back(fmt::format("d{}{}", "xyz"[line % 3], line / 3 + 1));
    }
    return names;
}

// out: variance of the mean of a line's runs over that of one reading, mean of the positions
double mean_share(const fitting::measurement &line) {
    double sum = 0.0;
    for (const double variance : line.variance) sum += variance;
    return sum / static_cast<double>(line.variance.size());
}

// out: mean square of the sigma that a line's file states for its readings
double stated_variance(const fitting::measurement &line) {
    double sum = 0.0, count = 0.0;
    for (const auto &run : line.runs) {
        for (const double sigma : run.sigma) {
            sum += sigma * sigma;
            count += 1.0;
        }
    }
    return sum / count;
}

// out: the scatter of a line's runs, of runs that lack positions only that of the readings; of a
//      file with a sigma column that sigma
identification::line_repeats repeats_of(const fitting::measurement &line) {
    std::vector<identification::line_run> runs;
    bool whole = line.position.size() >= 3;
    for (const auto &run : line.runs) {
        whole = whole && run.position.size() == line.position.size();
        runs.push_back({run.error, run.direction < 0});
    }
    identification::line_repeats repeats;
    if (whole) repeats = identification::repeats_of(line.position, runs);
    if (repeats.freedom == 0) {
        repeats.variance_um2 = line.repeat_variance;
        repeats.freedom = line.repeat_freedom;
    }
    repeats.mean_share = mean_share(line);
    if (line.sigma_given) {
        constexpr int certain = 1000000;
        repeats.variance_um2 = stated_variance(line);
        repeats.freedom = certain;
        repeats.mean_share /= repeats.variance_um2;
    }
    return repeats;
}

// What the columns of the table besides the readings hold; empty where nothing is known.
struct line_noise {
    identification::line_sigma sigma_um;  // of each line's mean
    Eigen::VectorXd slope_factor;         // empty if 1 for all
};

// out: sigma by the option or by the runs, slope factors by the runs
line_noise noise_of(const assemble_arguments &arguments,
                    const std::vector<fitting::measurement> &lines) {
    std::vector<identification::line_repeats> repeats;
    for (const auto &line : lines) repeats.push_back(repeats_of(line));
    line_noise noise{identification::sigma_by_runs(repeats), {}};
    if (!arguments.sigma_um.empty()) {
        const int axis = arguments.axis.empty() ? 0 : identification::axis_of(arguments.axis);
        noise.sigma_um = line_sigma_of(arguments.sigma_um, axis, lines.size() / 3);
        for (std::size_t line = 0; line < lines.size(); ++line) {
            noise.sigma_um(static_cast<Eigen::Index>(line)) *= std::sqrt(repeats[line].mean_share);
        }
    }
    const Eigen::VectorXd factors = identification::slope_factors(repeats);
    if ((factors.array() > 1.0).any()) noise.slope_factor = factors;
    return noise;
}

// out: the table of the lines' means, and of their noise where it is known
std::string table_text(const std::vector<fitting::measurement> &lines, const line_noise &noise) {
    const std::vector<std::string> of_lines = line_names(lines.size());
    std::vector<std::string> names{"position_mm"};
    for (const auto &name : of_lines) names.push_back(name + "_um");
    std::vector<double> same;  // in each row
    for (std::size_t line = 0; line < of_lines.size() && noise.sigma_um.size() > 0; ++line) {
        names.push_back("sigma_" + of_lines[line] + "_um");
        same.push_back(noise.sigma_um(static_cast<Eigen::Index>(line)));
    }
    for (std::size_t line = 0; line < of_lines.size() && noise.slope_factor.size() > 0; ++line) {
        names.push_back("slope_factor_" + of_lines[line]);
        same.push_back(noise.slope_factor(static_cast<Eigen::Index>(line)));
    }
    std::vector<std::vector<double>> rows;
    for (std::size_t i = 0; i < lines.front().position.size(); ++i) {
        rows.push_back({lines.front().position[i]});
        for (const auto &line : lines) rows.back().push_back(line.mean[i]);
        rows.back().insert(rows.back().end(), same.begin(), same.end());
    }
    return formats::csv_text(names, rows);
}

// Throws usage_error for a number of files that are not three or more points, and for a sigma
// without its axis.
void check_usage(const assemble_arguments &arguments) {
    const std::size_t files = arguments.files.size();
    if (files < 9 || files % 3 != 0) {
        throw cli::usage_error(
            "FILE", fmt::format("needs three files for each of three or more points, 9, 12 …, not "
                                "{}",
                                files));
    }
    if (arguments.sigma_um.size() == 2 && arguments.axis.empty()) {
        throw cli::usage_error("--sigma-um", "ALONG,ACROSS needs --axis");
    }
}

constexpr const char *no_repeats =
    "a direction has no repeated runs, or none that differ, so sigma of the lines is unknown and "
    "identify lets all lines count alike: measure several runs, or give --sigma-um";

// Reads files with equal positions and writes one table of their means and sigmas.
void run_assemble(const assemble_arguments &arguments, const cli::streams &io) {
    check_usage(arguments);
    check_no_file_twice(arguments.files);
    std::vector<fitting::measurement> lines;
    for (const auto &file : arguments.files)
        lines.push_back(fitting::read_measurement(file, arguments.reading));
    for (const auto &line : lines) check_positions(lines.front(), line);
    const line_noise noise = noise_of(arguments, lines);
    const identification::line_sigma &sigma_um = noise.sigma_um;
    formats::write_file(arguments.output, table_text(lines, noise), &io.out);
    const std::vector<double> &at_mm = lines.front().position;
    std::vector<std::string> remarks;
    if (sigma_um.size() == 0) remarks.push_back(no_repeats);
    if (noise.slope_factor.size() > 0) {
        remarks.push_back(fmt::format(
            "the slopes of the runs differ {:.1f} times as much as independent readings explain: "
            "the readings drift or are correlated along a run; sigma of the slopes includes it",
            noise.slope_factor.maxCoeff()));
    }
    if (arguments.as_json) {
        json figures = {
            {"positions", at_mm.size()}, {"from_mm", at_mm.front()}, {"to_mm", at_mm.back()}};
        for (const double sigma : sigma_um) figures["sigma_um"].push_back(sigma);
        return cli::print_summary(io.out, {arguments.output}, figures, remarks);
    }
    if (cli::on_stdout({arguments.output})) return;
    io.out << fmt::format("{} positions from {} to {} mm written to {}\n", at_mm.size(),
                          at_mm.front(), at_mm.back(), arguments.output);
    for (Eigen::Index line = 0; line < sigma_um.size(); line += 3) {
        io.out << fmt::format("sigma of P{} in x, y, z: {:.3f}, {:.3f}, {:.3f} um\n", line / 3 + 1,
                              sigma_um(line), sigma_um(line + 1), sigma_um(line + 2));
    }
    for (const auto &remark : remarks) io.out << remark << "\n";
}

}  // namespace

void add_assemble(cli::command &app) {
    auto arguments = std::make_shared<assemble_arguments>();
    cli::command assemble =
        app.add_subcommand("assemble", "Nine or more instrument files to one table");
    assemble.footer(assemble_example);
    assemble.add_option("FILE", arguments->files, "P1x P1y P1z P2x … P3z").required();
    assemble.add_option("-o,--output F.csv", arguments->output, "Table to write, MEASURED.csv")
        .required();
    add_line_sigma(assemble, arguments->sigma_um,
                   "Standard deviation of a reading: of all files, of those along the axis and "
                   "across it (with --axis), or of each file (else by the runs)");
    assemble.add_option("--axis AXIS", arguments->axis, "Axis that moved: X, Y or Z")
        .check(cli::one_of({"X", "Y", "Z"}));
    add_unit(assemble, arguments->reading);
    cli::add_json(assemble, arguments->as_json);
    assemble.callback([arguments](const cli::streams &io) { run_assemble(*arguments, io); });
}

}  // namespace compbox
