// SPDX-License-Identifier: MIT
// The register map of the PLC by a coefficient or machine file, which an integrator would lay out
// in a data block. Reads only the PLC's part of the file, with code independent of the box.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/number.h"
#include "host-tools/formats/json_type.h"

namespace compbox::fakeplc {

struct register_block {
    int start = 0, count = 0;
    bool counters = false;  // first and last register carry a count of updates

    int end() const { return start + count; }
};

// A number in the PLC's registers: value = raw * scale + zero.
struct shown_signal {
    std::string name;
    int address = 0;
    number_format format;
    double scale = 1.0, zero = 0.0;
    std::optional<double> min, max;  // plausible range, if the file has one
    std::string velocity_of = {};    // the position whose velocity it is …
    double per_s = 1.0;              // … in its unit, of 1 mm/s
};

// The slope and the reference position beside a value, for the temperature compensation of the
// control: K0 + slope * (P - reference).
struct taken_tangent {
    int slope_address = 0, reference_address = 0;
    number_format slope_format, reference_format;
    double slope_scale = 1.0;         // slope (mm/mm) per unit
    double reference_scale_mm = 1.0;  // mm per unit
};

// A compensation value from the box, in µm = raw * scale, and the one that the PLC returns.
struct taken_channel {
    std::string name;
    int address = 0;
    std::optional<int> applied_address;
    number_format format;
    double scale_um = 1.0;
    std::optional<taken_tangent> tangent = std::nullopt;
};

// A touch probe by its two signals: a measured deviation, and a count of measurements.
struct shown_probe {
    std::string axis;  // name of the channel, or letter of the axis, towards which it measures
    std::string value, count;  // names of signals
};

struct register_map {
    std::string file, profile;
    register_block read, write;  // from the view of the box
    int control = 0, plc_heartbeat = 0, status = 0, box_heartbeat = 0;
    std::uint16_t referenced_mask = 1u << 1;
    std::optional<int> detail;     // in the write block: the cause of the box's reason
    std::optional<int> request;    // in the write block: bit 0 asks for another probe
    std::optional<int> handshake;  // of the profile fanuc: where the state of EA/ED/ESTB/EREND is
    bool axes_at_once = false;     // … and whether one handshake takes all axes
    std::optional<double> deadband_um;  // of the PLC program's writes to the NC
    double interpolate_s = 0.0;         // interpolation time to a new value; 0: at once
    std::vector<shown_signal> signals;
    std::vector<taken_channel> channels;
    std::vector<shown_probe> probes;  // whose two signals are the PLC's

    // out: the signal of this name; null if the PLC shows none
    const shown_signal *signal(const std::string &name) const;
    // out: number of registers from 0
    int size() const { return read.end() > write.end() ? read.end() : write.end(); }
};

// in : a coefficient or machine file, and its name for messages
// Throws input_error with file and key for a map that the PLC cannot serve.
register_map register_map_of(const json &root, const std::string &file);
register_map load_register_map(const std::string &path);

}  // namespace compbox::fakeplc
