// SPDX-License-Identifier: MIT
// compbox export: a coefficient file to the tables that controls have of their own.
#include <memory>
#include <ostream>

#include "host-tools/coefficients/load.h"
#include "host-tools/command_line/key_values.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/export/cam.h"
#include "host-tools/export/plc.h"
#include "host-tools/export/program.h"
#include "host-tools/export/tables.h"
#include "host-tools/export/text.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox {

namespace {

using writer = std::vector<exports::output_file> (*)(const exports::channel_model &,
                                                     const exports::table_set &,
                                                     const exports::text_options &);

struct table_format {
    const char *name;
    bool cross;
    std::size_t most_points;
    bool lost_motion;
    writer write;
    const char *remark;  // what is left to do by hand; null: nothing
};

constexpr table_format formats[] = {
    {"linuxcnc-comp", false, 256, true, exports::linuxcnc_comp, nullptr},
    {"sinumerik-lec", false, 5000, false, exports::sinumerik_lec, nullptr},
    {"sinumerik-cec", true, 2000, true, exports::sinumerik_cec, nullptr},
    {"heidenhain-com", true, 256, true, exports::heidenhain_com,
     "write the control's .CMA table by hand: it assigns each .COM to its axis, and the control "
     "uses a .COM only if the active line of the .CMA names it"},
};
constexpr std::size_t most_cam_points = 10000;

struct export_arguments {
    std::string input, format, folder;
    std::vector<std::string> ranges, at, axes, names, lost_motion, path;
    std::string master = "X";
    std::optional<double> step_mm;
    std::size_t most_points = 0;
    int pmc_base = 0;
    exports::table_options table;
    exports::text_options text;
    bool as_json = false;
};

constexpr const char *export_example =
    R"(Values are in mm. docs/export.md lists the signs and their sources; make a sign test.

Example:
  compbox export coefficients.json --format sinumerik-cec --step-mm 50 -o cec
  compbox export coefficients.json --format twincat-cam --master X --path "Y=0.5*X+10" -o cams
  compbox export coefficients.json --format plc-program -o plc)";

// out: name and text of "NAME=text"; throws usage_error if one is empty
std::pair<std::string, std::string> pair_of(const std::string &option, const std::string &text) {
    const auto equals = text.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
        throw cli::usage_error(option, fmt::format("'{}' must read NAME=…", text));
    }
    return {text.substr(0, equals), text.substr(equals + 1)};
}

// Throws usage_error for a name that is there already.
template <typename kind>
void put(std::map<std::string, kind> &all, const std::string &option,
         const std::pair<std::string, kind> &one) {
    if (!all.insert(one).second) throw cli::usage_error(option, one.first + " is given twice");
}

std::map<std::string, double> numbers_of(const std::string &option,
                                         const std::vector<std::string> &texts) {
    std::map<std::string, double> all;
    for (const auto &text : texts) {
        for (const auto &piece : cli::split_at_keys(text)) {
            const cli::key_values one = cli::parse_key_values(option, piece);
            if (one.values.size() != 1) {
                throw cli::usage_error(option, fmt::format("'{}' must read NAME=number", piece));
            }
            put(all, option, {one.key, one.values[0]});
        }
    }
    return all;
}

std::map<std::string, std::string> texts_of(const std::string &option,
                                            const std::vector<std::string> &texts) {
    std::map<std::string, std::string> all;
    for (const auto &text : texts) put(all, option, pair_of(option, text));
    return all;
}

// in : "X=0:1000", several in one or more options
std::map<std::string, coefficients::travel_range> ranges_of(const std::vector<std::string> &texts) {
    std::map<std::string, coefficients::travel_range> all;
    for (const auto &text : texts) {
        for (const auto &piece : cli::split_at_keys(text)) {
            const auto [name, range] = pair_of("--range", piece);
            const auto colon = range.find(':');
            if (colon == std::string::npos) {
                throw cli::usage_error("--range", "'" + piece + "' must read NAME=from:to");
            }
            const auto from = cli::parse_key_values("--range", name + "=" + range.substr(0, colon));
            const auto to = cli::parse_key_values("--range", name + "=" + range.substr(colon + 1));
            if (from.values.size() != 1 || to.values.size() != 1 ||
                !(from.values[0] < to.values[0])) {
                throw cli::usage_error("--range", "'" + piece + "' must read NAME=from:to");
            }
            put(all, "--range", {name, {from.values[0], to.values[0]}});
        }
    }
    return all;
}

void take_options(export_arguments &arguments) {
    arguments.table.step_mm = arguments.step_mm;
    arguments.table.range = ranges_of(arguments.ranges);
    arguments.table.at = numbers_of("--at", arguments.at);
    arguments.table.axis_of = texts_of("--axis", arguments.axes);
    arguments.text.axis_name = texts_of("--name", arguments.names);
    arguments.text.lost_motion_um = numbers_of("--lost-motion-um", arguments.lost_motion);
    arguments.table.lost_motion_um = arguments.text.lost_motion_um;
    arguments.text.source = arguments.input.substr(arguments.input.find_last_of('/') + 1);
}

// Throws usage_error for a name that the file lacks.
void check_names(const exports::channel_model &model, const export_arguments &arguments) {
    const auto known = [&](const std::string &name, bool channels) {
        for (unsigned i = 0; channels && i < model.config().channels_count; ++i) {
            if (name == model.config().channels[i].name) return true;
        }
        for (unsigned i = 0; !channels && i < model.config().signals_count; ++i) {
            if (name == model.config().signals[i].name) return true;
        }
        return false;
    };
    const auto refuse = [&](const char *option, const std::string &name, const char *what) {
        throw input_error(arguments.input, 0, 0, "has no {} '{}' ({})", what, name, option);
    };
    for (const auto &[name, range] : arguments.table.range) {
        if (!known(name, false)) refuse("--range", name, "signal");
    }
    for (const auto &[name, axis] : arguments.table.axis_of) {
        if (!known(name, true)) refuse("--axis", name, "channel");
    }
    for (const auto &[name, um] : arguments.text.lost_motion_um) {
        if (!known(name, true)) refuse("--lost-motion-um", name, "channel");
    }
    for (const auto &[name, own] : arguments.text.axis_name) {
        if (!known(name, true) && !known(name, false)) refuse("--name", name, "channel or signal");
    }
}

// Throws usage_error where two channels, or two positions, get one name: one table would replace
// the other.
void check_pairs(const exports::channel_model &model, const export_arguments &arguments) {
    const bool sinumerik = arguments.format.compare(0, 9, "sinumerik") == 0;
    const auto add = [&](std::map<std::string, std::string> &taken, const std::string &name) {
        const std::string own = sinumerik ? exports::machine_axis(arguments.text, name)
                                          : exports::control_name(arguments.text, name);
        const auto [first, is_new] = taken.insert({own, name});
        if (is_new) return;
        throw cli::usage_error("--name",
                               fmt::format("{} and {} get one name, {}", first->second, name, own));
    };
    std::map<std::string, std::string> channels, positions;
    for (unsigned i = 0; i < model.config().channels_count; ++i) {
        add(channels, model.config().channels[i].name);
    }
    for (unsigned i = 0; i < model.config().signals_count; ++i) {
        if (model.is_position(i)) add(positions, model.config().signals[i].name);
    }
}

// Writes the files into the folder and prints their names and the losses.
void deliver(const export_arguments &arguments, const std::vector<exports::output_file> &files,
             const std::vector<std::string> &losses, const cli::streams &io) {
    formats::make_folder(arguments.folder);
    json report;
    report["files"] = json::array();
    for (const auto &file : files) {
        formats::write_file(fmt::format("{}/{}", arguments.folder, file.name), file.text);
        report["files"].push_back(fmt::format("{}/{}", arguments.folder, file.name));
    }
    report["losses"] = losses;
    if (arguments.as_json) {
        io.out << formats::json_text(report);
        return;
    }
    for (const auto &file : report["files"]) io.out << file.get<std::string>() << "\n";
    for (const auto &line : losses) io.out << "  " << line << "\n";
}

// Cam tables along a path. Throws usage_error for options that a cam cannot hold.
void export_cams(const exports::channel_model &model, const export_arguments &arguments,
                 const cli::streams &io) {
    if (!arguments.text.lost_motion_um.empty()) {
        throw cli::usage_error("--lost-motion-um", "a cam has one direction and cannot hold it");
    }
    if (arguments.text.sign != 1) {
        throw cli::usage_error("--sign", "a cam is a path, whose sign the coefficients decide");
    }
    for (const auto &[name, range] : arguments.table.range) {
        if (name == arguments.master) continue;
        throw cli::usage_error("--range", fmt::format("a cam runs over its master {}, not over {}",
                                                      arguments.master, name));
    }
    exports::cam_options how;
    how.master = arguments.master;
    for (const auto &text : arguments.path) {
        if (text.find('=') != std::string::npos) {
            put(how.path, "--path", pair_of("--path", text));
        } else if (how.path_file.empty()) {
            how.path_file = text;
        } else {
            throw cli::usage_error("--path", "takes one file");
        }
    }
    how.table = arguments.table;
    how.table.most_points = arguments.most_points ? arguments.most_points : most_cam_points;
    const exports::cam_set set = exports::make_cams(model, how);
    deliver(arguments, exports::twincat_cam(model, set, how, arguments.text),
            exports::cam_loss_lines(model, set, how), io);
}

// --lost-motion-um applies to a mean curve in a table of the channel's own axis. Throws usage_error
// without such a table.
void check_lost_motion(const exports::channel_model &model, const export_arguments &arguments,
                       const exports::table_set &tables) {
    for (const auto &[name, um] : arguments.text.lost_motion_um) {
        bool own = false;
        for (const auto &table : tables.tables) {
            for (const auto &column : table.columns) {
                if (!column.own || name != model.config().channels[column.channel].name) continue;
                own = true;
                if (column.half_um.empty()) continue;
                throw input_error(arguments.input, 0, 0,
                                  "the curve of channel {} has branches, which hold the lost "
                                  "motion already; leave out --lost-motion-um {}",
                                  name, name);
            }
        }
        if (own) continue;
        throw input_error(arguments.input, 0, 0,
                          "channel {} gets no table over its own axis to put the lost motion into; "
                          "leave out --lost-motion-um {}",
                          name, name);
    }
}

// A table that the control interpolates itself. Throws usage_error for options it cannot hold.
void export_table(const exports::channel_model &model, export_arguments &arguments,
                  const table_format &format, const cli::streams &io) {
    arguments.table.cross = format.cross;
    arguments.table.directions = format.lost_motion;
    arguments.table.most_points =
        arguments.most_points ? arguments.most_points : format.most_points;
    if (!format.lost_motion && !arguments.text.lost_motion_um.empty()) {
        throw cli::usage_error("--lost-motion-um",
                               "this table has one direction; set the control's backlash "
                               "machine data instead (SINUMERIK: MD32450)");
    }
    exports::table_set tables = exports::make_tables(model, arguments.table);
    if (format.remark != nullptr) tables.remarks.push_back(format.remark);
    check_lost_motion(model, arguments, tables);
    deliver(arguments, format.write(model, tables, arguments.text),
            exports::loss_lines(model, tables), io);
}

// Throws usage_error for an option of another format, which would change nothing.
void refuse_options_of_others(const export_arguments &arguments) {
    const bool cam = arguments.format == "twincat-cam";
    const struct {
        const char *option;
        bool is_given, acts;
        const char *formats;
    } options[] = {
        {"--unit", arguments.text.unit != "mm", arguments.format == "linuxcnc-comp",
         "linuxcnc-comp"},
        {"--trims", arguments.text.trims, arguments.format == "linuxcnc-comp", "linuxcnc-comp"},
        {"--first-table", arguments.text.first_table != 0, arguments.format == "sinumerik-cec",
         "sinumerik-cec"},
        {"--master", arguments.master != export_arguments().master, cam, "twincat-cam"},
        {"--path", !arguments.path.empty(), cam, "twincat-cam"},
        {"--name", !arguments.names.empty(), !cam, "the other tables"},
        {"--pmc-base", arguments.pmc_base != 0, arguments.format.compare(0, 4, "plc-") == 0,
         "plc-program and plc-db"}};
    for (const auto &one : options) {
        if (!one.is_given || one.acts) continue;
        throw cli::usage_error(one.option, fmt::format("it is for {}; --format {} has no use of it",
                                                       one.formats, arguments.format));
    }
}

// Throws usage_error for an option that acts on tables alone.
void refuse_table_options(const export_arguments &arguments) {
    const std::pair<const char *, bool> given[] = {
        {"--step-mm", arguments.step_mm.has_value()},
        {"--range", !arguments.ranges.empty()},
        {"--at", !arguments.at.empty()},
        {"--axis", !arguments.axes.empty()},
        {"--name", !arguments.names.empty()},
        {"--lost-motion-um", !arguments.lost_motion.empty()},
        {"--sign", arguments.text.sign != 1},
        {"--tolerance-um", arguments.table.tolerance_um != exports::table_options().tolerance_um},
        {"--most-points", arguments.most_points != 0}};
    for (const auto &[option, is_given] : given) {
        if (is_given)
            throw cli::usage_error(
                option, fmt::format("it is for tables; --format {} has none", arguments.format));
    }
}

// Exports registers and program. A machine file without curves suffices.
void export_registers(const export_arguments &arguments, const cli::streams &io) {
    refuse_table_options(arguments);
    const json file = formats::read_json(arguments.input);
    const bool has_terms = file.contains("terms") && file["terms"] != json::array();
    if (has_terms) coefficients::load_coefficients(arguments.input);
    const fakeplc::register_map map = fakeplc::load_register_map(arguments.input);
    const std::string &source = arguments.text.source;
    if (arguments.format == "plc-program") {
        return deliver(arguments, exports::plc_program(map, file, source, arguments.pmc_base), {},
                       io);
    }
    deliver(arguments, {exports::plc_registers(map, file, source, arguments.pmc_base)}, {}, io);
}

void run_export(export_arguments &arguments, const cli::streams &io) {
    take_options(arguments);
    refuse_options_of_others(arguments);
    if (arguments.format.compare(0, 4, "plc-") == 0) return export_registers(arguments, io);
    const exports::channel_model model(arguments.input);
    check_names(model, arguments);
    check_pairs(model, arguments);
    for (const auto &format : formats) {
        if (arguments.format == format.name) return export_table(model, arguments, format, io);
    }
    export_cams(model, arguments, io);
}

// Options of a table: step, tolerance, fixed signals, directions.
void add_table_options(cli::command &command, export_arguments &arguments) {
    command
        .add_option("--step-mm S", arguments.step_mm,
                    "Distance of the points (else the widest round one within the tolerance)")
        .check(cli::above_zero());
    command
        .add_option("--tolerance-um E", arguments.table.tolerance_um,
                    "Largest table step error wanted (0.1)")
        .check(cli::above_zero());
    command
        .add_option("--most-points N", arguments.most_points,
                    "Points that the control's table holds (linuxcnc-comp and heidenhain-com 256, "
                    "sinumerik-lec 5000, sinumerik-cec 2000, twincat-cam 10000)")
        .check(cli::whole_between(2, 100000));
    command.add_option("--range X=0:1000 …", arguments.ranges,
                       "Positions from where to where (else the curves')");
    command.add_option("--at T1=20 …", arguments.at,
                       "Values of signals that the table cannot follow");
    command.add_option("--axis CHANNEL=SIGNAL …", arguments.axes,
                       "Position signal of a channel, where its name does not say");
}

}  // namespace

void add_export(cli::command &app) {
    auto arguments = std::make_shared<export_arguments>();
    cli::command command =
        app.add_subcommand("export", "Tables for controls that compensate themselves");
    command.footer(export_example);
    command.add_option("COEFFICIENTS", arguments->input, "Coefficient file").required();
    command
        .add_option("--format FORMAT", arguments->format,
                    "linuxcnc-comp, sinumerik-lec, sinumerik-cec, heidenhain-com, twincat-cam; "
                    "plc-program: the PLC's program and registers; plc-db: the registers alone")
        .required()
        .check(cli::one_of({"linuxcnc-comp", "sinumerik-lec", "sinumerik-cec", "heidenhain-com",
                            "twincat-cam", "plc-program", "plc-db"}));
    add_table_options(command, *arguments);
    command.add_option("--name X=AX1 …", arguments->names,
                       "The control's name of an axis (SINUMERIK else X1, Y1 …)");
    command.add_option("--lost-motion-um X=3 …", arguments->lost_motion,
                       "Mean of forward - backward error of a channel's own axis, as report prints "
                       "it (B mean)");
    command
        .add_option("--sign 1|-1", arguments->text.sign,
                    "1 (default) or -1: inverts every value, if the sign test fails with 1")
        .check(cli::one_of({"1", "-1"}));
    command
        .add_option("--first-table T", arguments->text.first_table,
                    "sinumerik-cec: index of the first table (0)")
        .check(cli::whole_between(0, 1000));
    command.add_flag("--trims", arguments->text.trims,
                     "linuxcnc-comp: COMP_FILE_TYPE 1, trims instead of positions");
    command
        .add_option("--unit mm|inch", arguments->text.unit,
                    "linuxcnc-comp: LINEAR_UNITS of the machine's INI file (mm)")
        .check(cli::one_of({"mm", "inch"}));
    command.add_option("--master SIGNAL", arguments->master,
                       "twincat-cam: signal of the master axis (X)");
    command.add_option(
        "--path Y=0.5*X | FILE.csv", arguments->path,
        "twincat-cam: another axis along the path, Y=formula of the master, or a CSV "
        "file with a column for each axis");
    command
        .add_option("--pmc-base D", arguments->pmc_base,
                    "plc-program and plc-db, fanuc: D address of register 0 (0)")
        .check(cli::whole_between(0, 100000));
    command.add_flag("--json", arguments->as_json, "Print files and losses as JSON");
    command.add_option("-o,--output DIR", arguments->folder, "Folder for the tables, DIR")
        .required();
    command.callback([arguments](const cli::streams &io) { run_export(*arguments, io); });
}

}  // namespace compbox
