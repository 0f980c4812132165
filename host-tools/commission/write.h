// SPDX-License-Identifier: MIT
// Results of commissioning, and their place in the file.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "host-tools/commission/judge.h"
#include "host-tools/formats/json.h"

namespace compbox::commission {

struct sign_result {
    double offset_um = 0.0, measured_um = 0.0;
    int sign = 1;                         // new sign of the channels of the axis
    std::optional<double> alone_um = {};  // of a motor of a pair: measured without the other one
};

struct findings {
    json registers;                            // result of check_registers
    json positions = json::object();           // result of check_positions
    std::map<std::size_t, sign_result> signs;  // by channel
    std::optional<loop_times> times;
};

// out: provenance.commissioning of an earlier run; {}: none
json earlier_figures(const json &document);

// out: the document with signs, lead_ms (unless it is "measured") and provenance.commissioning;
// with terms, also the next revision. Throws input_error if provenance is not an object, or
// the revision the highest.
json with_result(const json &document, const std::string &file, const findings &result);

// out: the figures of provenance.commissioning, also for --json; those of an earlier run that this
// one did not repeat stay
json figures_of(const json &document, const findings &result);

}  // namespace compbox::commission
