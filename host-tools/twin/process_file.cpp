// SPDX-License-Identifier: MIT
#include "host-tools/twin/process_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "host-tools/formats/json.h"

namespace compbox::twin {

namespace {

using reading::as_number;
using reading::check_keys;
using reading::optional;
using reading::optional_object;
using reading::place;
using reading::required;

std::string required_text(const json &value, const char *key, const place &at) {
    const std::string text = reading::optional_text(value, key, at);
    if (text.empty()) at.in(key).fail("must be a text");
    return text;
}

const json &list_at(const json &value, const char *key, const place &at) {
    static const json none = json::array();
    if (!value.contains(key)) return none;
    if (!value.at(key).is_array()) at.in(key).fail("must be a list");
    return value.at(key);
}

// X, Y or Z as 0, 1, 2.
int direction_at(const json &value, const char *key, const place &at) {
    const std::string text = required_text(value, key, at);
    const auto index = std::string("XYZ").find(text);
    if (text.size() != 1 || index == std::string::npos) at.in(key).fail("must be X, Y or Z");
    return static_cast<int>(index);
}

// [low, high] with low < high.
std::array<double, 2> range_at(const json &value, const char *key, const place &at) {
    const json &list = list_at(value, key, at);
    if (list.size() != 2) at.in(key).fail("must be [from, to]");
    const std::array<double, 2> range = {as_number(list[0], -1e6, 1e6, at.in(key).at(0)),
                                         as_number(list[1], -1e6, 1e6, at.in(key).at(1))};
    if (!(range[0] < range[1])) at.in(key).fail("must ascend");
    return range;
}

// Three numbers by the letters of the axes; missing ones are unchanged.
void read_axes_values(const json &value, const char *key, double low, double high, const place &at,
                      std::array<double, 3> &into) {
    const json &object = optional_object(value, key, at);
    check_keys(object, {"X", "Y", "Z"}, at.in(key));
    for (std::size_t a = 0; a < 3; ++a) {
        const char letter[] = {"XYZ"[a], '\0'};
        into[a] = optional(object, letter, into[a], low, high, at.in(key));
    }
}

std::size_t node_named(const thermal_config &config, const std::string &name, const place &at) {
    const auto found = std::find_if(config.nodes.begin(), config.nodes.end(),
                                    [&](const auto &node) { return node.name == name; });
    if (found == config.nodes.end()) at.fail(fmt::format("'{}' is no node of this network", name));
    return static_cast<std::size_t>(found - config.nodes.begin());
}

std::size_t node_at(const thermal_config &config, const json &value, const place &at) {
    return node_named(config, required_text(value, "node", at), at.in("node"));
}

void read_air(const json &value, thermal_air &air, const place &at) {
    check_keys(value, {"mean_degC", "swing_K", "warmest_h", "start_h"}, at);
    air.mean_degC = optional(value, "mean_degC", air.mean_degC, -40.0, 80.0, at);
    air.swing_K = optional(value, "swing_K", air.swing_K, 0.0, 40.0, at);
    air.warmest_h = optional(value, "warmest_h", air.warmest_h, 0.0, 24.0, at);
    air.start_h = optional(value, "start_h", air.start_h, 0.0, 24.0, at);
}

void read_nodes(const json &root, thermal_config &config, const place &top) {
    for (const auto &[name, value] : optional_object(root, "nodes", top).items()) {
        const place at = top.in("nodes").in(name);
        check_keys(value, {"capacity_kJ_per_K", "to_air_W_per_K"}, at);
        thermal_node node;
        node.name = name;
        node.capacity_kJ_per_K = required(value, "capacity_kJ_per_K", 1e-2, 1e6, at);
        node.to_air_W_per_K = required(value, "to_air_W_per_K", 0.0, 1e4, at);
        config.nodes.push_back(node);
    }
    if (config.nodes.empty()) top.in("nodes").fail("must name at least one node");
}

void read_couplings(const json &root, thermal_config &config, const place &top) {
    const json &list = list_at(root, "couplings", top);
    for (std::size_t i = 0; i < list.size(); ++i) {
        const place at = top.in("couplings").at(i);
        check_keys(list[i], {"between", "W_per_K"}, at);
        const json &between = list_at(list[i], "between", at);
        if (between.size() != 2 || !between[0].is_string() || !between[1].is_string()) {
            at.in("between").fail("must be a list of two nodes");
        }
        const std::size_t one = node_named(config, between[0].get<std::string>(), at.in("between"));
        const std::size_t other =
            node_named(config, between[1].get<std::string>(), at.in("between"));
        if (one == other) at.in("between").fail("must be two different nodes");
        config.couplings.push_back({one, other, required(list[i], "W_per_K", 0.0, 1e5, at)});
    }
}

// Every node needs a path to the air, directly or through others; otherwise it has no final
// temperature.
void check_ways_to_air(const thermal_config &config, const place &at) {
    std::vector<bool> cooled;
    for (const auto &node : config.nodes) cooled.push_back(node.to_air_W_per_K > 0.0);
    for (std::size_t round = 0; round < config.nodes.size(); ++round) {
        for (const auto &coupling : config.couplings) {
            if (coupling.W_per_K == 0.0) continue;
            const bool either = cooled[coupling.one] || cooled[coupling.other];
            cooled[coupling.one] = cooled[coupling.other] = either;
        }
    }
    for (std::size_t n = 0; n < cooled.size(); ++n) {
        if (!cooled[n]) {
            at.in("nodes").in(config.nodes[n].name).fail("has no way for its heat to the air");
        }
    }
}

heat_drive drive_at(const json &value, const place &at) {
    static const std::pair<const char *, heat_drive> names[] = {
        {"always", heat_drive::always},     {"spindle_rpm", heat_drive::spindle_rpm},
        {"travel_X", heat_drive::travel_x}, {"travel_Y", heat_drive::travel_y},
        {"travel_Z", heat_drive::travel_z}, {"cutting_W", heat_drive::cutting_W}};
    const std::string text = required_text(value, "by", at);
    for (const auto &[name, drive] : names) {
        if (text == name) return drive;
    }
    at.in("by").fail("must be always, spindle_rpm, travel_X, travel_Y, travel_Z or cutting_W");
}

void read_heats(const json &root, thermal_config &config, const place &top) {
    const json &list = list_at(root, "heats", top);
    for (std::size_t i = 0; i < list.size(); ++i) {
        const place at = top.in("heats").at(i);
        check_keys(list[i], {"node", "by", "watt", "at", "power"}, at);
        thermal_heat heat;
        heat.node = node_at(config, list[i], at);
        heat.drive = drive_at(list[i], at);
        heat.watt = required(list[i], "watt", 0.0, 1e6, at);
        heat.at = optional(list[i], "at", 1.0, 1e-6, 1e6, at);
        heat.power = optional(list[i], "power", 1.0, 0.1, 4.0, at);
        config.heats.push_back(heat);
    }
}

void read_expansions(const json &root, thermal_config &config, const place &top) {
    const json &list = list_at(root, "expansions", top);
    for (std::size_t i = 0; i < list.size(); ++i) {
        const place at = top.in("expansions").at(i);
        check_keys(list[i], {"node", "moves", "um_per_K", "um_per_m_K", "along", "from_mm"}, at);
        thermal_expansion part;
        part.node = node_at(config, list[i], at);
        part.direction = direction_at(list[i], "moves", at);
        part.um_per_K = optional(list[i], "um_per_K", 0.0, -1e3, 1e3, at);
        part.um_per_m_K = optional(list[i], "um_per_m_K", 0.0, -1e3, 1e3, at);
        if (part.um_per_m_K != 0.0) part.along = direction_at(list[i], "along", at);
        part.from_mm = optional(list[i], "from_mm", 0.0, -1e5, 1e5, at);
        config.expansions.push_back(part);
    }
}

void read_sensors(const json &root, thermal_config &config, const place &top) {
    for (const auto &[name, value] : optional_object(root, "sensors", top).items()) {
        const place at = top.in("sensors").in(name);
        check_keys(value, {"node", "lag_s", "resolution_K", "noise_K", "offset_K"}, at);
        thermal_sensor sensor;
        sensor.signal = name;
        sensor.node = node_at(config, value, at);
        sensor.lag_s = optional(value, "lag_s", sensor.lag_s, 0.0, 3600.0, at);
        sensor.resolution_K = optional(value, "resolution_K", sensor.resolution_K, 0.0, 5.0, at);
        sensor.noise_K = optional(value, "noise_K", sensor.noise_K, 0.0, 5.0, at);
        sensor.offset_K = optional(value, "offset_K", sensor.offset_K, 0.0, 10.0, at);
        config.sensors.push_back(sensor);
    }
}

// in : the object of the key; throws input_error with its place
// out: the wall, its extent in mm, with the length across the direction of yielding
thin_wall read_wall(const json &value, const place &at) {
    check_keys(value,
               {"name", "yields", "along", "along_mm", "normal_mm", "z_mm", "compliance_um_per_N",
                "stiffer_middle"},
               at);
    thin_wall wall;
    wall.name = required_text(value, "name", at);
    wall.normal = direction_at(value, "yields", at);
    wall.along = direction_at(value, "along", at);
    if (wall.normal == wall.along || wall.normal == 2 || wall.along == 2) {
        at.fail("must yield along X or Y and extend along the other");
    }
    wall.along_mm = range_at(value, "along_mm", at);
    wall.normal_mm = range_at(value, "normal_mm", at);
    wall.z_mm = range_at(value, "z_mm", at);
    wall.compliance_um_per_N = required(value, "compliance_um_per_N", 0.0, 1e3, at);
    wall.stiffer_middle = optional(value, "stiffer_middle", 0.0, 0.0, 1.0, at);
    return wall;
}

}  // namespace

thermal_config read_thermal(const json &value, const place &at) {
    if (!value.is_object()) at.fail("must be an object");
    check_keys(
        value,
        {"reference_degC", "spread", "air", "nodes", "couplings", "heats", "expansions", "sensors"},
        at);
    thermal_config config;
    config.reference_degC = optional(value, "reference_degC", 20.0, -40.0, 80.0, at);
    config.spread = optional(value, "spread", 0.0, 0.0, 0.9, at);
    read_air(optional_object(value, "air", at), config.air, at.in("air"));
    read_nodes(value, config, at);
    read_couplings(value, config, at);
    check_ways_to_air(config, at);
    read_heats(value, config, at);
    read_expansions(value, config, at);
    read_sensors(value, config, at);
    return config;
}

cutting_config read_cutting(const json &value, const place &at) {
    if (!value.is_object()) at.fail("must be an object");
    check_keys(value,
               {"N_per_mm", "exponent", "teeth", "tool_diameter_mm", "share", "stiffness_N_per_um",
                "rated_Nm", "idle_percent", "full_rpm", "load_noise_percent", "load_lag_s",
                "spread", "walls"},
               at);
    cutting_config config;
    config.N_per_mm = required(value, "N_per_mm", 0.0, 1e6, at);
    config.exponent = optional(value, "exponent", config.exponent, 0.1, 2.0, at);
    config.teeth = static_cast<int>(optional(value, "teeth", config.teeth, 1.0, 100.0, at));
    config.tool_diameter_mm = optional(value, "tool_diameter_mm", 10.0, 0.1, 1000.0, at);
    read_axes_values(value, "share", -10.0, 10.0, at, config.share);
    read_axes_values(value, "stiffness_N_per_um", 1e-3, 1e6, at, config.stiffness_N_per_um);
    config.rated_Nm = optional(value, "rated_Nm", config.rated_Nm, 1e-3, 1e6, at);
    config.idle_percent = optional(value, "idle_percent", 0.0, 0.0, 100.0, at);
    config.full_rpm = optional(value, "full_rpm", config.full_rpm, 1.0, 1e6, at);
    config.load_noise_percent = optional(value, "load_noise_percent", 0.0, 0.0, 100.0, at);
    config.load_lag_s = optional(value, "load_lag_s", config.load_lag_s, 0.0, 60.0, at);
    config.spread = optional(value, "spread", 0.0, 0.0, 0.9, at);
    const json &walls = list_at(value, "walls", at);
    for (std::size_t i = 0; i < walls.size(); ++i) {
        config.walls.push_back(read_wall(walls[i], at.in("walls").at(i)));
    }
    return config;
}

}  // namespace compbox::twin
