// SPDX-License-Identifier: MIT
// The registers of a coefficient (or machine) file as the integrator has to lay them out.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/formats/json.h"

namespace compbox::exports {

struct laid_register {
    int address = 0;  // zero-based holding register
    number_format format;
    std::string name;     // letters, digits, underscores; unique
    std::string meaning;  // one line
    bool written_by_box = false;

    int end() const { return address + format.registers; }
};

// AHEAD_MM of docs/plc/sinumerik-840d.scl.
constexpr double usual_ahead_mm = 40.0;

// By channel, the smallest of the sizes that the PLC program may hold it to (docs/plc/README.md,
// "The largest offset"), um: with a smaller one it would cut what the box may write. Of channels
// whose limits the file (coefficients or machine) states.
std::map<std::string, double> least_sizes_um(const json &file);

// Everything that the file uses, by address. Two signals that read one number are one register.
std::vector<laid_register> lay_out(const register_map &map,
                                   const std::map<std::string, double> &least_sizes_um);

}  // namespace compbox::exports
