// SPDX-License-Identifier: MIT
// compbox report: ISO 230-1 and 230-2 figures of a measurement, before and after.
#include <fmt/core.h>

#include <memory>
#include <ostream>

#include "host-tools/command_line/key_values.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/conformity.h"
#include "host-tools/test_report/figures.h"
#include "host-tools/test_report/page.h"
#include "host-tools/test_report/plot.h"

namespace compbox {

using namespace test_report;

namespace {

struct report_arguments {
    std::string before, after, plot, page, output, limits, uncertainties;
    fitting::reading_options reading;
    particulars about;
    bool as_json = false;
};

constexpr const char *report_example =
    R"(Computes positioning by ISO 230-2 and straightness by ISO 230-1 from the same readings; use the
one that the set-up measured.

Example:
  compbox report before.rtl --after after.rtl --limit-um A=10,B=3 --page report.html)";

// "A=10,R=4" as values by figure. Throws usage_error unless each is above zero.
by_figure parse_figures(const std::string &option, const std::string &text) {
    by_figure values;
    if (text.empty()) return values;
    for (const auto &piece : cli::split_at_keys(text)) {
        const cli::key_values one = cli::parse_key_values(option, piece);
        if (one.values.size() != 1 || !(one.values[0] > 0.0)) {
            throw cli::usage_error(option,
                                   fmt::format("'{}' must be one number above zero", piece));
        }
        values[one.key] = one.values[0];
    }
    return values;
}

// Throws usage_error for a name that is no error of ISO 230-1.
void check_name(const particulars &about) {
    const std::string &name = about.name;
    if (!name.empty() && iso_name(name) != name) {
        throw cli::usage_error(
            "--name", fmt::format("'{}' is no error of ISO 230-1 such as EXX or EZX", name));
    }
}

// Throws usage_error for texts and uncertainties that no output has.
void check_use(const report_arguments &arguments) {
    const particulars &about = arguments.about;
    const bool texts = !(about.number + about.machine + about.serial + about.axis + about.location +
                         about.date + about.by + about.instrument + about.environment)
                            .empty();
    const std::string &page = arguments.page;
    if (page.find(".html", page.size() < 5 ? 0 : page.size() - 5) == std::string::npos &&
        !page.empty() && page != "-") {
        throw cli::usage_error("--page", fmt::format("'{}': a page is written as .html; print it "
                                                     "to PDF in a browser",
                                                     page));
    }
    if (!page.empty()) return;
    if (texts && arguments.plot.empty()) {
        throw cli::usage_error("texts such as --machine and --operator are for --page F.html");
    }
    if (!arguments.uncertainties.empty() && arguments.limits.empty()) {
        throw cli::usage_error("--uncertainty-um", "it needs --limit-um or --page");
    }
}

// Reports one file, or two and their difference, as text, JSON, figure or page. Throws input_error
// where the units differ.
void run_report(const report_arguments &arguments, const cli::streams &io) {
    check_name(arguments.about);
    check_use(arguments);
    cli::different_files(
        {{"-o", arguments.output}, {"--plot", arguments.plot}, {"--page", arguments.page}});
    const by_figure limits = parse_figures("--limit-um", arguments.limits);
    const by_figure uncertainties = parse_figures("--uncertainty-um", arguments.uncertainties);
    std::vector<fitting::measurement> data{
        fitting::read_measurement(arguments.before, arguments.reading)};
    if (!arguments.after.empty()) {
        data.push_back(fitting::read_measurement(arguments.after, arguments.reading));
    }
    json report = comparison_of(data);
    if (!limits.empty() || !uncertainties.empty()) {
        const json conformity =
            conformity_of(report[data.size() > 1 ? "after" : "before"], limits, uncertainties);
        if (!limits.empty()) report["conformity"] = conformity;
    }
    const particulars about = completed(arguments.about, data);
    if (!arguments.plot.empty()) plot_report(data, heading_of(about, data[0].unit), arguments.plot);
    if (!arguments.page.empty()) {
        formats::write_file(arguments.page, page_of(report, data, about, uncertainties), &io.out);
    }
    if (!arguments.output.empty())
        formats::write_file(arguments.output, formats::json_text(report), &io.out);
    io.out << (arguments.as_json ? formats::json_text(report) : text_of(report));
}

// What a page states where the files do not.
void add_particulars(cli::command &report, particulars &about) {
    report.add_option("--name EXX", about.name, "Error of ISO 230-1 (by default from the file)");
    const std::pair<const char *, std::pair<std::string &, const char *>> texts[] = {
        {"--number", {about.number, "Page: number of the report"}},
        {"--machine", {about.machine, "Page: machine (all of these: by default from the file)"}},
        {"--serial", {about.serial, "Page: serial number of the machine"}},
        {"--axis", {about.axis, "Page: axis"}},
        {"--location", {about.location, "Page: location"}},
        {"--date", {about.date, "Page: date of the measurement"}},
        {"--operator", {about.by, "Page: operator"}},
        {"--instrument", {about.instrument, "Page: instrument, with its calibration"}},
        {"--environment", {about.environment, "Page: temperatures, pressure, humidity"}}};
    for (const auto &[name, text] : texts) {
        report.add_option(name + std::string(" TEXT"), text.first, text.second);
    }
}

}  // namespace

void add_report(cli::command &app) {
    auto arguments = std::make_shared<report_arguments>();
    arguments->about.software = "compbox " CB_VERSION;
    cli::command report =
        app.add_subcommand("report", "ISO 230-1 and 230-2 figures, before and after");
    report.footer(report_example);
    report.add_option("DATA", arguments->before, "Measurement, DATA.csv or DATA.rtl").required();
    report.add_option("--after DATA.csv", arguments->after, "The same after compensation");
    report.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    report.add_option("--page F.html", arguments->page, "Test report for A4, F.html");
    report.add_option("--limit-um A=10,R=4", arguments->limits,
                      "Largest figures allowed, um (urad for angles), by name: A, R, E, M, B; A+ "
                      "forward, A- backward; end-point, least-squares, minimum-zone");
    report.add_option("--uncertainty-um A=1.2", arguments->uncertainties,
                      "Expanded uncertainty (k = 2) of figures, by the same names");
    report
        .add_option("--columns position_mm,error_um,run,…", arguments->reading.columns,
                    "Names of the columns of a file without a header")
        .delimiter(',');
    add_unit(report, arguments->reading);
    report.add_flag("--json", arguments->as_json, "Print the figures as JSON");
    report.add_option("-o,--output F.json", arguments->output, "Write the figures as JSON, F.json");
    add_particulars(report, arguments->about);
    report.callback([arguments](const cli::streams &io) { run_report(*arguments, io); });
}

}  // namespace compbox
