// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/machine_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/probe_names.h"
#include "host-tools/formats/register_layout.h"
#include "host-tools/formats/text.h"

namespace compbox::coefficients {

namespace {

constexpr std::size_t max_axes = 8;
constexpr std::size_t max_name = 39;  // CB_NAME_SIZE - 1
constexpr double pair_difference_um = 20.0;
constexpr double most_probed_um = 500.0;  // a larger deviation is a wrong measurement
const std::string linear_axes = "XYZUVW";
const std::string rotary_axes = "ABC";

template <typename... Values>
[[noreturn]] void refuse(fmt::format_string<Values...> sentence, Values &&...values) {
    throw input_error(fmt::format(sentence, std::forward<Values>(values)...));
}

double travel_number(const std::string &text, const std::string &whole) {
    double value = 0.0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || result.ec != std::errc() || result.ptr != text.data() + text.size() ||
        !std::isfinite(value)) {
        refuse("--travel: '{}' is not AXIS=LENGTH or AXIS=FROM:TO in mm, as in X=14300", whole);
    }
    return value;
}

// out: the name. Throws input_error where it is not the name of a linear axis.
std::string checked_motor(const std::string &name) {
    const char letter = name.empty() ? '\0' : name[0];
    if (letter != '\0' && rotary_axes.find(letter) != std::string::npos) {
        refuse("--axes: {} is a rotary axis, whose errors compbox cannot fit yet; leave it out",
               name);
    }
    if (linear_letter(name) == '\0') {
        refuse("--axes: '{}' is not an axis (use letters of {}, as in XYZ, X,Z1 or X,Y1+Y2)", name,
               linear_axes);
    }
    return name;
}

// "X", or "Y1+Y2": two motors of one stage, named after one letter.
machine_axis one_axis(const std::string &text) {
    machine_axis axis;
    for (const auto &motor : formats::split(text, '+')) axis.motors.push_back(checked_motor(motor));
    axis.name = axis.motors[0];
    if (axis.motors.size() == 1) return axis;
    axis.name.resize(1);
    if (axis.motors.size() > 2 || axis.motors[1][0] != axis.name[0]) {
        refuse("--axes: '{}' must be two motors of one axis, as in Y1+Y2", text);
    }
    return axis;
}

void claim(std::set<std::string> &taken, const std::string &name) {
    if (!taken.insert(name).second) refuse("--axes: {} is named twice", name);
}

// Throws input_error where two axes or motors have one name.
void check_names(const std::vector<machine_axis> &axes) {
    std::set<std::string> names;
    for (const auto &axis : axes) {
        claim(names, axis.name);
        for (const auto &motor : axis.motors) {
            if (motor != axis.name) claim(names, motor);
        }
    }
}

// Throws input_error that names the option where the machine's name or a travel is not possible.
void check_options(const machine_options &options, const std::vector<machine_axis> &axes) {
    if (options.name.empty() || options.name.size() > max_name) {
        refuse("--name: 1 to {} characters, please", max_name);
    }
    for (const auto &[name, range] : options.travel) {
        const bool known = std::any_of(axes.begin(), axes.end(), [&name = name](const auto &axis) {
            return axis.name == name;
        });
        if (known) continue;
        refuse("--travel: the machine has no axis {} (--axes {})", name, options.axes);
    }
    const bool pairs = std::any_of(axes.begin(), axes.end(),
                                   [](const auto &axis) { return axis.motors.size() > 1; });
    if (options.motor_positions && !pairs) {
        refuse("--motor-positions: --axes {} has no stage with two motors, as Y1+Y2", options.axes);
    }
}

// The signals of an axis' position: one, or one of each motor.
std::vector<std::string> positions_of(const machine_axis &axis, const machine_options &options) {
    return options.motor_positions ? axis.motors : std::vector<std::string>{axis.name};
}

// in : a signal with its registers. out: with unit and range; null where no travel is given
void complete_signal(json &signal, const machine_axis &axis, const machine_options &options) {
    signal["unit"] = "mm";
    signal["min"] = nullptr;
    signal["max"] = nullptr;
    const auto range = options.travel.find(axis.name);
    if (range == options.travel.end()) return;
    signal["min"] = range->second.from_mm - plausible_beyond_mm;
    signal["max"] = range->second.to_mm + plausible_beyond_mm;
}

// in : a channel with its registers. out: with the defaults that a person checks; its sum is null
void complete_channel(json &channel) {
    channel["sum"] = nullptr;
    channel.update({{"limit_um", 300},
                    {"error_um", 400},
                    {"slew_um_per_s", 500},
                    {"deadband_um", 0},
                    {"sign", 1}});
}

// in : value and count of a probe with their registers. out: with unit and range
void complete_probe(json &value, json &count) {
    value.update({{"unit", "um"}, {"min", -most_probed_um}, {"max", most_probed_um}});
    count.update({{"unit", "1"}, {"min", 0}, {"max", 65535}});
}

// What a term that adapts names; the loader skips the provenance.
json probes_of(const machine_options &options) {
    json probes = json::object();
    for (const auto &probe : probed_axes(options))
        probes[probe.axis] = {{"value", probe.value}, {"count", probe.count}};
    return probes;
}

// A channel of a pair has no tangent: between two writes nothing would hold the pair together.
json registers_for(const machine_options &options, const std::vector<machine_axis> &axes) {
    std::vector<std::string> positions;
    std::vector<formats::layout_channel> channels;
    for (const auto &axis : axes) {
        for (const auto &position : positions_of(axis, options)) positions.push_back(position);
        const bool paired = axis.motors.size() > 1;
        for (const auto &motor : axis.motors) channels.push_back({motor, paired ? "" : axis.name});
    }
    std::vector<std::string> probes;
    for (const auto &probe : probed_axes(options)) probes.push_back(probe.value);
    return formats::register_layout(options.profile, positions, channels, probes);
}

// in : the section plc with its registers. out: with the exchange; of FANUC its scan too
void complete_plc(json &plc, const machine_options &options) {
    plc.update(
        {{"transport",
          {{"tcp", {{"host", options.host}, {"port", options.port}, {"unit", options.unit}}}}},
         {"exchange", "fc3+fc16"},
         {"heartbeat_timeout_ms", 200}});
    if (options.profile == "fanuc") plc.update({{"scan_ms", 8}, {"axes_at_once", false}});
}

// out: the section pairs: one of each stage with two motors
json pairs_of(const std::vector<machine_axis> &axes) {
    json pairs = json::array();
    for (const auto &axis : axes) {
        if (axis.motors.size() < 2) continue;
        pairs.push_back({{"channels", axis.motors}, {"max_difference_um", pair_difference_um}});
    }
    return pairs;
}

}  // namespace

char linear_letter(const std::string &name) {
    const bool good = !name.empty() && name.size() <= 4 &&
                      linear_axes.find(name[0]) != std::string::npos &&
                      name.find_first_not_of("0123456789", 1) == std::string::npos;
    return good ? name[0] : '\0';
}

std::vector<machine_axis> parse_axes(const std::string &text) {
    const bool letters = text.find_first_of(",+0123456789") == std::string::npos;
    std::vector<machine_axis> axes;
    if (letters) {
        for (const char letter : text) axes.push_back(one_axis(std::string(1, letter)));
    } else {
        for (const auto &piece : formats::split(text, ',')) axes.push_back(one_axis(piece));
    }
    if (axes.empty() || axes.size() > max_axes) {
        refuse("--axes: name 1 to {} axes, as in XYZ or X,Y1+Y2,Z", max_axes);
    }
    check_names(axes);
    return axes;
}

std::map<std::string, travel_range> parse_travel(const std::string &text) {
    std::map<std::string, travel_range> travel;
    for (const auto &item : formats::split(text, ',')) {
        const std::size_t equals = item.find('=');
        if (equals == 0 || equals == std::string::npos) travel_number("", item);
        const std::string name = item.substr(0, equals), range = item.substr(equals + 1);
        const std::size_t colon = range.find(':');
        const bool both = colon != std::string::npos;
        const double from = both ? travel_number(range.substr(0, colon), item) : 0.0;
        const double to = travel_number(both ? range.substr(colon + 1) : range, item);
        if (!(from < to)) refuse("--travel: '{}' does not end above where it begins", item);
        if (!travel.insert({name, {from, to}}).second) refuse("--travel: {} is named twice", name);
    }
    return travel;
}

// Signals are named in small letters: X has probe_x. Throws input_error for an axis that the
// machine lacks, and for one named twice.
std::vector<probed_axis> probed_axes(const machine_options &options) {
    std::vector<probed_axis> all;
    if (options.probe.empty()) return all;
    const auto axes = parse_axes(options.axes);
    for (const auto &name : formats::split(options.probe, ',')) {
        const bool known = std::any_of(axes.begin(), axes.end(),
                                       [&](const auto &axis) { return axis.name == name; });
        if (!known) refuse("--probe: the machine has no axis {} (--axes {})", name, options.axes);
        const bool twice = std::any_of(all.begin(), all.end(),
                                       [&](const auto &other) { return other.axis == name; });
        if (twice) refuse("--probe: {} is named twice", name);
        const auto [value, count] = formats::probe_names_of(name);
        all.push_back({name, value, count});
    }
    return all;
}

travel_range plausible_around(const travel_range &measured) {
    const double beyond_mm =
        std::max(plausible_beyond_mm, 0.1 * (measured.to_mm - measured.from_mm));
    return {std::floor(measured.from_mm - beyond_mm), std::ceil(measured.to_mm + beyond_mm)};
}

json new_machine(const machine_options &options) {
    const auto axes = parse_axes(options.axes);
    check_options(options, axes);
    json registers = registers_for(options, axes);
    json names = json::array();
    std::size_t next = 0;
    for (const auto &axis : axes) {
        names.push_back(axis.name);
        for (std::size_t i = 0; i < positions_of(axis, options).size(); ++i) {
            complete_signal(registers["signals"][next++], axis, options);
        }
    }
    for (; next < registers["signals"].size(); next += 2)
        complete_probe(registers["signals"][next], registers["signals"][next + 1]);
    json provenance = json::object();
    if (!options.probe.empty()) provenance["probes"] = probes_of(options);
    for (auto &channel : registers["channels"]) complete_channel(channel);
    complete_plc(registers["plc"], options);
    return {{"format", "compbox/1"},
            {"revision", 1},
            {"machine", {{"name", options.name}, {"axes", names}}},
            {"cycle", {{"period_ms", options.period_ms}, {"lead_ms", 0}}},
            {"plc", registers["plc"]},
            {"signals", registers["signals"]},
            {"channels", registers["channels"]},
            {"pairs", pairs_of(axes)},
            {"safety", {{"hold_ms", 500}, {"ramp_um_per_s", 50}}},
            {"provenance", provenance}};
}

}  // namespace compbox::coefficients
