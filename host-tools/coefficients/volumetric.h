// SPDX-License-Identifier: MIT
// From the identified error curves of the axes to one volumetric term.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "host-tools/coefficients/diagonals.h"
#include "host-tools/fitting/fit.h"
#include "host-tools/formats/json.h"

namespace compbox::coefficients {

using vector_mm = std::array<double, 3>;

struct volumetric_options {
    std::string name = "vol";                              // outputs NAME_x, NAME_y, NAME_z
    std::string chain;                                     // "fXYZ"; models/volumetric.h
    std::array<std::string, 3> positions{"X", "Y", "Z"};   // signals of the axes
    std::map<std::string, double> squareness_urad;         // by C0Y, B0Z, A0Z
    std::map<std::string, double> squareness_sigma_urad;   // 1 standard deviation, where known
    std::map<std::string, vector_mm> reference_points_mm;  // by X, Y, Z; these win over a DIR's
    vector_mm tool_offset_mm{0, 0, 0}, tool_direction{0, 0, -1};
    std::string tool_length_signal;  // "" for none
    double tool_length_mm = 0.0;
    // Readings along diagonals, for squareness that is not given and for the linear part of roll,
    // which no straightness shows; "": none. compensated: the box applied these curves, without
    // squareness and linear roll, while they were taken.
    std::string diagonals;
    bool compensated = false;
    fitting::fit_options fit;  // name and signal are set for each
};

// Result of one curve, for the report.
struct fitted_error {
    std::string name, file, unit;
    std::size_t positions = 0, coefficients = 0;
    double range = 0.0, residual_rms = 0.0, slope_per_m = 0.0;
    std::vector<std::string> warnings;
};

struct volumetric_result {
    json fragment;                                 // for `build`: the curves and the term over them
    std::vector<fitted_error> errors;              // that were found
    std::vector<std::string> missing;              // curves that were not: taken as zero
    std::optional<diagonal_adjustment> diagonals;  // C0Y …: µrad; EAX …: µrad over its curve
    std::map<std::string, double> squareness_urad;         // all three
    std::map<std::string, vector_mm> reference_points_mm;  // all three
    std::vector<std::string> remarks;
};

// Reads DIR/EXX.csv … DIR/ECZ.csv, those that are there, and DIR/report.json for the reference
// point of its axis, as `identify` writes them. Throws input_error for an unreadable folder, a
// folder without any curve, one error in two folders, an angle in um or a length in urad.
volumetric_result make_volumetric(const std::vector<std::string> &folders,
                                  const volumetric_options &options);

}  // namespace compbox::coefficients
