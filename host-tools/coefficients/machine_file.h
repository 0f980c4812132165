// SPDX-License-Identifier: MIT
// The machine file: a coefficient file before its terms, which a person completes.
//
// Register layout that init writes (zero-based protocol addresses, all free to change):
//   read  block  0 …  0 control, 1 PLC heartbeat, 2 handshake (fanuc), 3–7 spare,
//                     8 + 2i position of axis i, 24 + 2i offset that the PLC applies to channel i
//   write block 100 … 100 status, 101 box heartbeat, 102–103 spare, 104 + 2i offset of channel i
#pragma once

#include <map>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::coefficients {

struct travel_range {
    double from_mm, to_mm;  // from < to; degrees for a rotary axis
};

struct machine_options {
    std::string axes;  // letters of XYZUVWABC, each once, at most 8
    std::string profile = "generic";
    std::string name = "machine";
    std::string host = "127.0.0.1";
    int port = 1502;  // fakeplc's; a real PLC listens on 502
    int unit = 1;
    double period_ms = 30.0;
    std::map<char, travel_range> travel;  // of some or all axes
};

// Positions are plausible this far beyond a travel that a person stated: a standing axis reads a
// few µm past its end.
constexpr double plausible_beyond_mm = 10.0;

// The plausible range of a signal of which only its measured curves are known, in whole mm: a
// measurement seldom reaches the ends of the travel, so a tenth of its length, at least 10 mm.
travel_range plausible_around(const travel_range &measured);

// "X=14300,Y=-1500:1500": ranges by axis; one number means from 0. Throws input_error.
std::map<char, travel_range> parse_travel(const std::string &text);

// A machine file for these axes: a signal for each, a channel for each linear one. What only a
// person or the measured curves can know is null: ranges without a travel, and every sum.
// Throws input_error where the options contradict each other.
json new_machine(const machine_options &options);

}  // namespace compbox::coefficients
