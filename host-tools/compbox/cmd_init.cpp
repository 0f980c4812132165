// SPDX-License-Identifier: MIT
// compbox init: a machine file with sane defaults, for a person to complete.
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

// What is still to be done by hand, for the person who ran the command.
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

// Throws cli::usage_error for axes and travels that make no sense.
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
    auto command = app.add_subcommand("init", "Write a machine file with sane defaults");
    const auto options = std::make_shared<init_options>();
    auto &machine = options->machine;
    const std::vector<std::string> profiles = {"generic", "sinumerik-840d", "fanuc"};
    command.add_option("--axes", machine.axes, "Axis letters, as in XYZ").required();
    command.add_option("--profile", machine.profile, "Kind of control")
        .required()
        .check(one_of(profiles), listed(profiles));
    command.add_option("--name", machine.name, "Name of the machine").capture_default_str();
    command.add_option("--travel", options->travel, "Travels in mm: X=14300,Y=-1500:1500");
    command.add_option("--host", machine.host, "PLC's IP address")
        .capture_default_str()
        .check([](const std::string &text) {
            return cb_is_numeric_address(text.c_str())
                       ? std::string()
                       : fmt::format("'{}' is no IP address in numbers, as 192.168.0.10", text);
        });
    command.add_option("--port", machine.port, "PLC's TCP port")
        .capture_default_str()
        .check(whole_between(1, 65535), "in [1 - 65535]");
    command.add_option("--unit", machine.unit, "Modbus unit id")
        .capture_default_str()
        .check(whole_between(0, 255), "in [0 - 255]");
    command.add_option("--period-ms", machine.period_ms, "Period of the box")
        .capture_default_str()
        .check(between(1, 1000), "in [1 - 1000]");
    command.add_option("-o,--output", options->output, "Machine file to write").required();
    add_json(command, options->as_json);
    command.footer(
        "Example:\n  compbox init --axes XYZ --profile sinumerik-840d "
        "--travel X=14300,Y=3000,Z=2500 -o machine.json");
    command.callback([options](const cli::streams &io) { init(*options, io); });
}

}  // namespace compbox
