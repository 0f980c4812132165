// SPDX-License-Identifier: MIT
#include "host-tools/simulation/scenario.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::simulation {

namespace {

constexpr double mm_per_min = 1.0 / 60.0;
constexpr double slowest_mm_per_min = 1e-3, fastest_mm_per_min = 1e7;  // feeds

// out: a path of the scenario file, which is relative to that file
std::string beside(const std::string &file, const std::string &path) {
    return (std::filesystem::path(file).parent_path() / path).string();
}

twin::xyz position_of(const json &value, const std::string &file, const std::string &place) {
    formats::only_keys(value, {"X", "Y", "Z"}, file, place);
    twin::xyz position = {};
    for (std::size_t a = 0; a < 3; ++a) {
        position[a] = formats::get_or(value, std::string(1, twin::axis_letters[a]), 0.0, file);
    }
    return position;
}

// A method's name is the name of its folder too.
void check_folder_name(const std::string &name, const std::string &file) {
    const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
    if (!name.empty() && std::all_of(name.begin(), name.end(), fits)) return;
    throw input_error(file, 0, 0,
                      "methods[].name must be letters, digits, '_' and '-': a folder is named so");
}

coefficients::fit_recipe recipe_of(const json &value, const std::string &file) {
    coefficients::fit_recipe method;
    method.file = file;
    method.name = formats::get<std::string>(value, "name", file);
    method.method = formats::get_or(value, "method", method.name, file);
    method.line = formats::get_or(value, "line", std::string("keep"), file);
    method.degree = formats::get_or(value, "degree", 0, file);
    method.tolerance_um =
        formats::get_or(value, "tolerance_um", std::map<std::string, double>(), file);
    return method;
}

scenario_method method_of(const json &value, const std::string &file) {
    formats::only_keys(value, {"name", "method", "line", "degree", "tolerance_um", "steps"}, file,
                       "methods[]");
    scenario_method method;
    method.name = formats::get<std::string>(value, "name", file);
    check_folder_name(method.name, file);
    method.steps = formats::get_or(value, "steps", method.steps, file);
    if (method.steps.empty()) {
        method.recipe = recipe_of(value, file);
    } else if (value.size() != 2) {
        throw input_error(file, 0, 0, "methods[]: {} has steps and a recipe", method.name);
    }
    return method;
}

path_figure figure_of(const json &value, const std::string &file) {
    const auto name = formats::get_or(value, "figure", std::string("straightness"), file);
    if (name == "straightness") return path_figure::straightness;
    if (name == "range") return path_figure::range;
    if (name == "axis") return path_figure::axis;
    throw input_error(file, 0, 0, "paths[].figure must be straightness, range or axis");
}

// Reads one element of "paths". Throws input_error for unknown keys or a path without travel.
scenario_path path_of(const json &value, const std::string &file) {
    formats::only_keys(value, {"name", "from_mm", "to_mm", "every_mm", "along", "figure"}, file,
                       "paths[]");
    scenario_path path;
    path.name = formats::get<std::string>(value, "name", file);
    path.from_mm = position_of(formats::get<json>(value, "from_mm", file), file, "from_mm");
    path.to_mm = position_of(formats::get<json>(value, "to_mm", file), file, "to_mm");
    path.every_mm = formats::get<double>(value, "every_mm", file);
    path.figure = figure_of(value, file);
    const auto along = formats::get<std::string>(value, "along", file);
    path.along = along.size() == 1 ? twin::axis_index(along[0]) : -1;
    if (path.along < 0) throw input_error(file, 0, 0, "paths[].along must be X, Y or Z");
    const auto axis = static_cast<std::size_t>(path.along);
    if (!(path.every_mm > 0.0) || path.from_mm[axis] == path.to_mm[axis]) {
        throw input_error(file, 0, 0, "the path {} needs every_mm > 0 and a travel along {}",
                          path.name, along);
    }
    return path;
}

void read_files(const json &value, const std::string &path, scenario &result) {
    result.file = path;
    result.name = formats::get<std::string>(value, "name", path);
    result.twin = beside(path, formats::get<std::string>(value, "twin", path));
    const auto machine = formats::get_or(value, "machine", std::string(), path);
    if (!machine.empty()) result.machine = beside(path, machine);
    const auto measurements = formats::get_or(value, "measurements", std::string(), path);
    if (!measurements.empty()) result.measurements = beside(path, measurements);
}

// Reads feeds, exchange times and directions. Throws input_error for a value out of range.
void read_run(const json &value, const std::string &path, scenario &result) {
    result.feed_mm_per_s = formats::get<double>(value, "feed_mm_per_min", path) * mm_per_min;
    result.moving_mm_per_min =
        formats::get_or(value, "moving_mm_per_min", result.moving_mm_per_min, path);
    const json wire = formats::get_or(value, "exchange_ms", json::object(), path);
    formats::only_keys(wire, {"read", "write"}, path, "exchange_ms");
    result.read_ms = formats::get_or(wire, "read", 0.0, path);
    result.write_ms = formats::get_or(wire, "write", 0.0, path);
    result.directions = formats::get_or(value, "directions", std::string(twin::axis_letters), path);
    result.paper_percent = formats::get_or(value, "paper_percent", result.paper_percent, path);
    const bool wire_fits = result.read_ms >= 0.0 && result.write_ms >= 0.0 &&
                           result.read_ms < 1e3 && result.write_ms < 1e3;
    if (!wire_fits) throw input_error(path, 0, 0, "exchange_ms: must be 0 to 1000");
    for (const double feed : result.moving_mm_per_min) {
        if (feed >= slowest_mm_per_min && feed <= fastest_mm_per_min) continue;
        throw input_error(path, 0, 0, "moving_mm_per_min must be from 0.001 to 10000000");
    }
    for (const char letter : result.directions) {
        if (twin::axis_index(letter) < 0)
            throw input_error(path, 0, 0, "directions: letters of XYZ");
    }
}

// Throws input_error if a key is missing that the other keys require.
void check(const scenario &plan) {
    const bool recipes = std::any_of(plan.methods.begin(), plan.methods.end(),
                                     [](const auto &m) { return m.steps.empty(); });
    if (recipes && plan.machine.empty()) {
        throw input_error(plan.file, 0, 0, "the key 'machine' is missing");
    }
    if ((recipes && plan.curves.empty()) || plan.methods.empty() || plan.paths.empty() ||
        plan.directions.empty() || !(plan.feed_mm_per_s > 0.0)) {
        throw input_error(plan.file, 0, 0,
                          "needs at least one curve, method and path, and feed_mm_per_min > 0");
    }
    for (const auto &curve : plan.curves) {
        if (!twin::parse_error_name(curve)) {
            throw input_error(plan.file, 0, 0, "'{}' is not an ISO 230-1 name such as EZX", curve);
        }
    }
}

}  // namespace

scenario load_scenario(const std::string &path) {
    const json value = formats::read_json(path);
    formats::only_keys(value,
                       {"format", "kind", "name", "twin", "machine", "measurements", "seeds",
                        "curves", "once", "steps", "methods", "paths", "feed_mm_per_min",
                        "moving_mm_per_min", "exchange_ms", "directions", "paper_percent"},
                       path, "the scenario");
    scenario result;
    read_files(value, path, result);
    result.seeds = formats::get_or(value, "seeds", result.seeds, path);
    result.curves = formats::get_or(value, "curves", result.curves, path);
    result.once = formats::get_or(value, "once", result.once, path);
    result.steps = formats::get_or(value, "steps", result.steps, path);
    for (const auto &method : formats::get<json>(value, "methods", path)) {
        result.methods.push_back(method_of(method, path));
    }
    for (const auto &one : formats::get<json>(value, "paths", path)) {
        result.paths.push_back(path_of(one, path));
    }
    read_run(value, path, result);
    check(result);
    return result;
}

void check_stops(const scenario &plan) {
    constexpr double most = 1e5;
    for (const auto &path : plan.paths) {
        const auto axis = static_cast<std::size_t>(path.along);
        if (std::abs(path.to_mm[axis] - path.from_mm[axis]) / path.every_mm < most) continue;
        throw input_error(plan.file, 0, 0,
                          "the path {} has more than 100000 stops: make every_mm larger",
                          path.name);
    }
}

std::vector<twin::xyz> stops_of(const scenario_path &path) {
    const auto axis = static_cast<std::size_t>(path.along);
    const double length = std::abs(path.to_mm[axis] - path.from_mm[axis]);
    // A last step of less than a micrometre is rounding.
    const auto steps = static_cast<int>(std::ceil((length - 1e-3) / path.every_mm));
    std::vector<twin::xyz> stops;
    for (int i = 0; i <= steps; ++i) {
        const double part = i == steps ? 1.0 : i * path.every_mm / length;
        twin::xyz stop = {};
        for (std::size_t a = 0; a < 3; ++a) {
            stop[a] = path.from_mm[a] + part * (path.to_mm[a] - path.from_mm[a]);
        }
        stops.push_back(stop);
    }
    return stops;
}

}  // namespace compbox::simulation
