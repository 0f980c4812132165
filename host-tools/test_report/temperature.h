// SPDX-License-Identifier: MIT
// A measurement of a warm machine as one at 20 °C.
#pragma once

#include <optional>

#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/json_type.h"

namespace compbox::test_report {

// The machine's scale. Empty: not known.
struct scale_temperature {
    std::optional<double> expansion_um_per_m_K;
    std::optional<formats::start_and_end> degC;
};

// out: stated, filled up from the file's environment
scale_temperature completed(const scale_temperature &stated, const fitting::measurement &data);

// in : stated: by the person, without the file's; name: of the error by ISO 230-1, or ""
// out: data at 20 °C, where a coefficient is stated and the instrument did not convert already; and
//      what was done, as {"converted", "expansion_um_per_m_K", "degC", "removed_um", "remarks",
//      "warnings"}. Straightness is left as it is. Throws input_error for angles with a
//      coefficient, and for a coefficient without a temperature.
json convert_to_20_degC(fitting::measurement &data, const scale_temperature &stated,
                        const std::string &name);

// Adds what was done to figures_of() of the measurement.
void add_conversion(json &figures, const json &done);

}  // namespace compbox::test_report
