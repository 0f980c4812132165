// SPDX-License-Identifier: MIT
// The measuring cycle: the first target measured once more at the end, and the choice of targets.
#pragma once

#include <optional>

#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/json_type.h"

namespace compbox::test_report {

// out: the reading of the first target at the end of the measurement, if there is one. A last run
//      with this reading alone leaves the data; a laser file may have the reading in its last run.
std::optional<formats::repeated_target> take_off_repeat(fitting::measurement &data);

// Adds to figures_of(): figures["drift"], the drift of the first target in the file's unit, with a
// remark; and a remark on targets that hide a period (empty: not known).
void add_cycle(json &figures, const std::optional<formats::repeated_target> &repeated,
               std::optional<double> period_mm);

}  // namespace compbox::test_report
