// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/machine_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::coefficients {

namespace {

constexpr int handshake_register = 2;
constexpr int first_position = 8;
constexpr int first_applied = 24;
constexpr int first_write = 100;
constexpr int first_output = 104;
constexpr std::size_t max_axes = 8;   // (first_applied - first_position) / 2
constexpr std::size_t max_name = 39;  // CB_NAME_SIZE - 1
const std::string linear_axes = "XYZUVW";
const std::string rotary_axes = "ABC";

bool is_linear(char axis) {
    return linear_axes.find(axis) != std::string::npos;
}

// Number format of a control's offsets. FANUC's shift has increments of 0.1 µm up to ±9999.
struct register_format {
    const char *type;
    double scale_um;
};

register_format output_format(const std::string &profile) {
    if (profile == "fanuc") return {"int16", 0.1};
    return {"int32", 0.01};
}

[[noreturn]] void refuse(const std::string &sentence) {
    throw input_error(sentence);
}

double travel_number(const std::string &text, const std::string &whole) {
    double value = 0.0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || result.ec != std::errc() || result.ptr != text.data() + text.size() ||
        !std::isfinite(value)) {
        refuse("--travel: '" + whole + "' is not AXIS=LENGTH or AXIS=FROM:TO in mm, as in X=14300");
    }
    return value;
}

// Throws input_error that names the option where the name, an axis or a travel is not possible.
void check_axes(const machine_options &options) {
    const std::string &axes = options.axes;
    if (options.name.empty() || options.name.size() > max_name) {
        refuse(fmt::format("--name: 1 to {} characters, please", max_name));
    }
    if (axes.empty() || axes.size() > max_axes) {
        refuse(fmt::format("--axes: name 1 to {} axes, as in XYZ", max_axes));
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
        if ((linear_axes + rotary_axes).find(axes[i]) == std::string::npos) {
            refuse(fmt::format("--axes: '{}' is not an axis (use letters of {}{})", axes[i],
                               linear_axes, rotary_axes));
        }
        if (axes.find(axes[i], i + 1) != std::string::npos) {
            refuse(fmt::format("--axes: {} is named twice", axes[i]));
        }
    }
    for (const auto &[axis, range] : options.travel) {
        if (axes.find(axis) == std::string::npos) {
            refuse(fmt::format("--travel: the machine has no axis {} (--axes {})", axis, axes));
        }
    }
}

// in : an axis letter, its first register. out: its signal in mm or degrees; min and max are null
//      where no travel is given, and `compbox build` fills them in.
json position_signal(char axis, int reg, const machine_options &options) {
    json signal = {{"name", std::string(1, axis)},
                   {"unit", is_linear(axis) ? "mm" : "deg"},
                   {"plc", reg},
                   {"type", "int32"},
                   {"scale", 0.0001},
                   {"min", nullptr},
                   {"max", nullptr}};
    const auto range = options.travel.find(axis);
    if (range != options.travel.end()) {
        signal["min"] = range->second.from_mm - plausible_beyond_mm;
        signal["max"] = range->second.to_mm + plausible_beyond_mm;
    }
    return signal;
}

json offset_channel(char axis, int index, const std::string &profile) {
    const auto format = output_format(profile);
    return {{"name", std::string(1, axis)},
            {"sum", nullptr},
            {"limit_um", 300},
            {"error_um", 400},
            {"slew_um_per_s", 500},
            {"deadband_um", 0},
            {"sign", 1},
            {"plc", first_output + 2 * index},
            {"type", format.type},
            {"scale", format.scale_um},
            {"applied", first_applied + 2 * index}};
}

// in : the count of channels. out: the section plc, with registers that follow each other in the
//      order of the constants first_…
json plc_section(const machine_options &options, int channels) {
    const int read_count = first_applied + 2 * channels;
    const int write_count = first_output - first_write + 2 * channels;
    json plc = {
        {"profile", options.profile},
        {"transport",
         {{"tcp", {{"host", options.host}, {"port", options.port}, {"unit", options.unit}}}}},
        {"exchange", "fc3+fc16"},
        {"read", {{"start", 0}, {"count", read_count}}},
        {"write", {{"start", first_write}, {"count", write_count}}},
        {"control", 0},
        {"plc_heartbeat", 1},
        {"status", first_write},
        {"box_heartbeat", first_write + 1},
        {"heartbeat_timeout_ms", 200}};
    if (options.profile != "fanuc") return plc;
    plc.update({{"handshake", handshake_register}, {"scan_ms", 8}, {"axes_at_once", false}});
    return plc;
}

}  // namespace

std::map<char, travel_range> parse_travel(const std::string &text) {
    std::map<char, travel_range> travel;
    std::size_t start = 0;
    while (start <= text.size()) {
        const std::size_t end = std::min(text.find(',', start), text.size());
        const std::string item = text.substr(start, end - start);
        if (item.size() < 3 || item[1] != '=') travel_number("", item);
        const std::string range = item.substr(2);
        const std::size_t colon = range.find(':');
        const bool both = colon != std::string::npos;
        const double from = both ? travel_number(range.substr(0, colon), item) : 0.0;
        const double to = travel_number(both ? range.substr(colon + 1) : range, item);
        if (!(from < to)) refuse("--travel: '" + item + "' does not end above where it begins");
        if (!travel.insert({item[0], {from, to}}).second) {
            refuse(fmt::format("--travel: {} is named twice", item[0]));
        }
        start = end + 1;
    }
    return travel;
}

travel_range plausible_around(const travel_range &measured) {
    const double beyond_mm =
        std::max(plausible_beyond_mm, 0.1 * (measured.to_mm - measured.from_mm));
    return {std::floor(measured.from_mm - beyond_mm), std::ceil(measured.to_mm + beyond_mm)};
}

json new_machine(const machine_options &options) {
    check_axes(options);
    json axes = json::array();
    json signals = json::array();
    json channels = json::array();
    for (const char axis : options.axes) {
        axes.push_back(std::string(1, axis));
        const int position = first_position + 2 * static_cast<int>(signals.size());
        signals.push_back(position_signal(axis, position, options));
        if (!is_linear(axis)) continue;
        channels.push_back(
            offset_channel(axis, static_cast<int>(channels.size()), options.profile));
    }
    if (channels.empty()) refuse("--axes: at least one linear axis is needed (letters of XYZUVW)");
    return {{"format", "compbox/1"},
            {"revision", 1},
            {"machine", {{"name", options.name}, {"axes", axes}}},
            {"cycle", {{"period_ms", options.period_ms}, {"lead_ms", 0}}},
            {"plc", plc_section(options, static_cast<int>(channels.size()))},
            {"signals", signals},
            {"channels", channels},
            {"pairs", json::array()},
            {"safety", {{"hold_ms", 500}, {"ramp_um_per_s", 50}}},
            {"provenance", json::object()}};
}

}  // namespace compbox::coefficients
