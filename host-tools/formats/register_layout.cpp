// SPDX-License-Identifier: MIT
#include "host-tools/formats/register_layout.h"

#include <algorithm>
#include <stdexcept>

#include "host-tools/formats/json.h"

namespace compbox::formats {

namespace {

constexpr int none = -1;
constexpr int plc_heartbeat = 1, first_position = 8, least_applied = 24;
constexpr int first_write = 100, first_output = 104;
constexpr int stride = 2;  // registers from one number to the next, whatever its type

struct control {
    const char *name, *profile;
    int control, handshake, status;  // the box's heartbeat is behind the status
    bool read_counters, write_counters, tangent;
    const char *position_type, *value_type;
    double value_scale_um;
};

// An S7 keeps words big-endian; a PMC has the low word of a 4-byte number first (MOVD), and its
// shift is in increments of 0.1 um up to 9999.
constexpr control controls[] = {
    {"generic", "generic", 0, none, 100, false, false, false, "int32", "int32", 0.01},
    {"sinumerik-840d", "sinumerik-840d", 2, none, 101, true, true, true, "int32", "int32", 0.01},
    {"fanuc", "fanuc", 3, 2, 100, true, false, false, "int32cdab", "int16", 0.1},
    {"linuxcnc", "generic", 2, none, 101, true, true, false, "int32", "int32", 0.01},
};

const control &control_of(const std::string &layout) {
    for (const auto &one : controls) {
        if (layout == one.name) return one;
    }
    throw std::out_of_range("no register layout " + layout);
}

// A block from `start` to `next`; its counters are the first and the last register.
json block(int start, int next, bool counters) {
    json result = {{"start", start}, {"count", next - start + (counters ? stride : 0)}};
    if (counters) result["counters"] = true;
    return result;
}

json tangent_at(int address, const std::string &signal) {
    return {{"signal", signal},
            {"slope_plc", address},
            {"slope_type", "int32"},
            {"slope_scale", 1e-9},
            {"slope_limit", 0.001},
            {"slope_slew_per_s", 0.01},
            {"reference_plc", address + stride},
            {"reference_type", "int32"},
            {"reference_scale", 0.0001}};
}

}  // namespace

std::vector<std::string> layout_names() {
    std::vector<std::string> names;
    for (const auto &one : controls) names.emplace_back(one.name);
    return names;
}

std::string layout_profile(const std::string &layout) {
    return control_of(layout).profile;
}

json register_layout(const std::string &layout, const std::vector<std::string> &positions,
                     const std::vector<layout_channel> &channels,
                     const std::vector<std::string> &probes) {
    const control &own = control_of(layout);
    json signals = json::array(), outputs = json::array();
    int next = first_position;
    for (const auto &name : positions) {
        signals.push_back(
            {{"name", name}, {"plc", next}, {"type", own.position_type}, {"scale", 0.0001}});
        next += stride;
    }
    int applied = std::max(least_applied, next), written = first_output;
    for (const auto &channel : channels) {
        outputs.push_back({{"name", channel.name},
                           {"plc", written},
                           {"type", own.value_type},
                           {"scale", own.value_scale_um},
                           {"applied", applied}});
        applied += stride;
        written += stride;
        if (!own.tangent || channel.tangent_signal.empty()) continue;
        outputs.back()["tangent"] = tangent_at(written, channel.tangent_signal);
        written += 2 * stride;
    }
    for (const auto &probe : probes) {
        signals.push_back({{"name", probe},
                           {"plc", applied},
                           {"type", own.value_type},
                           {"scale", own.value_scale_um}});
        signals.push_back(
            {{"name", probe + "_n"}, {"plc", applied + stride}, {"type", "uint16"}, {"scale", 1}});
        applied += 2 * stride;
    }
    const int request = written;
    if (!probes.empty()) written += stride;
    json plc = {{"profile", own.profile},
                {"read", block(0, applied, own.read_counters)},
                {"write", block(first_write, written, own.write_counters)},
                {"control", own.control},
                {"plc_heartbeat", plc_heartbeat},
                {"status", own.status},
                {"box_heartbeat", own.status + 1}};
    if (own.handshake != none) plc["handshake"] = own.handshake;
    if (!probes.empty()) plc["request"] = request;
    return {{"plc", plc}, {"signals", signals}, {"channels", outputs}};
}

}  // namespace compbox::formats
