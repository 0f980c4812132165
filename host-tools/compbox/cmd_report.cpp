// SPDX-License-Identifier: MIT
// compbox report: ISO 230-1 and 230-2 figures of a measurement, before and after.
#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <ostream>

#include "host-tools/command_line/key_values.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/reading_arguments.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/conformity.h"
#include "host-tools/test_report/cycle.h"
#include "host-tools/test_report/drift_report.h"
#include "host-tools/test_report/figures.h"
#include "host-tools/test_report/gaps.h"
#include "host-tools/test_report/page.h"
#include "host-tools/test_report/plot.h"
#include "host-tools/test_report/temperature.h"
#include "host-tools/test_report/uncertainty.h"

namespace compbox {

using namespace test_report;

namespace {

struct report_arguments {
    std::string before, after, plot, page, output, limits, uncertainties, budget;
    std::optional<double> period_mm;
    scale_arguments scale;
    std::vector<double> after_degC, dropped_mm;
    std::vector<std::string> dropped_runs;
    fitting::reading_options reading;
    particulars about;
    bool as_json = false;
    bool drift = false, weekly = false;
    unsigned reference = 0;  // periods
};

constexpr const char *report_example =
    R"(Computes positioning by ISO 230-2 and straightness by ISO 230-1 from the same readings; use the
one that the set-up measured.

With --drift DATA is a record with probe columns, the table of `join`, or predictions of `train`: what
is left by day, and the day from which the model has drifted.

Example:
  compbox report before.rtl --after after.rtl --limit-um A=10,B=3 --page report.html
  compbox report EXX.rtl --budget device-um-per-m=0.8,misalignment-mm=1,eve-um=0.6 --limit-um A=10)";

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

// "device-um=0.5,eve-um=1" into the inputs. Throws usage_error for another key, and for values that
// are not one number of zero or more.
void parse_budget(const std::string &text, metrology::budget_inputs &inputs) {
    const char *const option = "--budget";
    const std::pair<const char *, std::optional<double> &> known[] = {
        {"device-um", inputs.device_um},
        {"device-um-per-m", inputs.device_um_per_m},
        {"misalignment-mm", inputs.misalignment_mm},
        {"temperature-K", inputs.temperature_K},
        {"expansion-range", inputs.expansion_range},
        {"eve-um", inputs.eve_um}};
    std::string keys;
    for (const auto &one : known) keys += (keys.empty() ? "" : ", ") + std::string(one.first);
    for (const auto &piece : cli::split_at_keys(text)) {
        const cli::key_values one = cli::parse_key_values(option, piece);
        const auto *const place = std::find_if(std::begin(known), std::end(known),
                                               [&](auto &input) { return one.key == input.first; });
        if (place == std::end(known)) {
            throw cli::usage_error(
                option,
                fmt::format("'{}' is no input of a budget; the inputs are {}", one.key, keys));
        }
        if (one.values.size() != 1 || one.values[0] < 0.0) {
            throw cli::usage_error(option,
                                   fmt::format("'{}' must be one number, zero or more", piece));
        }
        place->second = one.values[0];
    }
}

// The scale of each measurement as the options state it. Throws usage_error for more than two
// temperatures.
scale_temperature stated_scale(const report_arguments &arguments, bool after) {
    scale_arguments scale = arguments.scale;
    if (!after || arguments.after_degC.empty()) return stated_scale(scale);
    scale.degC = arguments.after_degC;
    return stated_scale(scale, "--after-degC");
}

// Takes the repeated first target off each measurement, and converts it to 20 °C where that is
// stated. out: the figures of all, with remarks on both
json figures_at_20_degC(std::vector<fitting::measurement> &data, const report_arguments &arguments,
                        const std::string &name) {
    std::vector<json> done;
    std::vector<std::optional<formats::repeated_target>> repeated;
    for (auto &one : data) repeated.push_back(take_off_repeat(one));
    drop(data, arguments.dropped_runs, arguments.dropped_mm);
    for (std::size_t i = 0; i < data.size(); ++i) {
        done.push_back(convert_to_20_degC(data[i], stated_scale(arguments, i > 0), name));
    }
    json report = comparison_of(data);
    for (std::size_t i = 0; i < data.size(); ++i) {
        json &figures = report[i == 0 ? "before" : "after"];
        add_conversion(figures, done[i]);
        add_cycle(figures, repeated[i], arguments.period_mm);
    }
    return report;
}

// Adds the uncertainty of each measurement by the budget, and what is stated of the judged one.
void add_uncertainties(json &report, const std::vector<fitting::measurement> &data,
                       const report_arguments &arguments) {
    metrology::budget_inputs inputs;
    if (!arguments.budget.empty()) parse_budget(arguments.budget, inputs);
    for (std::size_t i = 0; i < data.size() && !arguments.budget.empty(); ++i) {
        const scale_temperature scale = completed(stated_scale(arguments, i > 0), data[i]);
        inputs.expansion_um_per_m_K = scale.expansion_um_per_m_K;
        inputs.material_degC.reset();
        if (scale.degC) inputs.material_degC = 0.5 * (scale.degC->start + scale.degC->end);
        json &figures = report[i == 0 ? "before" : "after"];
        add_uncertainty(figures, data[i], with_drift(inputs, figures));
    }
    add_stated(report[data.size() > 1 ? "after" : "before"],
               parse_figures("--uncertainty-um", arguments.uncertainties));
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
    std::vector<fitting::measurement> data{
        fitting::read_measurement(arguments.before, arguments.reading)};
    if (!arguments.after.empty()) {
        data.push_back(fitting::read_measurement(arguments.after, arguments.reading));
    }
    const particulars about = completed(arguments.about, data);
    json report = figures_at_20_degC(data, arguments, about.name);
    add_uncertainties(report, data, arguments);
    const json &judged = report[data.size() > 1 ? "after" : "before"];
    if (!limits.empty()) {
        report["conformity"] = conformity_of(judged, limits, uncertainties_in(judged));
    }
    if (!arguments.plot.empty()) plot_report(data, heading_of(about, data[0].unit), arguments.plot);
    if (!arguments.page.empty()) {
        formats::write_file(arguments.page, page_of(report, data, about), &io.out);
    }
    if (!arguments.output.empty())
        formats::write_file(arguments.output, formats::json_text(report), &io.out);
    if (cli::on_stdout({arguments.output, arguments.page})) return;
    io.out << (arguments.as_json ? formats::json_text(report) : text_of(report));
}

// Reports periods and the day from which a model has drifted, as text, JSON and figure. Throws
// usage_error for options of measurements beside --drift, input_error for a table without
// residuals.
void run_drift(const report_arguments &arguments, const cli::streams &io) {
    if (!arguments.after.empty() || !arguments.page.empty() || !arguments.limits.empty() ||
        !arguments.budget.empty()) {
        throw cli::usage_error("--drift",
                               "stands without --after, --page, --limit-um and --budget");
    }
    cli::different_files({{"-o", arguments.output}, {"--plot", arguments.plot}});
    metrology::drift_options options;
    options.reference = arguments.reference;
    if (arguments.weekly) options.period_s = 604800.0;
    formats::csv_reading with_gaps;
    with_gaps.gaps = true;
    const auto drifts =
        drifts_of(metrology::residuals_in(formats::read_csv(arguments.before, with_gaps)), options);
    const std::string figures = formats::json_text(drift_figures(drifts, options));
    if (!arguments.plot.empty()) plot_drifts(drifts, options, arguments.plot);
    if (!arguments.output.empty()) formats::write_file(arguments.output, figures, &io.out);
    if (cli::on_stdout({arguments.output})) return;
    io.out << (arguments.as_json ? figures : drift_text(drifts, options));
}

// Options of the drift of a model over months.
void add_drift(cli::command &report, report_arguments &arguments) {
    report.add_flag("--drift", arguments.drift,
                    "What is left of probed errors by day, and since when the model has drifted");
    report.add_flag("--weekly", arguments.weekly, "With --drift: by week");
    report
        .add_option("--reference N", arguments.reference,
                    "With --drift: the first N days or weeks are right (a fifth, at least 7)")
        .check(cli::whole_between(2, 1000));
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
    report.add_option(
        "--budget device-um=0.5,eve-um=1", arguments->budget,
        "Uncertainty budget by ISO/TR 230-9 (um; urad for angles), of: device-um and "
        "device-um-per-m (k = 2), misalignment-mm, temperature-K (range of its error), "
        "expansion-range (of the coefficient's error, um/m per K), eve-um (drift)");
    add_scale(report, arguments->scale);
    report
        .add_option("--after-degC T", arguments->after_degC,
                    "The same of --after (by default as --material-degC)")
        .delimiter(',')
        .check(cli::between(-50.0, 150.0));
    report.add_option("--drop-run NAME", arguments->dropped_runs, "Runs to leave out, NAME,NAME")
        .delimiter(',');
    report.add_option("--drop-target MM", arguments->dropped_mm, "Targets to leave out, MM,MM")
        .delimiter(',')
        .check(cli::any_number());
    report
        .add_option("--period-mm P", arguments->period_mm,
                    "Period of an error that the targets must meet, such as a screw's pitch")
        .check(cli::above_zero());
    report
        .add_option("--columns position_mm,error_um,run,…", arguments->reading.columns,
                    "Names of the columns of a file without a header")
        .delimiter(',');
    add_unit(report, arguments->reading);
    report.add_flag("--json", arguments->as_json, "Print the figures as JSON");
    report.add_option("-o,--output F.json", arguments->output, "Write the figures as JSON, F.json");
    add_particulars(report, arguments->about);
    add_drift(report, *arguments);
    report.callback([arguments](const cli::streams &io) {
        arguments->drift ? run_drift(*arguments, io) : run_report(*arguments, io);
    });
}

}  // namespace compbox
