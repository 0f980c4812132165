// SPDX-License-Identifier: MIT
// Standard deviations of what the models of a coefficient file say. `fit` and `volumetric` note
// those of each curve and of squareness in the file's provenance; here they are carried on to every
// term and channel, at any place.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

namespace compbox::coefficients {

struct sigma_table {
    std::vector<std::string> names;         // sigma_TERM, sigma_comp_NAME_um
    std::vector<std::vector<double>> rows;  // 1 standard deviation, in the unit of the term
    std::vector<std::string> remarks;       // terms that state none and count as exact
};

// Curves and squareness count as independent of each other. Beyond its range a curve has the sigma
// of its end.
// in : a file that the box's loader accepts, samples as for evaluate()
// Throws input_error for samples that evaluate() refuses, and for sigmas that are no numbers.
sigma_table sigma_of(const std::string &coefficients, const formats::csv_table &samples);

// The same at the nodes of a grid over the ranges of all signals with such a curve; other signals
// are at 20 degC or at 0, or where their range is closest to it.
struct sigma_map {
    std::vector<std::string> axes;           // names of these signals, with their units
    std::vector<std::string> channels;       // names
    std::vector<std::vector<double>> nodes;  // the axes, then U of each channel in µm (k = 2), then
                                             // the root of the sum of their squares
    std::size_t steps;  // nodes along each axis
    std::vector<std::string> remarks;
};

// Throws input_error for a file with no such curve, or with more than three such signals.
sigma_map map_of_sigma(const std::string &coefficients);

// The map as CSV: X_mm,…,U_X_um,…,U_um.
std::string sigma_map_csv(const sigma_map &map);

// Draws planes through the middle of the map with the root of the sum of squares, or over one axis
// a curve. path: .svg, .png or .pdf.
void plot_sigma_map(const sigma_map &map, const std::string &path);

}  // namespace compbox::coefficients
