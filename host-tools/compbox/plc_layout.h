// SPDX-License-Identifier: MIT
// The registers of a coefficient (or machine) file as the integrator has to lay them out.
#pragma once

#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"

namespace compbox {

struct laid_register {
    int address = 0;  // zero-based holding register
    number_format format;
    std::string name;     // letters, digits, underscores; unique
    std::string meaning;  // one line
    bool written_by_box = false;

    int end() const { return address + format.registers; }
};

// Everything that the file uses, by address. Two signals that read one number are one register.
std::vector<laid_register> lay_out(const register_map &map);

}  // namespace compbox
