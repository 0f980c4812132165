// SPDX-License-Identifier: MIT
// The registers of each kind of control: one table, from which init, the exports, the documents'
// files and fakeplc's usual registers are made. docs/coefficient-file.md explains the keys.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::formats {

struct layout_channel {
    std::string name;
    std::string tangent_signal;  // "": the channel has no tangent, or its control takes none
};

// "generic", "sinumerik-840d", "fanuc", "linuxcnc".
std::vector<std::string> layout_names();

// The firmware's profile of a layout: its own name, or generic. Throws std::out_of_range for a name
// that is not one of them, as register_layout does.
std::string layout_profile(const std::string &layout);

// in : layout; positions, the signals that it shows; channels, each in its order
// out: {"plc", "signals", "channels"} as in a machine file, with the keys of registers alone:
//        read  block: counters where the table has them, PLC heartbeat, control word, handshake;
//                     positions from 8; then the applied offsets, from 24 or behind the positions;
//                     then value and count of each probe, whose signals follow the positions
//        write block: status, box heartbeat; from 104 each channel's value, slope and reference;
//                     then the request, if there are probes
// in : probes: names of their value signals; the count's is NAME_n
json register_layout(const std::string &layout, const std::vector<std::string> &positions,
                     const std::vector<layout_channel> &channels,
                     const std::vector<std::string> &probes = {});

}  // namespace compbox::formats
