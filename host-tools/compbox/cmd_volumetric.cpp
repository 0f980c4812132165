// SPDX-License-Identifier: MIT
// compbox volumetric: identified curves of the axes to one term of the whole working space.
#include <cmath>
#include <map>
#include <memory>
#include <ostream>

#include "host-tools/coefficients/volumetric.h"
#include "host-tools/command_line/key_values.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

extern "C" {
#include "firmware/base/limits.h"
#include "models/volumetric.h"
}

namespace compbox {

namespace {

struct volumetric_arguments {
    std::vector<std::string> folders, squareness, reference_points;
    std::vector<double> tool_offset_mm, tool_direction;
    std::vector<std::string> positions;
    std::string output;
    coefficients::volumetric_options options;
    bool as_json = false;
};

constexpr const char *volumetric_example =
    R"(Reads EXX.csv … ECZ.csv from the folders of identify. Errors are those of the tool relative to the
workpiece. C0Y > 0 opens the angle between +X and +Y, A0Z > 0 that between +Y and +Z, B0Z > 0
closes that between +X and +Z. A missing squareness is zero; a remark names it.

Example:
  compbox volumetric X Y Z --chain fXYZ --squareness C0Y=12.5,B0Z=-4 --tool-length-mm 150 \
      --name vol -o vol.json)";

void put_squareness(volumetric_arguments &arguments, const std::string &name, double urad) {
    if (arguments.options.squareness_urad.insert({name, urad}).second) return;
    throw cli::usage_error("--squareness", name + " is given twice");
}

// Reads a file of `compbox squareness`.
void read_squareness(volumetric_arguments &arguments, const std::string &path) {
    const json file = formats::read_json(path);
    const json values = formats::get<json>(file, "squareness_urad", path);
    for (const auto &[name, value] : values.items()) {
        const bool known = name == "C0Y" || name == "B0Z" || name == "A0Z";
        if (!known || !value.is_number() || std::fabs(value.get<double>()) > 1e5) {
            throw input_error(
                path, 0, 0, "squareness_urad.{} must be C0Y, B0Z or A0Z with a number up to 100000",
                name);
        }
        put_squareness(arguments, name, value.get<double>());
    }
    const json sigmas = formats::member_or_null(file, "sigma_urad");
    for (const auto &[name, sigma] : sigmas.items()) {
        if (!sigma.is_number() || !(sigma.get<double>() > 0.0)) continue;  // 0: not known
        arguments.options.squareness_sigma_urad[name] = sigma.get<double>();
    }
}

// Takes squareness from NAME=µrad and from files. Throws usage_error where a name comes twice.
void take_squareness(volumetric_arguments &arguments) {
    for (const auto &text : arguments.squareness) {
        if (text.find('=') == std::string::npos) {
            read_squareness(arguments, text);
            continue;
        }
        for (const auto &piece : cli::split_at_keys(text)) {
            const cli::key_values one = cli::parse_key_values("--squareness", piece);
            const bool known = one.key == "C0Y" || one.key == "B0Z" || one.key == "A0Z";
            if (!known || one.values.size() != 1 || std::fabs(one.values[0]) > 1e5) {
                throw cli::usage_error("--squareness", "'" + piece +
                                                           "' must be C0Y, B0Z or A0Z = a "
                                                           "number of urad up to 100000");
            }
            put_squareness(arguments, one.key, one.values[0]);
        }
    }
}

void take_reference_points(volumetric_arguments &arguments) {
    for (const auto &text : arguments.reference_points) {
        const cli::key_values one = cli::parse_key_values("--reference-point", text);
        const bool axis = one.key == "X" || one.key == "Y" || one.key == "Z";
        if (!axis || one.values.size() != 3) {
            throw cli::usage_error("--reference-point", "'" + text + "' must read X=x,y,z");
        }
        const coefficients::vector_mm point{one.values[0], one.values[1], one.values[2]};
        if (!arguments.options.reference_points_mm.insert({one.key, point}).second) {
            throw cli::usage_error("--reference-point", one.key + " is given twice");
        }
    }
}

void take_vector(const std::vector<double> &values, coefficients::vector_mm &place) {
    for (std::size_t k = 0; k < values.size(); ++k) place[k] = values[k];
}

// Takes the options that depend on each other. Throws usage_error that names the option.
void check_usage(volumetric_arguments &arguments) {
    coefficients::volumetric_options &options = arguments.options;
    std::uint8_t moves[CB_AXES];
    if (!cb_volumetric_chain(options.chain.c_str(), moves)) {
        throw cli::usage_error(
            "--chain",
            "must hold f, X, Y and Z once each, such as fXYZ: left of f what carries "
            "the workpiece, right of it the tool");
    }
    if (options.name.empty() || options.name.size() + 2 >= CB_NAME_SIZE) {
        throw cli::usage_error("--name", "must have 1 to 21 characters");
    }
    take_squareness(arguments);
    take_reference_points(arguments);
    take_vector(arguments.tool_offset_mm, options.tool_offset_mm);
    take_vector(arguments.tool_direction, options.tool_direction);
    for (std::size_t k = 0; k < arguments.positions.size(); ++k) {
        options.positions[k] = arguments.positions[k];
    }
    const coefficients::vector_mm &d = options.tool_direction;
    if (std::fabs(std::hypot(d[0], d[1], d[2]) - 1.0) > 4e-4) {
        throw cli::usage_error("--tool-direction", "must have the length 1, such as 0,0,-1");
    }
}

// out: figures of each curve, squareness, reference points and remarks
json report_json(const coefficients::volumetric_result &result) {
    json report;
    for (const auto &error : result.errors) {
        json one;
        one["file"] = error.file;
        one["unit"] = error.unit;
        one["positions"] = error.positions;
        one["coefficients"] = error.coefficients;
        one["range"] = error.range;
        one["residual_rms"] = error.residual_rms;
        one["slope_per_m"] = error.slope_per_m;
        one["warnings"] = error.warnings;
        report["errors"][error.name] = one;
    }
    report["not_measured"] = result.missing;
    report["squareness_urad"] = result.squareness_urad;
    for (const auto &[axis, point] : result.reference_points_mm) {
        report["reference_points_mm"][axis] = point;
    }
    if (result.diagonals) {
        report["diagonals"]["found_urad"] = json::object();
        for (const auto &[name, size] : result.diagonals->found) {
            report["diagonals"]["found_urad"][name] = {{"value", size.value},
                                                       {"sigma", size.sigma}};
        }
        report["diagonals"]["hidden"] = result.diagonals->hidden;
        report["diagonals"]["scale_ppm"] = result.diagonals->scale_ppm.value;
        report["diagonals"]["residual_um"] = result.diagonals->residual_um;
    }
    report["remarks"] = result.remarks;
    return report;
}

// The sizes that the diagonals show, a line each.
std::string text_of(const coefficients::diagonal_adjustment &found) {
    std::string text =
        fmt::format("\n  by diagonals, a reading within {:.2f} um (1 sigma):\n", found.residual_um);
    for (const auto &[name, size] : found.found) {
        text += fmt::format("  {}{:13.2f} urad, sigma {:.2f}{}\n", name, size.value, size.sigma,
                            name[0] == 'E' ? ": linear roll, from end to end of the curve" : "");
    }
    return text + fmt::format("  all readings are longer by {:.2f} ppm, which changes no error\n",
                              found.scale_ppm.value);
}

// The figures of report_json for reading.
std::string text_of(const coefficients::volumetric_result &result) {
    std::string text = "  error      range   residual rms  coefficients\n";
    for (const auto &error : result.errors) {
        text += fmt::format("  {}{:13.3f}{:15.3f}{:14}  {}\n", error.name, error.range,
                            error.residual_rms, error.coefficients, error.unit);
        for (const auto &warning : error.warnings) text += fmt::format("    {}\n", warning);
    }
    text += "\n  squareness, urad:";
    for (const auto &[name, value] : result.squareness_urad) {
        text += fmt::format("  {} {:.2f}", name, value);
    }
    if (result.diagonals) text += "\n" + text_of(*result.diagonals).substr(1);
    text += "\n  reference points, mm:";
    for (const auto &[axis, point] : result.reference_points_mm) {
        text += fmt::format("  {} ({:.1f}, {:.1f}, {:.1f})", axis, point[0], point[1], point[2]);
    }
    text += "\n";
    for (const auto &remark : result.remarks) text += fmt::format("  {}\n", remark);
    return text;
}

void run_volumetric(volumetric_arguments &arguments, const cli::streams &io) {
    check_usage(arguments);
    const coefficients::volumetric_result result =
        coefficients::make_volumetric(arguments.folders, arguments.options);
    formats::write_file(arguments.output, formats::json_text(result.fragment), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    io.out << (arguments.as_json ? formats::json_text(report_json(result)) : text_of(result));
}

// Options of chain, squareness, reference points and tool: µrad and mm.
void add_geometry(cli::command &command, volumetric_arguments &arguments) {
    coefficients::volumetric_options &options = arguments.options;
    command.add_option("--squareness C0Y=U,… | FILE.json", arguments.squareness,
                       "C0Y, B0Z, A0Z in urad, or files of `compbox squareness`; else zero");
    auto diagonals =
        command.add_option("--diagonals F.csv", options.diagonals,
                           "Laser readings along face and body diagonals: solves the squareness "
                           "that is not given, and linear roll");
    command
        .add_flag("--compensated", options.compensated,
                  "The box applied these curves, without squareness and linear roll, along the "
                  "diagonals")
        .needs(diagonals);
    command.add_option("--reference-point X=x,y,z …", arguments.reference_points,
                       "Origin of the frame in which an axis' errors were identified, in machine "
                       "coordinates with all axes at 0 (else its report.json's, else 0,0,0)");
    command
        .add_option("--tool-offset-mm x,y,z", arguments.tool_offset_mm,
                    "Spindle's gauge point, all axes at 0")
        .expected(3)
        .delimiter(',')
        .check(cli::any_number());
    command
        .add_option("--tool-direction x,y,z", arguments.tool_direction,
                    "From it to the tip (0,0,-1)")
        .expected(3)
        .delimiter(',')
        .check(cli::any_number());
    auto length =
        command.add_option("--tool-length-mm L", options.tool_length_mm, "Tool length (0)")
            .check(cli::between(-10000, 10000));
    command
        .add_option("--tool-length SIGNAL", options.tool_length_signal,
                    "Signal with the tool length, mm")
        .excludes(length);
    command.add_option("--positions X,Y,Z", arguments.positions, "Signals of the axes (X,Y,Z)")
        .expected(3)
        .delimiter(',');
}

// Options of the curves, as `compbox fit` has them.
void add_fit_options(cli::command &command, fitting::fit_options &fit) {
    const std::map<std::string, fitting::fit_method> methods = {
        {"bspline", fitting::fit_method::bspline},
        {"bspline-lmc", fitting::fit_method::bspline_lmc},
        {"polynomial", fitting::fit_method::polynomial},
        {"polyline", fitting::fit_method::polyline}};
    command.add_choice("--method METHOD", fit.method, methods,
                       "As in fit: bspline (default), bspline-lmc, polynomial, polyline");
    command
        .add_option("--tolerance-um E", fit.tolerance_um,
                    "As in fit, for all curves (urad for angles)")
        .check(cli::above_zero());
}

}  // namespace

void add_volumetric(cli::command &app) {
    auto arguments = std::make_shared<volumetric_arguments>();
    cli::command command =
        app.add_subcommand("volumetric", "Identified curves to a volumetric term");
    command.footer(volumetric_example);
    command.add_option("DIR", arguments->folders, "Folders of identify, DIR…").required();
    command
        .add_option("--chain CHAIN", arguments->options.chain,
                    "Kinematic chain, such as fXYZ or YfXZ")
        .required();
    add_geometry(command, *arguments);
    add_fit_options(command, arguments->options.fit);
    command.add_option("--name NAME", arguments->options.name, "Name of the term").required();
    command.add_flag("--json", arguments->as_json, "Print the findings as JSON");
    command.add_option("-o,--output TERM.json", arguments->output, "Term to write, TERM.json")
        .required();
    command.callback([arguments](const cli::streams &io) { run_volumetric(*arguments, io); });
}

}  // namespace compbox
