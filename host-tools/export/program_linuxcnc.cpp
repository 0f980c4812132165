// SPDX-License-Identifier: MIT
// PLC program of LinuxCNC: compbox.hal and compbox_plc.py.
#include <array>
#include <cctype>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/export/program_parts.h"
#include "host-tools/formats/template.h"

namespace compbox::exports {

namespace {

const char *const hal_text =
#include "host-tools/export/linuxcnc.hal.in"
    ;
const char *const component_text =
#include "host-tools/export/linuxcnc_plc.py.in"
    ;

const char *python(bool value) {
    return value ? "True" : "False";
}

// Joint c is channel c: trivial kinematics, a letter of COORDINATES for each motor.
json joints_of(const program_parts &parts) {
    json all = json::array();
    for (std::size_t c = 0; c < parts.channels.size(); ++c) {
        const program_channel &one = parts.channels[c];
        if (one.own.tangent) {
            parts.refuse("channel {}: LinuxCNC has no slope; leave out its tangent", one.own.name);
        }
        const auto &applied = one.own.applied_address;
        all.push_back({{"joint", c},
                       {"name", one.own.name},
                       {"address", one.own.address},
                       {"type", number_type(one.own.format)},
                       {"scale_mm", plain_number(1e-3 * one.own.scale_um)},
                       {"applied", applied ? std::to_string(*applied) : "None"},
                       {"size_mm", plain_number(1e-3 * one.size_um)}});
    }
    return all;
}

// A signal named after an axis is its position; any other is linked by the integrator.
json pins_of(const program_parts &parts) {
    json all = json::array();
    for (const auto &signal : parts.signals) {
        const program_probe *probe = parts.probe_of(signal);
        const char letter = coefficients::linear_letter(signal.name);
        const std::string axis(letter != '\0' ? 1 : 0,
                               static_cast<char>(std::tolower(static_cast<unsigned char>(letter))));
        all.push_back({{"name", signal.name},
                       {"pin", fmt::format("signal-{}", all.size())},
                       {"axis", axis},
                       {"probe", probe != nullptr},
                       {"address", signal.address},
                       {"type", number_type(signal.format)},
                       {"scale", plain_number(signal.scale)},
                       {"zero", plain_number(signal.zero)}});
    }
    return all;
}

// The pins of the probes: that of the measured deviation is the one of its signal.
json probes_of(const program_parts &parts) {
    json all = json::array();
    for (const auto &probe : parts.probes) {
        std::size_t s = 0;
        while (parts.signals[s].address != probe.value.address) ++s;
        all.push_back({{"axis", probe.axis},
                       {"p", all.size()},
                       {"pin", fmt::format("signal-{}", s)},
                       {"value", probe.value.address},
                       {"type", number_type(probe.value.format)},
                       {"scale", plain_number(probe.value.scale)},
                       {"count", probe.count.address}});
    }
    return all;
}

std::string names_of(const std::string &stem, std::size_t count) {
    std::string names;
    for (std::size_t c = 0; c < count; ++c)
        names += fmt::format("{}compbox-{}-{}", c > 0 ? "," : "", stem, c);
    return names;
}

}  // namespace

// out: compbox.hal and compbox_plc.py. Throws input_error where LinuxCNC has no such number.
std::vector<output_file> program_linuxcnc(const program_parts &parts) {
    const auto &map = parts.map;
    const json tcp = parts.file.at("plc").value("transport", json::object()).value("tcp", json());
    if (!tcp.is_object()) parts.refuse("plc.transport: LinuxCNC needs tcp with host and port");
    const std::size_t count = parts.channels.size();
    const json values = {{"source", parts.source},
                         {"host", tcp.value("host", "")},
                         {"port", tcp.value("port", 502)},
                         {"size", map.size()},
                         {"read_first", map.read.start},
                         {"read_last", map.read.end() - 1},
                         {"read_counters", python(map.read.counters)},
                         {"write_first", map.write.start},
                         {"write_last", map.write.end() - 1},
                         {"write_counters", python(map.write.counters)},
                         {"control", map.control},
                         {"plc_heartbeat", map.plc_heartbeat},
                         {"status", map.status},
                         {"box_heartbeat", map.box_heartbeat},
                         {"referenced_mask", fmt::format("{:X}", map.referenced_mask)},
                         {"watchdog_s", plain_number(1e-3 * parts.watchdog_ms)},
                         {"slope_mm_per_s", plain_number(1e-3 * parts.slope_um_per_s)},
                         {"ramp_mm_per_s", plain_number(1e-3 * parts.ramp_um_per_s)},
                         {"limits", names_of("limit", count)},
                         {"offsets", names_of("offset", count)},
                         {"channels", joints_of(parts)},
                         {"request", map.request ? std::to_string(*map.request) : "None"},
                         {"probed", !parts.probes.empty()},
                         {"probes", probes_of(parts)},
                         {"signals", pins_of(parts)}};
    return {{"compbox.hal", formats::expanded(hal_text, values)},
            {"compbox_plc.py", formats::expanded(component_text, values)}};
}

}  // namespace compbox::exports
