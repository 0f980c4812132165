// SPDX-License-Identifier: MIT
// compbox squareness: the angle between two axes.
#include <cmath>
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/fitting/measurement.h"
#include "host-tools/fitting/run_noise.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/squareness.h"
#include "host-tools/metrology/straightness.h"

namespace compbox {

namespace {

struct squareness_arguments {
    std::string name, output;
    fitting::reading_options reading;
    std::vector<std::string> optical;
    std::vector<double> diagonals, ball_bar;
    double square_error_urad = 0.0, sigma_um = 0.0;
    bool as_json = false;
};

constexpr const char *squareness_example =
    R"(C0Y > 0 opens the angle between +X and +Y, A0Z > 0 that between +Y and +Z, B0Z > 0 closes that
between +X and +Z. Pass the file to volumetric --squareness C0Y.json.

Example:
  compbox squareness --name C0Y --optical EYX.rtl EXY.rtl --square-error-urad 1.5 -o C0Y.json
  compbox squareness --name B0Z --diagonals 500,400,-6.1,4.2 --sigma-um 0.5 -o B0Z.json)";

// out: slope of a straightness and its standard deviation, from repeats, else from the residuals
metrology::squareness slope_of(const std::string &path, const fitting::reading_options &reading) {
    const fitting::measurement data = fitting::read_measurement(path, reading);
    if (data.unit != "um") throw input_error(path, 0, 0, "holds angles; a straightness is in um");
    if (data.position.size() < 3) throw input_error(path, 0, 0, "needs at least three positions");
    if (data.runs_aligned) {
        throw input_error(path, 0, 0,
                          "each run has a slope of its own, so they do not share a reference: "
                          "measure both axes without touching the set-up");
    }
    const metrology::straight_line line = metrology::least_squares_line(data.position, data.mean);
    double tt = 0.0, rest = 0.0, middle = 0.0;
    for (const double x : data.position) middle += x / static_cast<double>(data.position.size());
    for (std::size_t i = 0; i < data.position.size(); ++i) {
        const double x = data.position[i], e = data.mean[i] - line.at(x);
        tt += (x - middle) * (x - middle);
        rest += e * e;
    }
    const double by_residuals = rest / static_cast<double>(data.position.size() - 2) / tt;
    const double variance =
        data.repeat_freedom > 0 ? fitting::variance_of_slope(data) : by_residuals;
    return {1e3 * line.slope, 1e3 * std::sqrt(variance)};
}

// out: squareness in µrad by whichever method the options name; source: that method in words
metrology::squareness squareness_of(const squareness_arguments &arguments, std::string &source) {
    const auto &d = arguments.diagonals, &b = arguments.ball_bar;
    if (!arguments.optical.empty()) {
        source = "optical square, " + arguments.optical[0] + " and " + arguments.optical[1];
        const metrology::squareness first = slope_of(arguments.optical[0], arguments.reading);
        const metrology::squareness second = slope_of(arguments.optical[1], arguments.reading);
        if (arguments.optical[0] == arguments.optical[1]) {
            throw input_error(arguments.optical[0], 0, 0,
                              "is given for both axes; each of the two has a file of its own");
        }
        return metrology::from_optical_square(arguments.name, first, second,
                                              arguments.square_error_urad);
    }
    if (!d.empty()) {
        source = "face diagonals";
        return metrology::from_diagonals(arguments.name, d[0], d[1], d[2], d[3],
                                         arguments.sigma_um);
    }
    source = "ball bar";
    return metrology::from_ball_bar(arguments.name, b[0], b[1], b[2], arguments.sigma_um);
}

void check_usage(const squareness_arguments &arguments) {
    const int ways =
        !arguments.optical.empty() + !arguments.diagonals.empty() + !arguments.ball_bar.empty();
    if (ways != 1) {
        throw cli::usage_error("squareness", "takes one of --optical, --diagonals and --ball-bar");
    }
    const auto &d = arguments.diagonals, &b = arguments.ball_bar;
    if ((!d.empty() && !(d[0] > 0 && d[1] > 0)) || (!b.empty() && !(b[0] > 0))) {
        throw cli::usage_error("squareness", "sides and diameters must be above zero");
    }
}

// Computes, writes and prints one squareness. Throws input_error for one beyond 0.1 rad.
void run_squareness(const squareness_arguments &arguments, const cli::streams &io) {
    check_usage(arguments);
    std::string source;
    const metrology::squareness found = squareness_of(arguments, source);
    if (!std::isfinite(found.value_urad) || std::fabs(found.value_urad) > 1e5) {
        throw input_error(fmt::format(
            "{}: {} comes out as {:.0f} urad, which cannot be: check the order of the numbers",
            source, arguments.name, found.value_urad));
    }
    json report;
    report["squareness_urad"][arguments.name] = found.value_urad;
    report["sigma_urad"][arguments.name] = found.sigma_urad;
    report["source"] = source;
    formats::write_file(arguments.output, formats::json_text(report), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    if (arguments.as_json) {
        io.out << formats::json_text(report);
        return;
    }
    io.out << fmt::format("{} = {:.2f} urad, 1 sigma {:.2f} urad ({})\n", arguments.name,
                          found.value_urad, found.sigma_urad, source);
}

}  // namespace

void add_squareness(cli::command &app) {
    const auto arguments = std::make_shared<squareness_arguments>();
    cli::command command =
        app.add_subcommand("squareness", "Squareness from set-ups with one reference");
    command.footer(squareness_example);
    command.add_option("--name NAME", arguments->name, "C0Y (Y to X), B0Z (Z to X) or A0Z (Z to Y)")
        .required()
        .check(cli::one_of({"C0Y", "B0Z", "A0Z"}));
    command
        .add_option("--optical FIRST SECOND", arguments->optical,
                    "Straightness of the first axis towards the second, and of the second towards "
                    "the first behind the optical square; first and second are X Y, X Z or Y Z")
        .expected(2);
    command
        .add_option("--square-error-urad Q", arguments->square_error_urad,
                    "The square's angle less 90 degrees (0)")
        .check(cli::any_number());
    command
        .add_option("--diagonals A,B,R,F", arguments->diagonals,
                    "Sides of a rectangle in mm along the first and the second axis; measured "
                    "less nominal length in um of the diagonal on which both rise, and of the "
                    "other")
        .expected(4)
        .delimiter(',')
        .check(cli::any_number());
    command
        .add_option("--ball-bar D,R,F", arguments->ball_bar,
                    "Diameter in mm; deviations in um of the diameters at 45 and 135 degrees")
        .expected(3)
        .delimiter(',')
        .check(cli::any_number());
    command.add_option("--sigma-um S", arguments->sigma_um, "Standard deviation of one length (0)")
        .check(cli::zero_or_more());
    add_unit(command, arguments->reading);
    command.add_flag("--json", arguments->as_json, "Print the result as JSON");
    command.add_option("-o,--output F.json", arguments->output, "File to write").required();
    command.callback([arguments](const cli::streams &io) { run_squareness(*arguments, io); });
}

}  // namespace compbox
