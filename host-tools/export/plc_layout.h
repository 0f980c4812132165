// SPDX-License-Identifier: MIT
// The registers of a coefficient or machine file for the integrator.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/formats/json.h"

namespace compbox::exports {

struct laid_register {
    int address = 0;  // zero-based holding register
    fakeplc::number_format format;
    std::string name;     // letters, digits, underscores; unique
    std::string meaning;  // one line
    bool written_by_box = false;

    int end() const { return address + format.registers; }
};

// AHEAD_MM of the program of the 840D: 40 ms from one PUT of an axis to the next for each channel,
// at 20 m/min; three at least.
double usual_ahead_mm(std::size_t channels);

// The name of a format: "int16", "uint32le", "float32cdab".
std::string number_type(const fakeplc::number_format &format);

// out: by channel, the smallest size for the PLC program (docs/plc/README.md, "The largest
// offset"), um; a smaller one would limit permitted outputs of the box. Only channels with limits
// in the file.
std::map<std::string, double> least_sizes_um(const json &file);

// out: all registers of the file by address. Two signals of one number share a register.
std::vector<laid_register> lay_out(const fakeplc::register_map &map,
                                   const std::map<std::string, double> &least_sizes_um);

}  // namespace compbox::exports
