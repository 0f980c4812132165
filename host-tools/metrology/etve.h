// SPDX-License-Identifier: MIT
// The environmental temperature variation error of ISO 230-3: how far the tool drifts against the
// workpiece while the machine rests, over the whole record and within any period of a length.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

namespace compbox::metrology {

// A column of the record: displacements in µm, angles in µrad, or temperatures in °C.
struct logged_series {
    std::string name;  // with its unit: "X_um"
    std::vector<double> values;
    bool temperature() const;
};

struct drift_record {
    std::vector<double> time_s;  // strictly ascending, at least two
    std::vector<logged_series> displacements, temperatures;
    std::vector<std::string> remarks;  // deviations from the standard's requirements
};

struct drift_figures {
    double range = 0.0;          // largest less smallest reading: the ETVE of a displacement
    double in_window = 0.0;      // largest range of readings within any window
    double window_from_s = 0.0;  // where that window begins
    double change = 0.0;         // last less first reading
};

// in : a table with time_s; columns that end in _um, _urad or _degC are taken, others remarked
// out: the record. Throws input_error without time or displacement, and for times that do not
// ascend.
drift_record drift_record_of(const formats::csv_table &table);

// in : readings at ascending times; window_s > 0
// out: figures in the unit of the readings
drift_figures evaluate_drift(const std::vector<double> &time_s, const std::vector<double> &values,
                             double window_s);

}  // namespace compbox::metrology
