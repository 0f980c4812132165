// SPDX-License-Identifier: MIT
// PLC program of the SINUMERIK 840D, in SCL.
#include <algorithm>
#include <cmath>

#include "host-tools/export/program_parts.h"
#include "host-tools/formats/template.h"

namespace compbox::exports {

namespace {

const char *const program_text =
#include "host-tools/export/sinumerik_840d.scl.in"
    ;

using kind = fakeplc::number_format::kind;

// A REAL as SCL writes it, with a point: "0.2", "150.0", "1.0E-9".
std::string scl_real(double value) {
    std::string text = plain_number(value), exponent;
    const std::size_t e = text.find('e');
    if (e != std::string::npos) {
        exponent = fmt::format("E{}", std::stoi(text.substr(e + 1)));
        text.resize(e);
    }
    return text + (text.find('.') == std::string::npos ? ".0" : "") + exponent;
}

// A declaration with room for a comment.
std::string declared(const std::string &text) {
    const std::string line = "    " + text;
    return line + std::string(line.size() < 37 ? 38 - line.size() : 1, ' ');
}

json constant(const std::string &name, double value, const std::string &meaning) {
    return {{"declaration", declared(fmt::format("{} := {};", name, scl_real(value)))},
            {"meaning", meaning}};
}

std::string s7_type(const fakeplc::number_format &format) {
    if (format.what == kind::floating) return "REAL";
    const bool integer = format.what == kind::signed_integer;
    return format.registers == 2 ? (integer ? "DINT" : "DWORD") : integer ? "INT" : "WORD";
}

bool is_dint(const fakeplc::number_format &format) {
    return s7_type(format) == "DINT";
}

class program {
  public:
    explicit program(const program_parts &parts) : parts_(parts) {
        mm_ = position_scale();
        check();
    }

    // out: the program
    std::string text() const {
        json values = {{"source", parts_.source},
                       {"n", parts_.channels.size()},
                       {"last", parts_.channels.size() - 1},
                       {"mm", plain_number(mm_)},
                       {"read_counters", parts_.map.read.counters},
                       {"write_counters", parts_.map.write.counters},
                       {"referenced_mask", fmt::format("{:X}", parts_.map.referenced_mask)}};
        for (const char *list : {"channels", "tangents", "applied", "inputs", "shown", "probes"})
            values[list] = json::array();
        for (std::size_t c = 0; c < parts_.channels.size(); ++c) add_channel(values, c);
        for (std::size_t s = 0; s < parts_.signals.size(); ++s) add_signal(values, s);
        for (const auto &probe : parts_.probes) values["probes"].push_back(probe_item(probe));
        values["probed"] = !parts_.probes.empty();
        values["request"] = parts_.map.request.has_value() && !parts_.probes.empty();
        values["constants"] = constants();
        values["scales"] = scales();
        return formats::expanded(program_text, values);
    }

  private:
    // mm of a position and of P0: of the first tangent, or else of the first channel that has a
    // position.
    double position_scale() const {
        for (const auto &one : parts_.channels) {
            if (one.own.tangent) return one.own.tangent->reference_scale_mm;
        }
        for (const auto &one : parts_.channels) {
            if (one.position) return parts_.map.signals[*one.position].scale;
        }
        return 0.0001;
    }
    // Whether a signal is the position of a channel as the program has it: a DINT in its scale.
    bool is_position(const fakeplc::shown_signal &signal) const {
        return is_dint(signal.format) && signal.scale == mm_ && signal.zero == 0.0;
    }
    // Throws input_error where a number of a channel or its tangent is not one of the program's.
    void check() const {
        for (const auto &one : parts_.channels) {
            const std::string &name = one.own.name;
            if (one.own.format.what != kind::signed_integer) {
                parts_.refuse("channel {}: the program takes offsets of int16 and int32", name);
            }
            if (!one.own.tangent) continue;
            const auto &tangent = *one.own.tangent;
            if (!one.position || !is_position(parts_.map.signals[*one.position]) ||
                !is_dint(tangent.reference_format) || tangent.reference_scale_mm != mm_) {
                parts_.refuse(
                    "channel {}: the program needs the position and the reference of its tangent "
                    "as int32 in the scale of all others, without zero",
                    name);
            }
            if (tangent.slope_format.what != kind::signed_integer ||
                tangent.slope_scale != slope_scale()) {
                parts_.refuse(
                    "channel {}: the program needs its slope as an integer in the scale of all "
                    "others",
                    name);
            }
        }
    }
    double slope_scale() const {
        for (const auto &one : parts_.channels) {
            if (one.own.tangent) return one.own.tangent->slope_scale;
        }
        return 0.0;
    }
    // Adds channel c to the template's lists: channels, and applied and tangents where it has them.
    void add_channel(json &values, std::size_t c) const {
        const program_channel &one = parts_.channels[c];
        const std::string &value = parts_.name_at(one.own.address);
        const std::string type = s7_type(one.own.format);
        json item = {{"i", c + 1},
                     {"name", one.own.name},
                     {"suffix", value.substr(value.find('_') + 1)},
                     {"position", ""},
                     {"value", value},
                     {"value_to_real", type + "_TO_REAL"},
                     {"real_to_value", "REAL_TO_" + type}};
        if (one.position) {
            item["position"] = ", the axis of signal " + parts_.map.signals[*one.position].name;
        }
        values["channels"].push_back(item);
        if (one.own.applied_address) {
            item["applied"] = parts_.name_at(*one.own.applied_address);
            values["applied"].push_back(item);
        }
        if (!one.own.tangent) return;
        item["slope"] = parts_.name_at(one.own.tangent->slope_address);
        item["slope_to_real"] = s7_type(one.own.tangent->slope_format) + "_TO_REAL";
        item["reference"] = parts_.name_at(one.own.tangent->reference_address);
        values["tangents"].push_back(item);
    }
    // A probe is two inputs, and the memory of the duty [probe].
    json probe_item(const program_probe &probe) const {
        const std::string type = s7_type(probe.value.format);
        return {{"axis", probe.axis},
                {"stem", probe.stem},
                {"done", declared(probe.stem + "_done : BOOL;")},
                {"um", declared(probe.stem + "_um : REAL;")},
                {"value", declared(fmt::format("{}_value : {};", probe.stem, type))},
                {"count", declared(probe.stem + "_count : INT;")},
                {"flags", declared(fmt::format("{0}_due, {0}_before : BOOL;", probe.stem))},
                {"scale", scl_real(probe.value.scale)},
                {"real_to_value", "REAL_TO_" + type}};
    }
    // A signal that is no channel's position is an input, as the raw number of its register.
    void add_signal(json &values, std::size_t s) const {
        const fakeplc::shown_signal &signal = parts_.signals[s];
        const std::string name = parts_.name_at(signal.address);
        for (std::size_t c = 0; c < parts_.channels.size() && is_position(signal); ++c) {
            const auto &position = parts_.channels[c].position;
            if (!position || parts_.map.signals[*position].address != signal.address) continue;
            values["shown"].push_back(
                {{"register", name}, {"from", fmt::format("position[{}]", c + 1)}});
            return;
        }
        if (const program_probe *probe = parts_.probe_of(signal)) {
            const bool value = signal.address == probe->value.address;
            values["shown"].push_back(
                {{"register", name},
                 {"from", value ? probe->stem + "_value"
                                : fmt::format("INT_TO_WORD({}_count)", probe->stem)}});
            return;
        }
        values["shown"].push_back({{"register", name}, {"from", name}});
        values["inputs"].push_back(
            {{"declaration", declared(fmt::format("{} : {};", name, s7_type(signal.format)))},
             {"meaning",
              fmt::format("{} in {:.9g}{}", signal.name, signal.scale,
                          signal.zero == 0.0 ? "" : fmt::format(", 0 is {:.9g}", signal.zero))}});
    }
    // out: the constants that the integrator may change; a size of each channel is among them
    json constants() const {
        json all = {
            constant("WATCHDOG_S", 1e-3 * parts_.watchdog_ms,
                     "after this time without a heartbeat the box is lost"),
            constant("SLOPE_UM_PER_S", parts_.slope_um_per_s, "largest rate of a value"),
            constant("RAMP_UM_PER_S", parts_.ramp_um_per_s, "rate to zero without permission")};
        for (const auto &one : parts_.channels) {
            const std::string &value = parts_.name_at(one.own.address);
            all.push_back(constant(
                fmt::format("SIZE_{}_UM", value.substr(value.find('_') + 1)), one.size_um,
                fmt::format("largest offset of {}, in no register that a Modbus client can write",
                            one.own.name)));
        }
        all.push_back(constant("AHEAD_MM", usual_ahead_mm(parts_.channels.size()),
                               "furthest way of an axis from one PUT of it to the next"));
        all.push_back(constant("INTERPOLATE_S", parts_.map.interpolate_s,
                               "time of the line to each new value; plc.interpolate_ms"));
        all.push_back(constant("DEADBAND_UM", parts_.map.deadband_um.value_or(0.1),
                               "smallest difference at which the NC is written"));
        return all;
    }
    json scales() const {
        json all = {constant("MM", mm_, "of a position and of P0"),
                    constant("UM", parts_.channels[0].own.scale_um, "of a value")};
        if (slope_scale() > 0.0) all.push_back(constant("PER_MM", slope_scale(), "of a slope"));
        return all;
    }

    const program_parts &parts_;
    double mm_ = 0.0;
};

}  // namespace

std::string program_840d(const program_parts &parts) {
    return program(parts).text();
}

}  // namespace compbox::exports
