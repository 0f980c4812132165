// SPDX-License-Identifier: MIT
// The PLC program of a coefficient (or machine) file with its registers, from the templates beside
// this file. docs/plc/README.md has the duties of the program.
#pragma once

#include "host-tools/export/plc_layout.h"
#include "host-tools/export/text.h"

namespace compbox::exports {

// file: the one that the map is of. Profile sinumerik-840d: sinumerik-840d.scl and its data block;
// fanuc: fanuc.txt with register 0 at D pmc_base, and its table of addresses; generic: compbox.hal
// and compbox_plc.py for LinuxCNC. Throws input_error where the program cannot have a number of the
// file.
std::vector<output_file> plc_program(const fakeplc::register_map &map, const json &file,
                                     const std::string &source, int pmc_base);

}  // namespace compbox::exports
