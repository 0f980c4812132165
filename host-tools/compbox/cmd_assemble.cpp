// SPDX-License-Identifier: MIT
// compbox assemble: nine instrument files to the table that identify reads.
#include <cmath>
#include <filesystem>
#include <memory>
#include <ostream>

#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

namespace compbox {

namespace {

struct assemble_arguments {
    std::vector<std::string> files;
    std::string output;
    fitting::reading_options reading;
    bool as_json = false;
};

constexpr const char *assemble_example =
    R"(Averages the runs of each file. The nine files (.rtl or CSV) belong to one axis, point by point,
and x, y, z within a point.

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

// Reads nine files with equal positions and writes one table of their means.
void run_assemble(const assemble_arguments &arguments, const cli::streams &io) {
    check_no_file_twice(arguments.files);
    std::vector<fitting::measurement> lines;
    for (const auto &file : arguments.files)
        lines.push_back(fitting::read_measurement(file, arguments.reading));
    for (const auto &line : lines) check_positions(lines.front(), line);
    std::vector<std::string> names = {"position_mm"};
    for (const char *point : {"1", "2", "3"}) {
        for (const char *direction : {"dx", "dy", "dz"}) {
            names.push_back(fmt::format("{}{}_um", direction, point));
        }
    }
    std::vector<std::vector<double>> rows;
    for (std::size_t i = 0; i < lines.front().position.size(); ++i) {
        rows.push_back({lines.front().position[i]});
        for (const auto &line : lines) rows.back().push_back(line.mean[i]);
    }
    formats::write_file(arguments.output, formats::csv_text(names, rows), &io.out);
    if (arguments.as_json) {
        return cli::print_summary(
            io.out, {arguments.output},
            {{"positions", rows.size()}, {"from_mm", rows.front()[0]}, {"to_mm", rows.back()[0]}});
    }
    io.out << fmt::format("{} positions from {} to {} mm written to {}\n", rows.size(),
                          rows.front()[0], rows.back()[0], arguments.output);
}

}  // namespace

void add_assemble(cli::command &app) {
    auto arguments = std::make_shared<assemble_arguments>();
    cli::command assemble = app.add_subcommand("assemble", "Nine instrument files to one table");
    assemble.footer(assemble_example);
    assemble.add_option("FILE", arguments->files, "P1x P1y P1z P2x … P3z").required().expected(9);
    assemble.add_option("-o,--output F.csv", arguments->output, "Table to write, MEASURED.csv")
        .required();
    add_unit(assemble, arguments->reading);
    cli::add_json(assemble, arguments->as_json);
    assemble.callback([arguments](const cli::streams &io) { run_assemble(*arguments, io); });
}

}  // namespace compbox
