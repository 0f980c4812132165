// SPDX-License-Identifier: MIT
#include "host-tools/twin/geometry_file.h"

#include <fmt/core.h>

#include <algorithm>

#include "host-tools/formats/json.h"

namespace compbox::twin {

using namespace reading;

namespace {

constexpr double most = 1e5;  // µm or µrad

std::vector<std::array<double, 2>> read_points(const json &value, const place &at) {
    if (!value.is_array() || value.size() < 2) at.fail("must be two or more [mm, value]");
    std::vector<std::array<double, 2>> points;
    for (std::size_t i = 0; i < value.size(); ++i) {
        const place one = at.at(i);
        if (!value[i].is_array() || value[i].size() != 2) one.fail("must be [mm, value]");
        points.push_back({as_number(value[i][0], -1e6, 1e6, one.at(0)),
                          as_number(value[i][1], -most, most, one.at(1))});
        if (i > 0 && points[i][0] <= points[i - 1][0]) one.fail("positions must ascend");
    }
    return points;
}

// unit: "um" or "urad", at the end of the keys.
twin_error read_error(const json &value, const std::string &unit, const place &at) {
    const std::string amplitude = "amplitude_" + unit, slope = fmt::format("slope_{}_per_mm", unit),
                      offset = "offset_" + unit;
    if (!value.is_object()) at.fail("must be an object");
    for (const auto &[key, ignored] : value.items()) {
        if (key == amplitude || key == slope || key == offset || key == "points") continue;
        at.fail(fmt::format("the key '{}' is unknown", key));
    }
    twin_error error;
    error.slope_per_mm = optional(value, slope.c_str(), 0.0, -most, most, at);
    error.offset = optional(value, offset.c_str(), 0.0, -most, most, at);
    if (value.contains("points")) {
        if (value.contains(amplitude)) at.fail("has points and an amplitude; one of them");
        error.points = read_points(value.at("points"), at.in("points"));
    } else {
        error.amplitude = required(value, amplitude.c_str(), 0.0, most, at);
    }
    return error;
}

void read_errors(const json &root, twin_config &config, const place &top) {
    for (const auto &[name, value] : optional_object(root, "errors", top).items()) {
        const place at = top.in("errors").in(name);
        const auto parts = parse_error_name(name);
        if (!parts) at.fail("is not an ISO 230-1 error name such as EZX");
        if (!config.axes[static_cast<std::size_t>(parts->axis)].present) {
            at.fail(std::string("the machine has no axis ") + axis_letters[parts->axis]);
        }
        config.errors[name] = read_error(value, parts->direction > 2 ? "urad" : "um", at);
    }
}

xyz read_vector(const json &value, const place &at) {
    if (!value.is_array() || value.size() != 3) at.fail("must be [x, y, z] in mm");
    xyz vector = {};
    for (std::size_t i = 0; i < 3; ++i) vector[i] = as_number(value[i], -1e6, 1e6, at.at(i));
    return vector;
}

// Each axis of the machine once, and one f.
std::string read_order(const json &root, const twin_config &config, const place &top) {
    std::string letters;
    for (std::size_t a = 0; a < 3; ++a) {
        if (config.axes[a].present) letters += axis_letters[a];
    }
    const std::string order = optional_text(root, "chain", top);
    if (order.empty()) return "f" + letters;
    std::string there = order, wanted = letters + "f";
    std::sort(there.begin(), there.end());
    std::sort(wanted.begin(), wanted.end());
    if (there != wanted) {
        top.in("chain").fail(
            "must name the foundation f and each axis once, from the workpiece "
            "to the tool, as in f" +
            letters);
    }
    return order;
}

// Reads order, reference_mm, tool_mm and squareness_urad of the chain; missing keys have their
// defaults. Throws input_error with the place.
void read_chain(const json &root, twin_config &config, const place &top) {
    twin_chain &chain = config.chain;
    chain.order = read_order(root, config, top);
    const place references = top.in("reference_mm");
    for (const auto &[key, value] : optional_object(root, "reference_mm", top).items()) {
        const int axis = key.size() == 1 ? axis_index(key[0]) : -1;
        if (axis < 0) references.fail(fmt::format("'{}' is not an axis: X, Y or Z", key));
        chain.reference_mm[static_cast<std::size_t>(axis)] = read_vector(value, references.in(key));
    }
    if (root.contains("tool_mm")) {
        chain.tool_mm = read_vector(root.at("tool_mm"), top.in("tool_mm"));
    }
    const place squareness = top.in("squareness_urad");
    const json &angles = optional_object(root, "squareness_urad", top);
    check_keys(angles, {"C0Y", "B0Z", "A0Z"}, squareness);
    chain.c0y_urad = optional(angles, "C0Y", 0.0, -most, most, squareness);
    chain.b0z_urad = optional(angles, "B0Z", 0.0, -most, most, squareness);
    chain.a0z_urad = optional(angles, "A0Z", 0.0, -most, most, squareness);
}

twin_stage read_stage(const json &value, const place &at) {
    if (!value.is_object()) at.fail("must be an object");
    check_keys(value, {"span_mm", "drives"}, at);
    twin_stage stage;
    stage.span_mm = required(value, "span_mm", 1.0, 1e6, at);
    const json &drives = optional_object(value, "drives", at);
    if (drives.size() != 2) at.in("drives").fail("must be two drives by name, near side first");
    std::size_t side = 0;
    for (const auto &[name, error] : drives.items()) {
        stage.drives[side] = name;
        stage.errors[side++] = read_error(error, "um", at.in("drives").in(name));
    }
    return stage;
}

// in : config.axes, already read
// out: config.stages of X and Y; throws input_error for another axis or a repeated drive
void read_stages(const json &root, twin_config &config, const place &top) {
    const place at = top.in("stages");
    for (const auto &[key, value] : optional_object(root, "stages", top).items()) {
        const int axis = key.size() == 1 ? axis_index(key[0]) : -1;
        if (axis != 0 && axis != 1) at.fail(fmt::format("'{}' is neither X nor Y", key));
        const auto a = static_cast<std::size_t>(axis);
        if (!config.axes[a].present) at.fail("the machine has no axis " + key);
        config.stages[a] = read_stage(value, at.in(key));
    }
    const auto &x = config.stages[0], &y = config.stages[1];
    if (!x || !y) return;
    for (const auto &name : x->drives) {
        if (name == y->drives[0] || name == y->drives[1]) {
            at.fail(fmt::format("the drive {} is named twice", name));
        }
    }
}

}  // namespace

void read_geometry(const json &root, twin_config &config, const place &top) {
    read_errors(root, config, top);
    read_chain(root, config, top);
    read_stages(root, config, top);
}

}  // namespace compbox::twin
