// SPDX-License-Identifier: MIT
// Limits of the control of a coefficient file and their consequences for this file.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

struct cb_config;

namespace compbox::coefficients {

// {"profile", "functions", "exchange", "registers", "update_ms", …, "channels": {NAME: …}}
json profile_figures(const cb_config &config);

// out: the same as text
std::string profile_text(const cb_config &config);

// out: one sentence for each channel whose control raises an alarm at a large step, that has no
// `applied`, and whose limit_um permits a larger difference of two values.
std::vector<std::string> profile_remarks(const cb_config &config);

}  // namespace compbox::coefficients
