// SPDX-License-Identifier: MIT
// Whether the parts of a coefficient file belong together: curves and travel, demand and limits,
// names and units.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json.h"

struct cb_config;

namespace compbox::coefficients {

struct comparison {
    // A reason not to build the file, and the term that it is about ("": the machine).
    struct refusal {
        std::string term, sentence;
    };

    json channels;                   // {NAME: {low_um, high_um, limit_um, error_um, …}}
    json curves;                     // {NAME: {signal, from, to, travel_from, travel_to}}
    std::vector<std::string> lines;  // the same as text, a line for each channel and axis
    std::vector<refusal> refusals;   // demand beyond error_um, travel without a curve
    std::vector<std::string> remarks;
};

// in : a configuration and the file that it was loaded from
// The travel of a position is its plausible range, min … max. A curve may end before it by a tenth
// of it, or by 11 mm if that is more. Home, where compensation is enabled, is home_mm of the file's
// provenance for each signal; else the zero_at_mm of all its curves; else 0, or the end of the
// travel that is nearest.
comparison compare(const cb_config &config, const json &file);

// out: home as above, a value for each signal; other signals at rest
std::vector<double> home_of(const cb_config &config, const json &file);

// out: "X = 100, Y = 0"
std::string place_text(const cb_config &config, const std::vector<unsigned> &signals,
                       const std::vector<double> &at);

}  // namespace compbox::coefficients
