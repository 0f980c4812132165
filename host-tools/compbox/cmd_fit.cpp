// SPDX-License-Identifier: MIT
// compbox fit: one measured error curve to a term.
#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <memory>
#include <ostream>

#include "firmware/base/limits.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/fitting/fit.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

namespace compbox {

namespace {

struct fit_arguments {
    std::string data, output, plot, band;
    fitting::reading_options reading;
    scale_arguments scale;
    fitting::fit_options options;
    bool as_json = false;
};

constexpr const char *fit_example =
    R"(Reads position_mm,error_um (or error_urad) with optional columns run, direction and sigma.
Finds the curve that exceeds the noise of the readings and writes it as a term for `compbox build`.
With --tolerance-um, brings every residual within the tolerance, as close to its best estimate as
that permits. If no curve does, it writes the closest one with a warning and "converged": false in
the provenance, and exits with 0.

Example:
  compbox fit EZX.csv --name EZX --signal X --plot EZX.svg -o EZX.term.json)";

// out: the name of an error by ISO 230-1, such as EXX, or ""
std::string iso_name(const std::string &name) {
    const bool fits = name.size() == 3 && name[0] == 'E' && name[1] >= 'A' && name[1] <= 'Z' &&
                      name[2] >= 'X' && name[2] <= 'Z';
    return fits ? name : "";
}

// Converts the readings to 20 degC where that is stated.
// out: what was done. Throws input_error for a straightness or an angle with a coefficient.
json convert(fitting::measurement &data, const fit_arguments &arguments) {
    const std::string name = iso_name(arguments.options.name);
    if (arguments.scale.expansion_um_per_m_K && !name.empty() && name[1] != name[2]) {
        throw input_error(data.file, 0, 0,
                          "{} is no error along its axis, so no scale expands it; leave "
                          "--expansion-um-per-m-K out",
                          name);
    }
    return test_report::convert_to_20_degC(data, stated_scale(arguments.scale), name);
}

// Reads, converts, fits, and writes the term and what else is asked for.
void run_fit(const fit_arguments &arguments, const cli::streams &io) {
    fitting::fit_options options = arguments.options;
    options.progress = cli::progress_of(io, "models");
    fitting::measurement data = fitting::read_measurement(arguments.data, arguments.reading);
    const json converted = convert(data, arguments);
    fitting::fit_result result = fitting::fit_curve(data, options);
    for (const char *key : {"remarks", "warnings"}) {
        for (const json &text : formats::member_or_null(converted, key)) {
            result.warnings.push_back(text.get<std::string>());
        }
    }
    if (!arguments.plot.empty()) fitting::plot_fit(result, arguments.plot);
    json fragment = fitting::fragment_of(result);
    if (converted["converted"] == true) {
        json &own = fragment["provenance"][options.name]["temperature"] = converted;
        own.erase("remarks");
    }
    if (!arguments.band.empty())
        formats::write_file(arguments.band, fitting::band_of(result), &io.out);
    formats::write_file(arguments.output, formats::json_text(fragment), &io.out);
    for (const auto &warning : result.warnings) {
        io.err << "compbox: " << arguments.data << ": " << warning << "\n";
    }
    if (cli::on_stdout({arguments.output, arguments.band})) return;
    io.out << (arguments.as_json ? formats::json_text(fragment) : fitting::report_of(result));
}

// Sets the value with the given name; throws usage_error that lists the choices.
template <typename kind>
std::function<void(const std::string &)> choice(kind &into, const std::string &option,
                                                std::initializer_list<kind> all) {
    const std::vector<kind> kinds = all;
    return [&into, option, kinds](const std::string &text) {
        std::string names;
        for (const kind one : kinds) {
            if (text == fitting::name_of(one)) {
                into = one;
                return;
            }
            names += std::string(names.empty() ? "" : ", ") + fitting::name_of(one);
        }
        throw cli::usage_error(option, fmt::format("must be one of {}, not {}", names, text));
    };
}

// Throws usage_error for a name that the box's loader rejects.
void check_name(const std::string &option, const std::string &name) {
    const auto fits = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.';
    };
    if (name.empty()) throw cli::usage_error(option, "a name may not be empty");
    if (name.size() >= CB_NAME_SIZE) {
        throw cli::usage_error(
            option, fmt::format("'{}' is too long: a name has at most {} characters", name,
                                CB_NAME_SIZE - 1));
    }
    if (!std::all_of(name.begin(), name.end(), fits)) {
        throw cli::usage_error(
            option,
            fmt::format("'{}' is not a name: use letters A to Z, digits and _ - . only", name));
    }
}

// Throws usage_error for invalid combinations of options.
void check_usage(const fit_arguments &arguments) {
    const fitting::fit_options &options = arguments.options;
    check_name("--name", options.name);
    check_name("--signal", options.signal);
    if (options.method == fitting::fit_method::polyline && options.degree > 0) {
        throw cli::usage_error("--degree", "a polyline has none");
    }
    if (options.method != fitting::fit_method::polynomial &&
        options.degree > fitting::max_spline_degree) {
        throw cli::usage_error("--degree", "a B-spline has degree 1 to 5");
    }
    cli::different_files(
        {{"-o", arguments.output}, {"--band", arguments.band}, {"--plot", arguments.plot}});
}

}  // namespace

void add_fit(cli::command &app) {
    auto arguments = std::make_shared<fit_arguments>();
    fitting::fit_options &options = arguments->options;
    cli::command fit = app.add_subcommand("fit", "Fit a curve to a measured error of one axis");
    fit.footer(fit_example);
    fit.add_option("DATA", arguments->data, "Measurement, DATA.csv").required();
    fit.add_option("--name NAME", options.name, "Name of the term, e.g. EZX").required();
    fit.add_option("--signal SIGNAL", options.signal, "Signal the curve depends on, e.g. X")
        .required();
    fit.add_option_function(
        "--method METHOD",
        choice(options.method, "--method",
               {fitting::fit_method::bspline, fitting::fit_method::bspline_lmc,
                fitting::fit_method::polynomial, fitting::fit_method::polyline}),
        "bspline (default): fewest knots that lose nothing; bspline-lmc: key points "
        "by curvature; polynomial; polyline");
    fit.add_option("--degree N", options.degree, "Degree (B-spline 3, polynomial 7)")
        .check(cli::whole_between(1, 15));
    const cli::option tolerance =
        fit.add_option(
               "--tolerance-um E", options.tolerance_um,
               "Largest residual allowed at a measured position, um (urad for angles); without "
               "it the noise decides")
            .check(cli::above_zero());
    fit.add_flag("--fewest-knots", options.fewest_knots,
                 "With --tolerance-um: spend the tolerance on fewer knots")
        .needs(tolerance);
    fit.add_option_function(
        "--line LINE",
        choice(options.line, "--line",
               {fitting::reference_line::keep, fitting::reference_line::end_point,
                fitting::reference_line::least_squares}),
        "Straight line taken off first: keep (none, default), end-point, least-squares");
    fit.add_option("--zero-at POSITION", options.zero_at_mm,
                   "Position, mm, where the curve is to be zero (its forward branch)")
        .check(cli::any_number());
    const cli::option branches = fit.add_flag("--branches", options.branches,
                                              "Forward and backward readings to a branch each");
    fit.add_option("--reversal-mm R", options.reversal_mm,
                   "With --branches: way after a reversal until the other branch counts alone, mm "
                   "(0.1)")
        .needs(branches)
        .check(cli::between(0.001, 1000));
    fit.add_option("--band F.csv", arguments->band,
                   "Curve and its standard deviation as a table, F.csv: "
                   "position_mm,curve_um,sigma_um");
    fit.add_option("--columns position_mm,error_um,run,…", arguments->reading.columns,
                   "Names of the columns of a file without a header")
        .delimiter(',');
    add_unit(fit, arguments->reading);
    add_scale(fit, arguments->scale);
    fit.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    fit.add_flag("--json", arguments->as_json, "Report as JSON (the fragment with its findings)");
    fit.add_option("-o,--output TERM.json", arguments->output, "Term to write, TERM.json")
        .required();
    fit.callback([arguments](const cli::streams &io) {
        check_usage(*arguments);
        run_fit(*arguments, io);
    });
}

}  // namespace compbox
