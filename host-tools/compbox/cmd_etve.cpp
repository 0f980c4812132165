// SPDX-License-Identifier: MIT
// compbox etve: the drift of a resting machine by its environment (ISO 230-3).
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/etve_report.h"

namespace compbox {

namespace {

struct etve_arguments {
    std::string log, plot, output;
    double window_min = 60.0;
    bool as_json = false;
};

constexpr const char *etve_example =
    R"(LOG has the time and what sensors between tool and table read while the machine rests: X_um,
B_urad, and temperatures such as air_degC; other units in brackets, as in "X [mm]".

Example:
  compbox etve night.csv --window-min 45 --plot etve.svg)";

// A column in another unit as one in this project's, with the unit in its name.
formats::wanted_column unit_of_log(const std::string &name, const formats::measuring_unit &is) {
    switch (is.of) {
        case formats::quantity::length:
            return {name + "_um", formats::find_unit("um")};
        case formats::quantity::angle:
            return {name + "_urad", formats::find_unit("urad")};
        case formats::quantity::temperature:
            return {name + "_degC", formats::find_unit("degC")};
        case formats::quantity::duration:
        case formats::quantity::rotation:
            break;
    }
    return formats::machine_unit(name, is);
}

void run_etve(const etve_arguments &arguments, const cli::streams &io) {
    cli::different_files({{"-o", arguments.output}, {"--plot", arguments.plot}});
    formats::csv_reading how;
    how.units = unit_of_log;
    const auto record = metrology::drift_record_of(formats::read_csv(arguments.log, how));
    json figures;
    figures["file"] = arguments.log;
    figures.update(test_report::etve_figures(record, arguments.window_min));
    if (!arguments.plot.empty()) test_report::plot_etve(record, arguments.log, arguments.plot);
    const std::string text = formats::json_text(figures);
    if (!arguments.output.empty()) formats::write_file(arguments.output, text, &io.out);
    if (cli::on_stdout({arguments.output})) return;
    io.out << (arguments.as_json ? text : test_report::etve_text(figures));
}

}  // namespace

void add_etve(cli::command &app) {
    const auto arguments = std::make_shared<etve_arguments>();
    cli::command etve =
        app.add_subcommand("etve", "Drift of a resting machine by its environment, ISO 230-3");
    etve.footer(etve_example);
    etve.add_option("LOG", arguments->log, "Displacements over time, LOG.csv").required();
    etve.add_option("--window-min M", arguments->window_min,
                    "Length of the measurements that the drift is for, minutes")
        .check(cli::above_zero())
        .capture_default_str();
    etve.add_option("--plot F.svg", arguments->plot, "Figure, F.svg, F.png or F.pdf");
    etve.add_flag("--json", arguments->as_json, "Print the figures as JSON");
    etve.add_option("-o,--output F.json", arguments->output, "Write the figures as JSON, F.json");
    etve.callback([arguments](const cli::streams &io) { run_etve(*arguments, io); });
}

}  // namespace compbox
