// SPDX-License-Identifier: MIT
// The registers in the words of the control: an S7 data block, or a table of PMC addresses.
// What is known of both, and how surely, is in docs/plc/README.md.
#pragma once

#include "host-tools/export/plc_layout.h"
#include "host-tools/export/text.h"

namespace compbox::exports {

// file: the one that the map is of. compbox_registers.scl, or for the profile fanuc
// pmc_addresses.csv with register 0 at D pmc_base. Throws input_error where the control has no such
// number.
output_file plc_registers(const register_map &map, const json &file, const std::string &source,
                          int pmc_base);

}  // namespace compbox::exports
