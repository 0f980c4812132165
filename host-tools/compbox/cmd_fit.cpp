// SPDX-License-Identifier: MIT
// compbox fit: one measured error curve to a term.
#include <iostream>
#include <map>
#include <memory>

#include "host-tools/compbox/commands.h"
#include "host-tools/fitting/fit.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

struct fit_arguments {
    std::string data, output, plot;
    fit_options options;
    bool as_json = false;
};

constexpr const char *example =
    "Example:\n"
    "  compbox fit EZX.csv --name EZX --signal X --plot EZX.svg -o EZX.term.json\n"
    "reads position_mm,error_um (or error_urad) with optional columns run, direction and sigma,\n"
    "finds the curve that the readings tell from their noise, and writes it as a term for "
    "`compbox build`.\n"
    "With --tolerance-um every residual is brought inside it, noise or not. Where no curve reaches "
    "it\nthe closest one is written, a warning says so, the provenance has \"converged\": false, "
    "and the\nexit code is 0 all the same.";

void run_fit(const fit_arguments &arguments) {
    const fit_result result = fit_curve(read_measurement(arguments.data), arguments.options);
    if (!arguments.plot.empty()) plot_fit(result, arguments.plot);
    const json fragment = fragment_of(result);
    write_file(arguments.output, json_text(fragment));
    for (const auto &warning : result.warnings) {
        std::cerr << "compbox: " << arguments.data << ": " << warning << "\n";
    }
    std::cout << (arguments.as_json ? json_text(fragment) : report_of(result));
}

// What CLI11 cannot say by itself.
void check_usage(const fit_arguments &arguments) {
    const fit_options &options = arguments.options;
    if (options.method == fit_method::polyline && options.degree > 0) {
        throw CLI::ValidationError("--degree", "a polyline has none");
    }
    if (options.method != fit_method::polynomial && options.degree > max_spline_degree) {
        throw CLI::ValidationError("--degree", "a B-spline has degree 1 to 5");
    }
}

}  // namespace

void add_fit(CLI::App &app) {
    auto arguments = std::make_shared<fit_arguments>();
    fit_options &options = arguments->options;
    CLI::App *fit = app.add_subcommand("fit", "Fit a curve to a measured error of one axis");
    fit->footer(example);
    fit->add_option("data", arguments->data, "Measurement, DATA.csv")->required();
    fit->add_option("--name", options.name, "Name of the term, e.g. EZX")->required();
    fit->add_option("--signal", options.signal, "Signal the curve depends on, e.g. X")->required();
    const std::map<std::string, fit_method> methods = {{"bspline", fit_method::bspline},
                                                       {"bspline-lmc", fit_method::bspline_lmc},
                                                       {"polynomial", fit_method::polynomial},
                                                       {"polyline", fit_method::polyline}};
    fit->add_option("--method", options.method,
                    "bspline (default): fewest knots that lose nothing; bspline-lmc: key points "
                    "by curvature; polynomial; polyline")
        ->transform(CLI::Transformer(methods).description(""))
        ->option_text("METHOD");
    fit->add_option("--degree", options.degree, "Degree (B-spline 3, polynomial 7)")
        ->check(CLI::Range(1, 15).description(""))
        ->option_text("N");
    fit->add_option(
           "--tolerance-um", options.tolerance_um,
           "Largest residual allowed at a measured position, um (urad for angles); without "
           "it the noise decides")
        ->check(CLI::PositiveNumber.description(""))
        ->option_text("E");
    const std::map<std::string, reference_line> lines = {
        {"keep", reference_line::keep},
        {"end-point", reference_line::end_point},
        {"least-squares", reference_line::least_squares}};
    fit->add_option("--line", options.line,
                    "Straight line taken off first: keep (none, default), end-point, least-squares")
        ->transform(CLI::Transformer(lines).description(""))
        ->option_text("LINE");
    fit->add_option("--plot", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    fit->add_flag("--json", arguments->as_json, "Report as JSON (the fragment with its findings)");
    fit->add_option("-o,--output", arguments->output, "Term to write, TERM.json")->required();
    fit->callback([arguments] {
        check_usage(*arguments);
        run_fit(*arguments);
    });
}

}  // namespace compbox
