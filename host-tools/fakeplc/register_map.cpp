// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/register_map.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::fakeplc {

namespace {

constexpr int register_space = 65536;

// One object of the file and its path, for messages.
struct section {
    const json &value;
    std::string file, path;

    [[noreturn]] void fail(const std::string &key, const std::string &sentence) const {
        throw input_error(file, 0, 0, "{}.{}: {}", path, key, sentence);
    }
    bool has(const char *key) const { return value.contains(key) && !value.at(key).is_null(); }
    const json &at(const char *key) const {
        if (!has(key)) fail(key, "is missing");
        return value.at(key);
    }
    section in(const char *key) const {
        if (!at(key).is_object()) fail(key, "must be an object");
        return {value.at(key), file, fmt::format("{}.{}", path, key)};
    }
    double number(const char *key) const {
        if (!at(key).is_number() || !std::isfinite(at(key).get<double>())) {
            fail(key, "must be a number");
        }
        return at(key).get<double>();
    }
    double number_or(const char *key, double otherwise) const {
        return has(key) ? number(key) : otherwise;
    }
    std::string text(const char *key) const {
        if (!at(key).is_string()) fail(key, "must be a text");
        return at(key).get<std::string>();
    }
    bool truth_or(const char *key, bool otherwise) const {
        if (!has(key)) return otherwise;
        if (!at(key).is_boolean()) fail(key, "must be true or false");
        return at(key).get<bool>();
    }
    int integer(const char *key, int low, int high) const {
        const double value_here = number(key);
        if (value_here != std::floor(value_here) || value_here < low || value_here > high) {
            fail(key, fmt::format("must be a whole number from {} to {}", low, high));
        }
        return static_cast<int>(value_here);
    }
};

register_block read_block(const section &plc, const char *key) {
    const section block = plc.in(key);
    register_block result;
    result.start = block.integer("start", 0, register_space - 1);
    result.count = block.integer("count", 1, register_space - result.start);
    result.counters = block.truth_or("counters", false);
    return result;
}

// out: an address; throws input_error unless all its registers are in the block
int address_in(const section &owner, const char *key, const register_block &block, int registers) {
    const int address = owner.integer(key, 0, register_space - 1);
    if (address < block.start || address + registers > block.end()) {
        owner.fail(key, fmt::format("register {} is outside the block {} to {}", address,
                                    block.start, block.end() - 1));
    }
    return address;
}

number_format format_of(const section &owner) {
    const std::string name = owner.has("type") ? owner.text("type") : "int16";
    const auto format = number_format::parse(name);
    if (!format) owner.fail("type", fmt::format("'{}' is not a number type", name));
    return *format;
}

double scale_of(const section &owner) {
    const double scale = owner.number_or("scale", 1.0);
    if (scale == 0.0) owner.fail("scale", "must not be 0");
    return scale;
}

// in : the object "plc" of a machine or coefficient file
// out: blocks and addresses of the map; throws input_error for a value out of range
void read_plc(const section &plc, register_map &map) {
    map.profile = plc.has("profile") ? plc.text("profile") : "generic";
    map.read = read_block(plc, "read");
    map.write = read_block(plc, "write");
    map.control = address_in(plc, "control", map.read, 1);
    map.plc_heartbeat = address_in(plc, "plc_heartbeat", map.read, 1);
    map.status = address_in(plc, "status", map.write, 1);
    map.box_heartbeat = address_in(plc, "box_heartbeat", map.write, 1);
    if (plc.has("detail")) map.detail = address_in(plc, "detail", map.write, 1);
    if (plc.has("request")) map.request = address_in(plc, "request", map.write, 1);
    if (plc.has("handshake")) map.handshake = address_in(plc, "handshake", map.read, 1);
    map.axes_at_once = plc.truth_or("axes_at_once", false);
    if (plc.has("deadband_um")) map.deadband_um = plc.number("deadband_um");
    if (map.deadband_um && *map.deadband_um < 0.0) plc.fail("deadband_um", "must not be below 0");
    map.interpolate_s = 1e-3 * plc.number_or("interpolate_ms", 0.0);
    if (map.interpolate_s < 0.0) plc.fail("interpolate_ms", "must not be below 0");
    if (!plc.has("referenced_bits")) return;
    if (!plc.at("referenced_bits").is_array()) plc.fail("referenced_bits", "must be a list");
    map.referenced_mask = 0;
    for (const auto &bit : plc.at("referenced_bits")) {
        if (!bit.is_number_unsigned() || bit.get<std::uint64_t>() > 15) {
            plc.fail("referenced_bits", "must be a list of bit numbers from 0 to 15");
        }
        map.referenced_mask =
            static_cast<std::uint16_t>(map.referenced_mask | 1u << bit.get<unsigned>());
    }
}

bool is_per_minute(const std::string &unit) {
    return unit == "mm/min" || unit == "deg/min";
}

// out: a signal of the read block; throws input_error with its place
shown_signal read_signal(const section &entry, const register_block &block) {
    shown_signal signal;
    signal.name = entry.text("name");
    signal.format = format_of(entry);
    signal.address = address_in(entry, "plc", block, signal.format.registers);
    signal.scale = scale_of(entry);
    signal.zero = entry.number_or("zero", 0.0);
    if (entry.has("unit") && is_per_minute(entry.text("unit"))) signal.per_s = 60.0;
    if (entry.has("min")) signal.min = entry.number("min");
    if (entry.has("max")) signal.max = entry.number("max");
    if (signal.min && signal.max && !(*signal.min < *signal.max)) {
        entry.fail("max", "must be above min");
    }
    return signal;
}

number_format format_named(const section &owner, const char *key) {
    const auto format = number_format::parse(owner.text(key));
    if (!format) owner.fail(key, fmt::format("'{}' is not a number type", owner.text(key)));
    return *format;
}

double positive(const section &owner, const char *key) {
    if (!(owner.number(key) > 0.0)) owner.fail(key, "must be above 0");
    return owner.number(key);
}

taken_tangent read_tangent(const section &entry, const register_block &block) {
    taken_tangent tangent;
    tangent.slope_format = format_named(entry, "slope_type");
    tangent.slope_address = address_in(entry, "slope_plc", block, tangent.slope_format.registers);
    tangent.slope_scale = positive(entry, "slope_scale");
    tangent.reference_format = format_named(entry, "reference_type");
    tangent.reference_address =
        address_in(entry, "reference_plc", block, tangent.reference_format.registers);
    tangent.reference_scale_mm = positive(entry, "reference_scale");
    return tangent;
}

taken_channel read_channel(const section &entry, const register_map &map) {
    taken_channel channel;
    channel.name = entry.text("name");
    channel.format = format_of(entry);
    channel.address = address_in(entry, "plc", map.write, channel.format.registers);
    channel.scale_um = scale_of(entry);
    if (entry.has("tangent")) channel.tangent = read_tangent(entry.in("tangent"), map.write);
    if (entry.has("applied")) {
        channel.applied_address = address_in(entry, "applied", map.read, channel.format.registers);
    }
    return channel;
}

// out: name of the channel that sums a term; "" if none does
std::string channel_of(const json &root, const std::string &term) {
    for (const auto &channel : root.value("channels", json::array())) {
        const json sum = channel.value("sum", json());
        if (sum.is_array() && std::find(sum.begin(), sum.end(), json(term)) != sum.end()) {
            return channel.value("name", "");
        }
    }
    return "";
}

// Adds a probe, unless a signal of it is not the PLC's or it is there already.
void add_probe(const shown_probe &probe, register_map &map) {
    const bool there = std::any_of(map.probes.begin(), map.probes.end(), [&](const auto &other) {
        return other.value == probe.value || other.axis == probe.axis;
    });
    if (there || probe.axis.empty() || !map.signal(probe.value) || !map.signal(probe.count)) return;
    map.probes.push_back(probe);
}

// The probes of terms that adapt; then those of compbox init: probe_x with probe_x_n measures X.
void find_probes(const json &root, register_map &map) {
    for (const auto &term : root.value("terms", json::array())) {
        if (!term.is_object() || !term.contains("probe") || !term.at("probe").is_object()) continue;
        const json &probe = term.at("probe");
        add_probe({channel_of(root, term.value("name", "")), probe.value("value", ""),
                   probe.value("count", "")},
                  map);
    }
    const std::string stem = "probe_";
    for (const auto &signal : map.signals) {
        if (signal.name.compare(0, stem.size(), stem) != 0) continue;
        std::string axis = signal.name.substr(stem.size());
        for (char &c : axis) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        add_probe({axis, signal.name, signal.name + "_n"}, map);
    }
}

// Calls visit with each object of the list `key`.
template <typename visitor>
void each(const json &root, const char *key, const std::string &file, visitor visit) {
    if (!root.contains(key)) return;
    if (!root.at(key).is_array())
        throw input_error(file, 0, 0, std::string(key) + ": must be a list");
    std::size_t i = 0;
    for (const auto &entry : root.at(key)) {
        const std::string path = fmt::format("{}[{}]", key, i++);
        if (!entry.is_object()) throw input_error(file, 0, 0, path + ": must be an object");
        visit(section{entry, file, path});
    }
}

// Of a position the key names another signal of the PLC.
void find_velocities(const json &root, const std::string &file, register_map &map) {
    each(root, "signals", file, [&](const section &entry) {
        if (!entry.has("velocity")) return;
        for (auto &signal : map.signals) {
            if (signal.name == entry.text("velocity")) signal.velocity_of = entry.text("name");
        }
    });
}

}  // namespace

const shown_signal *register_map::signal(const std::string &name) const {
    const auto found = std::find_if(signals.begin(), signals.end(),
                                    [&](const auto &one) { return one.name == name; });
    return found == signals.end() ? nullptr : &*found;
}

register_map register_map_of(const json &root, const std::string &file) {
    if (!root.is_object() || !root.contains("plc") || !root.at("plc").is_object()) {
        throw input_error(file, 0, 0, "plc: must be an object with the PLC's registers");
    }
    register_map map;
    map.file = file;
    read_plc({root.at("plc"), file, "plc"}, map);
    each(root, "signals", file, [&](const section &entry) {
        if (entry.has("plc")) map.signals.push_back(read_signal(entry, map.read));
    });
    each(root, "channels", file,
         [&](const section &entry) { map.channels.push_back(read_channel(entry, map)); });
    find_probes(root, map);
    find_velocities(root, file, map);
    return map;
}

register_map load_register_map(const std::string &path) {
    return register_map_of(formats::read_json(path), path);
}

}  // namespace compbox::fakeplc
