// SPDX-License-Identifier: MIT
// Results of a simulation as text and JSON (docs/report.md, docs/report.schema.json).
#pragma once

#include <string>

#include "host-tools/simulation/kinds.h"
#include "host-tools/simulation/paths.h"

namespace compbox::simulation {

json report_json(const scenario &plan, const simulation &result, const real_time_run &real);

// Tables in plain text. Of several seeds: median and worst.
std::string report_text(const scenario &plan, const simulation &result, const real_time_run &real);

}  // namespace compbox::simulation
