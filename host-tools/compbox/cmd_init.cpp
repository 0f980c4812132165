// SPDX-License-Identifier: MIT
// compbox init: a machine file with default values, for a person to complete.
#include <fmt/format.h>

#include <memory>
#include <ostream>
#include <string>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/prompt.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/register_layout.h"

extern "C" {
#include "firmware/load/host.h"
}

namespace compbox {

namespace {

constexpr double least_travel_mm = 20.0, most_travel_mm = 100000.0;  // of a machine tool, about

struct init_options {
    coefficients::machine_options machine;
    std::string travel;
    std::string output;
    bool as_json = false;
};

// out: the answer of a person at a terminal; "" from a script, which gets no question
std::string ask(cli::prompt &person, const std::string &question) {
    return person.at_terminal() ? person.ask(question + " ").value_or("") : "";
}

// Asks for a value that is missing. Throws cli::usage_error where it stays so.
void need(cli::prompt &person, std::string &value, const char *option,
          const std::string &question) {
    if (value.empty()) value = ask(person, question);
    if (value.empty()) throw cli::usage_error(option, fmt::format("is required: {}", question));
}

// Asks for the values that init needs, and for travels if the axes were asked for too.
void complete(init_options &options, const cli::streams &io) {
    cli::prompt person(io);
    auto &machine = options.machine;
    const bool begin = machine.axes.empty();
    need(person, machine.axes, "--axes", "axes of the machine, as in XYZ or X,Y1+Y2,Z");
    need(person, machine.profile, "--profile",
         fmt::format("kind of control: {}", fmt::join(formats::layout_names(), ", ")));
    need(person, machine.host, "--host", "IP address of the PLC, as in 192.168.0.10");
    if (!begin || !options.travel.empty()) return;
    options.travel =
        ask(person, "travels in mm, as in X=14300,Y=-1500:1500 (Enter: from the curves)");
}

// out: what a person has to set or check next, a sentence each
std::vector<std::string> hints(const coefficients::machine_options &options) {
    std::vector<std::string> unset, pairs;
    for (const auto &axis : coefficients::parse_axes(options.axes)) {
        if (axis.motors.size() > 1) pairs.push_back(axis.name);
        if (options.travel.count(axis.name) == 0) unset.push_back(axis.name);
    }
    std::vector<std::string> all;
    for (const auto &[axis, range] : options.travel) {
        if (range.to_mm - range.from_mm >= least_travel_mm &&
            range.to_mm - range.from_mm <= most_travel_mm)
            continue;
        all.push_back(fmt::format("To check: the travel of {} is {:.6g} mm; --travel is in mm.",
                                  axis, range.to_mm - range.from_mm));
    }
    if (!unset.empty()) {
        all.push_back(fmt::format(
            "To set: min and max of {} (or --travel); where they stay null, build takes the range "
            "of the curves.",
            fmt::join(unset, ", ")));
    }
    if (!pairs.empty()) {
        all.push_back(fmt::format(
            "To check with the builder of the machine: max_difference_um of the pair of {}.",
            fmt::join(pairs, ", ")));
    }
    all.push_back(
        "To check: limit_um and slew_um_per_s of each channel; sign by a sign test on the "
        "machine.");
    for (const auto &probe : coefficients::probed_axes(options)) {
        all.push_back(fmt::format(
            "Probe of {}: a term that adapts names \"probe\": {{\"value\": \"{}\", \"count\": "
            "\"{}\"}}.",
            probe.axis, probe.value, probe.count));
    }
    all.push_back(
        "Registers: compbox export --format plc-program writes the PLC's program and data for "
        "them.");
    return all;
}

// Throws cli::usage_error for invalid axes, travels and answers.
json machine_of(init_options &options, const cli::streams &io) {
    auto &machine = options.machine;
    complete(options, io);
    const std::string fault = cli::one_of(formats::layout_names())(machine.profile);
    if (!fault.empty()) throw cli::usage_error("--profile", fault);
    if (!cb_is_numeric_address(machine.host.c_str())) {
        throw cli::usage_error("--host",
                               fmt::format("'{}' is not a numeric IP address such as 192.168.0.10",
                                           formats::printable(machine.host)));
    }
    try {
        if (!options.travel.empty()) machine.travel = coefficients::parse_travel(options.travel);
        return coefficients::new_machine(machine);
    } catch (const input_error &error) {
        throw cli::usage_error(error.what());
    }
}

void init(init_options &options, const cli::streams &io) {
    formats::write_file(options.output, formats::json_text(machine_of(options, io)), &io.out);
    const auto to_do = hints(options.machine);
    if (options.as_json) {
        return cli::print_summary(io.out, {options.output}, {{"machine", options.machine.name}},
                                  to_do);
    }
    if (cli::on_stdout({options.output})) return;
    for (const auto &hint : to_do) io.out << hint << "\n";
}

}  // namespace

void add_init(cli::command &app) {
    auto command = app.add_subcommand("init", "Write a machine file with default values");
    const auto options = std::make_shared<init_options>();
    auto &machine = options->machine;
    machine.profile.clear();
    command.add_option("--axes LIST", machine.axes,
                       "Axes: XYZ, or with commas X,Z1; a stage with two motors Y1+Y2");
    command
        .add_option("--profile KIND", machine.profile,
                    fmt::format("Kind of control: {}", fmt::join(formats::layout_names(), ", ")))
        .check(cli::one_of(formats::layout_names()));
    command.add_option("--name NAME", machine.name, "Name of the machine").capture_default_str();
    command.add_option("--travel X=A:B,…", options->travel, "Travels in mm: X=14300,Y=-1500:1500");
    command.add_flag("--motor-positions", machine.motor_positions,
                     "Of a stage with two motors: a position of each motor");
    command.add_option("--probe LIST", machine.probe,
                       "Axes with a touch probe, as X,Z: a value, a count, and the box's request");
    command.add_option("--host IP", machine.host, "PLC's IP address (fakeplc: 127.0.0.1)");
    command.add_option("--port N", machine.port, "PLC's TCP port, 1 to 65535")
        .capture_default_str()
        .check(cli::whole_between(1, 65535));
    command.add_option("--unit N", machine.unit, "Modbus unit id, 0 to 255")
        .capture_default_str()
        .check(cli::whole_between(0, 255));
    command.add_option("--period-ms T", machine.period_ms, "Period of the box, 1 to 1000")
        .capture_default_str()
        .check(cli::between(1, 1000));
    command.add_option("-o,--output F.json", options->output, "Machine file to write").required();
    cli::add_json(command, options->as_json);
    command.footer(
        "Example:\n  compbox init --axes X,Y1+Y2,Z --profile sinumerik-840d --host 192.168.0.10 "
        "--travel X=14300,Y=3000,Z=2500 -o machine.json\n"
        "At a terminal init asks for what is missing. With fakeplc: --host 127.0.0.1 --port 1502.");
    command.callback([options](const cli::streams &io) { init(*options, io); });
}

}  // namespace compbox
