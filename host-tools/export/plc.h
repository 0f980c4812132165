// SPDX-License-Identifier: MIT
// The register map as an S7 data block or a table of PMC addresses. docs/plc/README.md lists the
// sources of both formats.
#pragma once

#include "host-tools/export/plc_layout.h"
#include "host-tools/export/text.h"

namespace compbox::exports {

// in : file of the map
// out: compbox_registers.scl, or for the profile fanuc pmc_addresses.csv with register 0 at D
// pmc_base. Throws input_error for a number type that the control lacks.
output_file plc_registers(const fakeplc::register_map &map, const json &file,
                          const std::string &source, int pmc_base);

}  // namespace compbox::exports
