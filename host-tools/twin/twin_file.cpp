// SPDX-License-Identifier: MIT
#include "host-tools/twin/twin_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/json.h"
#include "host-tools/twin/geometry_file.h"
#include "host-tools/twin/process_file.h"
#include "host-tools/twin/reading.h"
#include "host-tools/twin/units.h"

namespace compbox::twin {

using namespace reading;

namespace {

constexpr double seconds_per_ms = 1e-3;

int axis_of_key(const std::string &key, const twin_config &config, const place &at) {
    const int axis = key.size() == 1 ? axis_index(key[0]) : -1;
    if (axis < 0) at.fail(fmt::format("'{}' is not an axis: X, Y or Z", key));
    if (!config.axes[static_cast<std::size_t>(axis)].present) {
        at.fail("the machine has no axis " + key);
    }
    return axis;
}

double within_travel(double position_mm, const twin_axis &axis, const place &at) {
    if (position_mm < axis.min_mm || position_mm > axis.max_mm) {
        at.fail(fmt::format("{} mm is outside the travel {} to {} mm", position_mm, axis.min_mm,
                            axis.max_mm));
    }
    return position_mm;
}

void read_travel(const json &value, twin_axis &axis, const place &at) {
    if (!value.is_array() || value.size() != 2) at.fail("must be [from, to] in mm");
    axis.min_mm = as_number(value[0], -1e6, 1e6, at.at(0));
    axis.max_mm = as_number(value[1], -1e6, 1e6, at.at(1));
    if (axis.max_mm - axis.min_mm < 1.0) at.fail("must be at least 1 mm long");
}

// in : the object of one axis; throws input_error with the place
// out: the axis in mm and s; measure_every_mm is a twentieth of the travel by default
twin_axis read_axis(const json &value, const place &at) {
    check_keys(value,
               {"travel_mm", "max_velocity_mm_per_min", "acceleration_mm_per_s2",
                "measure_every_mm", "cutoff_mm"},
               at);
    if (!value.contains("travel_mm")) at.fail("the key 'travel_mm' is missing");
    twin_axis axis;
    axis.present = true;
    read_travel(value.at("travel_mm"), axis, at.in("travel_mm"));
    const double length_mm = axis.max_mm - axis.min_mm;
    axis.max_velocity_mm_per_s =
        required(value, "max_velocity_mm_per_min", 1.0, 1e6, at) / s_per_min;
    axis.acceleration_mm_per_s2 = required(value, "acceleration_mm_per_s2", 1.0, 1e6, at);
    axis.measure_every_mm =
        optional(value, "measure_every_mm", length_mm / 20.0, length_mm / 10000.0, length_mm, at);
    axis.cutoff_mm = optional(value, "cutoff_mm", 5.0 * axis.measure_every_mm, length_mm / 100.0,
                              10.0 * length_mm, at);
    return axis;
}

void read_axes(const json &root, twin_config &config, const place &top) {
    const place at = top.in("axes");
    if (!root.contains("axes") || !root.at("axes").is_object() || root.at("axes").empty()) {
        at.fail("must be an object with the axes X, Y, Z that the machine has");
    }
    for (const auto &[key, value] : root.at("axes").items()) {
        const int axis = key.size() == 1 ? axis_index(key[0]) : -1;
        if (axis < 0) at.fail(fmt::format("'{}' is not an axis: X, Y or Z", key));
        config.axes[static_cast<std::size_t>(axis)] = read_axis(value, at.in(key));
    }
}

void read_spectrum(const json &root, twin_config &config, const place &top) {
    const json &value = optional_object(root, "spectrum", top);
    const place at = top.in("spectrum");
    check_keys(value, {"exponent", "roll_off"}, at);
    config.spectrum_exponent = optional(value, "exponent", 2.5, 0.0, 8.0, at);
    config.spectrum_roll_off = optional(value, "roll_off", 8.0, 2.0, 32.0, at);
}

// out: config.laser with the keys of root; throws input_error with the key of a wrong one
void read_laser(const json &root, twin_config &config, const place &top) {
    twin_laser &laser = config.laser;
    laser.sigma_um = optional(root, "laser_um", laser.sigma_um, 0.0, 1e3, top);
    if (root.contains("straightness_um")) {
        laser.straightness_um = required(root, "straightness_um", 0.0, 1e3, top);
    }
    laser.resolution_um =
        optional(root, "laser_resolution_um", laser.resolution_um, 1e-6, 1.0, top);
    const double runs = optional(root, "runs", laser.runs, 1.0, 1000.0, top);
    if (runs != std::floor(runs)) top.in("runs").fail("must be a whole number");
    laser.runs = static_cast<int>(runs);
    const json &value = optional_object(root, "setup", top);
    const place at = top.in("setup");
    check_keys(value, {"slope_urad", "offset_um"}, at);
    laser.slope_urad = optional(value, "slope_urad", laser.slope_urad, 0.0, 1e4, at);
    laser.offset_um = optional(value, "offset_um", laser.offset_um, 0.0, 1e6, at);
}

void read_nc(const json &root, twin_config &config, const place &top) {
    const json &value = optional_object(root, "nc", top);
    const place at = top.in("nc");
    check_keys(value, {"interpolation_ms", "comp_add_velo_factor", "compensation_sign"}, at);
    config.nc.interpolation_s =
        seconds_per_ms * optional(value, "interpolation_ms", 4.0, 0.5, 100.0, at);
    config.nc.comp_add_velo_factor = optional(value, "comp_add_velo_factor", 0.01, 1e-6, 1.0, at);
    const place signs = at.in("compensation_sign");
    for (const auto &[key, sign] : optional_object(value, "compensation_sign", at).items()) {
        const int axis = axis_of_key(key, config, signs);
        const double number = as_number(sign, -1.0, 1.0, signs.in(key));
        if (std::fabs(number) != 1.0) signs.in(key).fail("must be 1 or -1");
        config.axes[static_cast<std::size_t>(axis)].compensation_sign = number > 0.0 ? 1 : -1;
    }
}

// One number for every axis, or an object with a number for each axis that has its own.
void read_size(const json &value, twin_config &config, const place &at) {
    if (!value.contains("size_um")) return;
    const place here = at.in("size_um");
    const json &size = value.at("size_um");
    if (!size.is_object()) {
        config.plc.size_um = as_number(size, 0.0, 1e6, here);
        return;
    }
    for (const auto &[key, um] : size.items()) {
        const auto axis = static_cast<std::size_t>(axis_of_key(key, config, here));
        config.plc.axis_size_um[axis] = as_number(um, 0.0, 1e6, here.in(key));
    }
}

// Reads the key "plc", in s and µm; a missing key has its default. Throws input_error.
void read_plc(const json &root, twin_config &config, const place &top) {
    const json &value = optional_object(root, "plc", top);
    const place at = top.in("plc");
    check_keys(value,
               {"scan_ms", "watchdog_ms", "ramp_um_per_s", "slope_um_per_s", "size_um", "ahead_mm",
                "reference_s", "enable_s"},
               at);
    twin_plc &plc = config.plc;
    plc.scan_s = seconds_per_ms * optional(value, "scan_ms", 8.0, 0.5, 1000.0, at);
    plc.watchdog_s = seconds_per_ms * optional(value, "watchdog_ms", 200.0, 1.0, 1e6, at);
    plc.ramp_um_per_s = optional(value, "ramp_um_per_s", plc.ramp_um_per_s, 1e-3, 1e6, at);
    plc.slope_um_per_s = optional(value, "slope_um_per_s", plc.slope_um_per_s, 1e-3, 1e6, at);
    read_size(value, config, at);
    plc.ahead_mm = optional(value, "ahead_mm", plc.ahead_mm, 0.0, 1e6, at);
    plc.reference_s = optional(value, "reference_s", plc.reference_s, 0.0, 3600.0, at);
    plc.enable_s = optional(value, "enable_s", plc.enable_s, 0.0, 3600.0, at);
}

void read_probe(const json &root, twin_config &config, const place &top) {
    const json &value = optional_object(root, "probe", top);
    const place at = top.in("probe");
    check_keys(value, {"sigma_um", "duration_s", "interval_s", "wrong_fraction", "wrong_um"}, at);
    twin_probe &probe = config.probe;
    probe.sigma_um = optional(value, "sigma_um", probe.sigma_um, 0.0, 1e3, at);
    probe.duration_s = optional(value, "duration_s", probe.duration_s, 0.1, 3600.0, at);
    probe.interval_s = optional(value, "interval_s", 0.0, 0.0, 1e7, at);
    probe.wrong_fraction = optional(value, "wrong_fraction", 0.0, 0.0, 1.0, at);
    probe.wrong_um = optional(value, "wrong_um", probe.wrong_um, 0.0, 1e6, at);
}

void read_start(const json &root, twin_config &config, const place &top) {
    for (std::size_t a = 0; a < 3; ++a) config.start_mm[a] = config.axes[a].min_mm;
    const place at = top.in("start_mm");
    for (const auto &[key, value] : optional_object(root, "start_mm", top).items()) {
        const auto axis = static_cast<std::size_t>(axis_of_key(key, config, at));
        config.start_mm[axis] =
            within_travel(as_number(value, -1e6, 1e6, at.in(key)), config.axes[axis], at.in(key));
    }
}

// in : one element of the program; throws input_error with its place
// out: a move or a dwell, times in s, feed in mm/s
twin_step read_step(const json &value, const twin_config &config, const place &at) {
    check_keys(value,
               {"move_to_mm", "feed_mm_per_min", "dwell_s", "spindle_rpm", "depth_of_cut_mm"}, at);
    twin_step step;
    if (value.contains("spindle_rpm")) {
        step.spindle_rpm = required(value, "spindle_rpm", 0.0, 1e6, at);
    }
    if (value.contains("dwell_s")) {
        if (value.size() != (step.spindle_rpm ? 2 : 1)) {
            at.fail("is a move and a dwell at once; make two steps of it");
        }
        step.dwell_s = required(value, "dwell_s", 1e-3, 1e6, at);
        return step;
    }
    if (!value.contains("move_to_mm")) at.fail("needs 'move_to_mm' or 'dwell_s'");
    const place target = at.in("move_to_mm");
    const json &move = optional_object(value, "move_to_mm", at);
    if (move.empty()) target.fail("names no axis");
    for (const auto &[key, position] : move.items()) {
        const auto axis = static_cast<std::size_t>(axis_of_key(key, config, target));
        step.target_mm[axis] = within_travel(as_number(position, -1e6, 1e6, target.in(key)),
                                             config.axes[axis], target.in(key));
    }
    step.feed_mm_per_s = required(value, "feed_mm_per_min", 1e-3, 1e6, at) / s_per_min;
    step.depth_of_cut_mm = optional(value, "depth_of_cut_mm", 0.0, 0.0, 1e3, at);
    return step;
}

void read_program(const json &root, twin_config &config, const place &top) {
    if (!root.contains("program")) return;
    const place at = top.in("program");
    const json &program = root.at("program");
    if (!program.is_array()) at.fail("must be a list of moves and dwells");
    for (std::size_t i = 0; i < program.size(); ++i) {
        config.program.push_back(read_step(program[i], config, at.at(i)));
    }
}

void read_links(const json &root, twin_config &config, const place &top) {
    for (const auto &[name, value] : optional_object(root, "channels", top).items()) {
        const place at = top.in("channels").in(name);
        if (!value.is_string()) at.fail("must be the letter of an axis");
        config.channels[name] = axis_letters[axis_of_key(value.get<std::string>(), config, at)];
    }
    for (const auto &[name, value] : optional_object(root, "signals", top).items()) {
        config.signals[name] = as_number(value, -unlimited, unlimited, top.in("signals").in(name));
    }
    const std::string path = optional_text(root, "coefficients", top);
    if (!path.empty()) {
        config.coefficients =
            (std::filesystem::path(config.file).parent_path() / path).lexically_normal().string();
    }
}

std::uint64_t read_seed(const json &root, const place &at) {
    if (!root.contains("seed")) return 1;
    if (!root.at("seed").is_number_unsigned()) {
        at.in("seed").fail("must be a whole number, 0 or more");
    }
    return root.at("seed").get<std::uint64_t>();
}

}  // namespace

int axis_index(char letter) {
    const auto at = std::string_view(axis_letters).find(letter);
    return at == std::string_view::npos ? -1 : static_cast<int>(at);
}

std::optional<drive_place> find_drive(const twin_config &config, const std::string &name) {
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t side = 0; config.stages[a] && side < 2; ++side) {
            if (config.stages[a]->drives[side] == name) return drive_place{a, side};
        }
    }
    return std::nullopt;
}

std::optional<error_name> parse_error_name(const std::string &name) {
    if (name.size() != 3 || name[0] != 'E') return std::nullopt;
    const auto direction = std::string_view("XYZABC").find(name[1]);
    const int axis = axis_index(name[2]);
    if (direction == std::string_view::npos || axis < 0) return std::nullopt;
    return error_name{static_cast<int>(direction), axis};
}

twin_config load_twin(const std::string &path) {
    const json root = formats::read_json(path);
    const place top{path, ""};
    check_keys(root, {"format",       "machine",         "seed",
                      "axes",         "errors",          "chain",
                      "reference_mm", "tool_mm",         "squareness_urad",
                      "stages",       "unexplained",     "thermal",
                      "cutting",      "spectrum",        "repeatability_um",
                      "laser_um",     "straightness_um", "laser_resolution_um",
                      "runs",         "setup",           "nc",
                      "plc",          "probe",           "start_mm",
                      "program",      "channels",        "signals",
                      "coefficients"},
               top);
    if (optional_text(root, "format", top) != "compbox-twin/1") {
        top.in("format").fail("must be \"compbox-twin/1\"");
    }
    twin_config config;
    config.file = path;
    config.machine = optional_text(root, "machine", top);
    config.seed = read_seed(root, top);
    read_axes(root, config, top);
    read_geometry(root, config, top);
    config.unexplained_percent = optional(optional_object(root, "unexplained", top), "percent", 0.0,
                                          0.0, 100.0, top.in("unexplained"));
    if (root.contains("thermal")) config.thermal = read_thermal(root["thermal"], top.in("thermal"));
    if (root.contains("cutting")) config.cutting = read_cutting(root["cutting"], top.in("cutting"));
    read_spectrum(root, config, top);
    config.repeatability_um = optional(root, "repeatability_um", 0.3, 0.0, 1e3, top);
    read_laser(root, config, top);
    read_nc(root, config, top);
    read_plc(root, config, top);
    read_probe(root, config, top);
    read_start(root, config, top);
    read_program(root, config, top);
    read_links(root, config, top);
    return config;
}

}  // namespace compbox::twin
