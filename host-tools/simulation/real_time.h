// SPDX-License-Identifier: MIT
// Results of a run in real time, as tables and in report.json.
#pragma once

#include <string>

#include "host-tools/simulation/kinds.h"

namespace compbox::simulation {

std::string real_time_text(const real_time_run &real);
void add_real_time(json &report, const real_time_run &real);

}  // namespace compbox::simulation
