// SPDX-License-Identifier: MIT
// What commissioning found, and how it gets into the file.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "host-tools/commission/judge.h"
#include "host-tools/formats/json.h"

namespace compbox::commission {

struct sign_result {
    double offset_um = 0.0, measured_um = 0.0;
    int sign = 1;  // as the channels of the axis are to have it
};

struct findings {
    json registers;                            // as check_registers found them
    std::map<std::size_t, sign_result> signs;  // by channel
    std::optional<loop_times> times;
};

// The document with signs, lead_ms (unless it says "measured") and provenance.commissioning; of a
// file with terms also the next revision. Throws input_error where provenance is no object.
json with_result(const json &document, const std::string &file, const findings &result);

// What is in provenance.commissioning, and under --json.
json figures_of(const json &document, const findings &result);

}  // namespace compbox::commission
