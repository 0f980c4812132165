// SPDX-License-Identifier: MIT
#include "host-tools/export/program.h"

#include <algorithm>
#include <cmath>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/export/plc.h"
#include "host-tools/export/program_parts.h"

namespace compbox::exports {

namespace {

using kind = fakeplc::number_format::kind;

// in : the most that the box may write. out: a tenth above it, so that the program never cuts it,
//      rounded up to two digits
double size_above(double least_um) {
    const double wanted_um = 1.1 * least_um;
    const double step_um = std::pow(10.0, std::floor(std::log10(wanted_um)) - 1.0);
    return std::ceil(wanted_um / step_um - 1e-6) * step_um;
}

// The numbers `key` of every channel of the file that has one.
std::vector<double> numbers_of(const json &channels, const char *key) {
    std::vector<double> numbers;
    for (const auto &channel : channels) {
        if (channel.contains(key) && channel.at(key).is_number())
            numbers.push_back(channel.at(key).get<double>());
    }
    return numbers;
}

double number_or(const json &file, const char *object, const char *key, double otherwise) {
    const json section = file.value(object, json::object());
    const bool there = section.contains(key) && section.at(key).is_number();
    return there ? section.at(key).get<double>() : otherwise;
}

// The signal of a channel's axis: the tangent's, or the one of its own name or letter.
std::optional<std::size_t> position_of(const json &channel,
                                       const std::vector<fakeplc::shown_signal> &all) {
    const std::string name = channel.at("name").get<std::string>();
    const json tangent = channel.value("tangent", json::object());
    const char letter = coefficients::linear_letter(name);
    for (const std::string &wanted :
         {tangent.value("signal", name), name, std::string(letter != '\0' ? 1 : 0, letter)}) {
        for (std::size_t s = 0; s < all.size(); ++s) {
            if (all[s].name == wanted) return s;
        }
    }
    return std::nullopt;
}

// out: the signals; of those that read one register the first
std::vector<fakeplc::shown_signal> shown_once(const fakeplc::register_map &map) {
    std::vector<fakeplc::shown_signal> shown;
    for (const auto &signal : map.signals) {
        const bool there = std::any_of(shown.begin(), shown.end(), [&](const auto &other) {
            return other.address == signal.address;
        });
        if (!there) shown.push_back(signal);
    }
    return shown;
}

// Throws input_error without channels, or where their values differ in type or scale.
void check_channels(const program_parts &parts) {
    const auto &all = parts.map.channels;
    if (all.empty()) parts.refuse("the file has no channels");
    for (const auto &one : all) {
        if (one.scale_um == all[0].scale_um && one.format.what == all[0].format.what &&
            one.format.registers == all[0].format.registers) {
            continue;
        }
        parts.refuse(
            "channel {} has another type or scale than channel {}; the program has one for all "
            "offsets",
            one.name, all[0].name);
    }
}

// Two motors of one stage have one size.
void level_pairs(program_parts &parts) {
    for (const auto &pair : parts.file.value("pairs", json::array())) {
        const json names = pair.value("channels", json::array());
        const auto of_pair = [&names](const program_channel &one) {
            return std::find(names.begin(), names.end(), json(one.own.name)) != names.end();
        };
        double most_um = 0.0;
        for (const auto &one : parts.channels)
            if (of_pair(one)) most_um = std::max(most_um, one.size_um);
        for (auto &one : parts.channels)
            if (of_pair(one)) one.size_um = most_um;
    }
}

// Adds each channel of the map with its size. Throws input_error where one has no limit.
void add_channels(program_parts &parts) {
    const auto least_um = least_sizes_um(parts.file);
    const json channels = parts.file.value("channels", json::array());
    for (std::size_t c = 0; c < parts.map.channels.size(); ++c) {
        const fakeplc::taken_channel &own = parts.map.channels[c];
        const auto least = least_um.find(own.name);
        if (least == least_um.end() || !(least->second > 0.0)) {
            parts.refuse(
                "channels[{}].limit_um: the program needs a number above 0 for its largest offset",
                c);
        }
        parts.channels.push_back(
            {own, size_above(least->second), position_of(channels[c], parts.map.signals)});
    }
    level_pairs(parts);
}

// Adds each probe of the map. Throws input_error for numbers that the program cannot write.
void add_probes(program_parts &parts) {
    const std::string signal = "signal_";
    for (const auto &probe : parts.map.probes) {
        const auto &value = *parts.map.signal(probe.value), &count = *parts.map.signal(probe.count);
        if (value.format.what != kind::signed_integer || value.zero != 0.0) {
            parts.refuse("signal {}: the program needs a probe's value as an integer without zero",
                         value.name);
        }
        if (count.format.what != kind::unsigned_integer || count.format.registers != 1 ||
            count.scale != 1.0 || count.zero != 0.0) {
            parts.refuse("signal {}: the program needs a probe's count as uint16 with scale 1",
                         count.name);
        }
        const std::string stem = parts.name_at(value.address).substr(signal.size());
        parts.probes.push_back({probe.axis, stem, value, count});
    }
}

}  // namespace

const program_probe *program_parts::probe_of(const fakeplc::shown_signal &signal) const {
    for (const auto &probe : probes) {
        if (signal.address == probe.value.address || signal.address == probe.count.address)
            return &probe;
    }
    return nullptr;
}

const std::string &program_parts::name_at(int address) const {
    const auto found = std::find_if(registers.begin(), registers.end(),
                                    [&](const auto &one) { return one.address == address; });
    return found->name;
}

program_parts parts_of(const fakeplc::register_map &map, const json &file,
                       const std::string &source) {
    program_parts parts{map, file, source, {}, shown_once(map), {}, {}, 0.0, 0.0, 0.0};
    check_channels(parts);
    add_channels(parts);
    parts.registers = lay_out(map, least_sizes_um(file));
    add_probes(parts);
    parts.watchdog_ms = number_or(file, "plc", "heartbeat_timeout_ms", 200.0);
    parts.ramp_um_per_s = number_or(file, "safety", "ramp_um_per_s", 50.0);
    const auto slews = numbers_of(file.value("channels", json::array()), "slew_um_per_s");
    if (slews.size() != map.channels.size()) {
        parts.refuse("channels: the program needs the slew_um_per_s of each");
    }
    parts.slope_um_per_s = 2.0 * *std::max_element(slews.begin(), slews.end());
    return parts;
}

std::vector<output_file> plc_program(const fakeplc::register_map &map, const json &file,
                                     const std::string &source, int pmc_base) {
    const program_parts parts = parts_of(map, file, source);
    if (map.profile == "generic") return program_linuxcnc(parts);
    const output_file registers = plc_registers(map, file, source, pmc_base);
    if (map.profile == "sinumerik-840d") {
        return {{"sinumerik-840d.scl", program_840d(parts)}, registers};
    }
    return {{"fanuc.txt", program_fanuc(parts, pmc_base)}, registers};
}

}  // namespace compbox::exports
