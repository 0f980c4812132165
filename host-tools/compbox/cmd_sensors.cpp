// SPDX-License-Identifier: MIT
// compbox sensors: what each sensor should read, by all others.
#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/sensors/sensor_map.h"

namespace compbox {

namespace {

struct sensors_arguments {
    std::string data, output;
    training::data_options columns;
    double after_s = 120.0, find = 5.0;
};

constexpr const char *sensors_example =
    R"(DATA has readings of healthy sensors, such as the record that the model was trained on. The box
compares the sensors with each other, and doubts one that all others contradict.

Example:
  compbox sensors warmup.csv --sensors 't*_degC' -o sensors.json
  compbox build machine.json net.json sensors.json -o coefficients.json)";

void run_sensors(sensors_arguments &arguments, const cli::streams &io) {
    arguments.columns.time_if_there = true;
    arguments.columns.find_runs = arguments.columns.run_column.empty();
    const training::training_data data =
        training::read_training_data(arguments.data, arguments.columns);
    const sensors::sensor_map map = sensors::map_sensors(data);
    const json fragment = sensors::fragment_of(map, arguments.after_s, arguments.data);
    if (!arguments.output.empty())
        formats::write_file(arguments.output, formats::json_text(fragment), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    io.out << sensors::report_of(map, data, arguments.find);
}

}  // namespace

void add_sensors(cli::command &app) {
    const auto arguments = std::make_shared<sensors_arguments>();
    cli::command sensors =
        app.add_subcommand("sensors", "Let the box check its sensors by each other");
    sensors.footer(sensors_example);
    sensors.add_option("DATA", arguments->data, "Readings of healthy sensors, DATA.csv").required();
    sensors
        .add_option("--sensors A,B", arguments->columns.inputs,
                    "Columns to compare, 3 to 32 of one unit; * matches any text")
        .required()
        .delimiter(',');
    sensors.add_option("--run-column NAME", arguments->columns.run_column,
                       "A new run begins where this column changes; default: by pauses or days");
    sensors.add_option("--time-column NAME", arguments->columns.time_column, "Seconds (time_s)");
    sensors
        .add_option("--after-s S", arguments->after_s,
                    "The box doubts a sensor that has disagreed for so long, s")
        .check(cli::between(1, 3600))
        .capture_default_str();
    sensors
        .add_option("--find K", arguments->find,
                    "Name the sensors whose offset of this size is not found")
        .check(cli::above_zero())
        .capture_default_str();
    sensors.add_option("-o,--output F.json", arguments->output, "Section to write, SENSORS.json");
    sensors.callback([arguments](const cli::streams &io) { run_sensors(*arguments, io); });
}

}  // namespace compbox
