// SPDX-License-Identifier: MIT
// What the control of a coefficient file allows, and what follows for this file.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

struct cb_config;

namespace compbox::coefficients {

// {"profile", "functions", "exchange", "registers", "update_ms", …, "channels": {NAME: …}}
json profile_figures(const cb_config &config);

// The same in lines for a person.
std::string profile_text(const cb_config &config);

// One sentence for each channel whose control alarms at too large a step, and where that an output
// is never so far from what the NC has hangs on the NC taking values often enough: it has no
// `applied`, and a limit_um that lets two of its values be further apart.
std::vector<std::string> profile_remarks(const cb_config &config);

}  // namespace compbox::coefficients
