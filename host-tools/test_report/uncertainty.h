// SPDX-License-Identifier: MIT
// The uncertainty of each figure of a report, from a stated budget.
#pragma once

#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/metrology/uncertainty.h"
#include "host-tools/test_report/conformity.h"

namespace compbox::test_report {

// out: inputs whose eve_um is at least the drift that the measurement shows (figures["drift"])
metrology::budget_inputs with_drift(const metrology::budget_inputs &inputs, const json &figures);

// in : figures_of() of the measurement; inputs with the coefficient and the temperature of its
// scale out: figures["uncertainty"] = {"k": 2, "contributions": {"positioning": {name: U or null},
//      "straightness": …}, "figures": {key: U}} for the figures that the readings give; of a file
//      in µrad the contributions of angles. A remark where the drift is not small beside the
//      scatter. Throws input_error for inputs that lack the temperature or the coefficient, or that
//      angles do not have.
void add_uncertainty(json &figures, const fitting::measurement &data,
                     const metrology::budget_inputs &inputs);

// Adds the stated uncertainties to figures["uncertainty"]; they outweigh those of the budget.
// Throws input_error for a figure that is not known.
void add_stated(json &figures, const by_figure &stated);

// out: U of each figure, as figures["uncertainty"] has it
by_figure uncertainties_in(const json &figures);

// out: one line for a person: "device 0.80, misalignment 0.60 … not stated: …"; "" without a budget
std::string budget_text(const json &figures, const char *of);

}  // namespace compbox::test_report
