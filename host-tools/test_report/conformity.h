// SPDX-License-Identifier: MIT
// Conformity of figures with limits, by the decision rule of ISO 14253-1.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::test_report {

// Values by the key of their figure (figures.h), in the unit of the measurement.
using by_figure = std::map<std::string, double>;

enum class verdict { conforms, undecided, does_not };
const char *name_of(verdict one);

// in : value >= 0; limit > 0; uncertainty: expanded (k = 2), empty if unknown
// out: with the uncertainty, conformity is proved for value + U <= limit, non-conformity for
//      value - U > limit; undecided between. Without it, the value itself is compared.
verdict judged(double value, double limit, const std::optional<double> &uncertainty);

// in : figures_of() of the judged measurement
// out: {"verdict", "figures": [{"figure", "symbol", "value", "limit", "uncertainty" or null,
//      "verdict"}]}; the worst verdict counts for all. Throws input_error, naming the file, for a
//      figure that is not known or that the readings do not give.
json conformity_of(const json &figures, const by_figure &limits, const by_figure &uncertainties);

}  // namespace compbox::test_report
