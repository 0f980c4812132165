// SPDX-License-Identifier: MIT
// The box on a table of inputs: its outputs for each row.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

struct cb_config;

namespace compbox::coefficients {

// A term of type adapt: what its filter says of its own value.
struct adapted_term {
    std::string name, of;
    std::vector<std::string> channels;  // comp_NAME_um of the one whose sum has it; or none
    std::vector<float> sigma_um;        // one for each row: standard deviation of the value
};

struct evaluation {
    std::vector<std::string> names;        // time_s, term outputs, comp_NAME_um
    std::vector<double> time_s;            // one for each row of the samples
    std::vector<std::vector<float>> rows;  // as names, without time_s
    std::vector<adapted_term> adapted;
    std::vector<std::vector<float>> sigma_um;  // of each row: one standard deviation of each output
                                               // of a term that states its own; NaN of the others
    std::vector<std::string> remarks;          // columns not used, implausible inputs, modes
};

// in : a loaded configuration; samples with time_s (strictly rising) and a column for each signal
// out: the box settled on the first row, then run cycle by cycle, on each row at its own time.
//      raw: channels are the plain negative sums, without limits, slew, deadband, lead and
//      plausibility: beyond their range curves keep the value at their end.
// Throws input_error for missing columns, rows out of order, more than a day between rows and, but
// for raw, a first row without a signal that the box cannot run without.
evaluation evaluate(const cb_config &config, const formats::csv_table &samples, bool raw);

// The result as CSV: every float in its shortest exact form.
std::string evaluation_csv(const evaluation &result);

}  // namespace compbox::coefficients
