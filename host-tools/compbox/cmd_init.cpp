// SPDX-License-Identifier: MIT
// compbox init: a machine file with default values, for a person to complete.
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/load/host.h"
}

namespace compbox {

namespace {

struct init_options {
    coefficients::machine_options machine;
    std::string travel;
    std::string output;
    bool as_json = false;
};

// out: the values that the user has to complete
std::vector<std::string> hints(const coefficients::machine_options &options) {
    std::string unset;
    for (const char axis : options.axes) {
        if (options.travel.count(axis) == 0) unset += std::string(unset.empty() ? "" : ", ") + axis;
    }
    std::vector<std::string> all;
    if (!unset.empty()) {
        all.push_back("To set: min and max of " + unset +
                      " (or --travel); where they stay null, build takes the range of the curves.");
    }
    all.push_back(
        "To check against the PLC program: registers, types, scales; limit_um and "
        "slew_um_per_s of each channel; sign by a sign test on the machine.");
    return all;
}

// Throws cli::usage_error for invalid axes and travels.
json machine_of(init_options &options) {
    try {
        if (!options.travel.empty())
            options.machine.travel = coefficients::parse_travel(options.travel);
        return coefficients::new_machine(options.machine);
    } catch (const input_error &error) {
        throw cli::usage_error(error.what());
    }
}

void init(init_options &options, const cli::streams &io) {
    write_file(options.output, json_text(machine_of(options)), &io.out);
    const auto to_do = hints(options.machine);
    if (options.as_json) {
        return print_summary(io.out, {options.output}, {{"machine", options.machine.name}}, to_do);
    }
    if (options.output == "-") return;
    for (const auto &hint : to_do) io.out << hint << "\n";
}

}  // namespace

void add_init(cli::command &app) {
    auto command = app.add_subcommand("init", "Write a machine file with default values");
    const auto options = std::make_shared<init_options>();
    auto &machine = options->machine;
    command.add_option("--axes XYZ", machine.axes, "Axis letters").required();
    command
        .add_option("--profile KIND", machine.profile,
                    "Kind of control: generic, sinumerik-840d or fanuc")
        .required()
        .check(one_of({"generic", "sinumerik-840d", "fanuc"}));
    command.add_option("--name NAME", machine.name, "Name of the machine").capture_default_str();
    command.add_option("--travel X=A:B,…", options->travel, "Travels in mm: X=14300,Y=-1500:1500");
    command.add_option("--host IP", machine.host, "PLC's IP address")
        .capture_default_str()
        .check([](const std::string &text) {
            return cb_is_numeric_address(text.c_str())
                       ? std::string()
                       : fmt::format("'{}' is not a numeric IP address such as 192.168.0.10", text);
        });
    command.add_option("--port N", machine.port, "PLC's TCP port, 1 to 65535")
        .capture_default_str()
        .check(whole_between(1, 65535));
    command.add_option("--unit N", machine.unit, "Modbus unit id, 0 to 255")
        .capture_default_str()
        .check(whole_between(0, 255));
    command.add_option("--period-ms T", machine.period_ms, "Period of the box, 1 to 1000")
        .capture_default_str()
        .check(between(1, 1000));
    command.add_option("-o,--output F.json", options->output, "Machine file to write").required();
    add_json(command, options->as_json);
    command.footer(
        "Example:\n  compbox init --axes XYZ --profile sinumerik-840d "
        "--travel X=14300,Y=3000,Z=2500 -o machine.json");
    command.callback([options](const cli::streams &io) { init(*options, io); });
}

}  // namespace compbox
