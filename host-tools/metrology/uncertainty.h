// SPDX-License-Identifier: MIT
// Measurement uncertainty of positioning and straightness: contributions as in ISO/TR 230-9 and in
// annex A of ISO 230-2, propagated to each figure. U is expanded, k = 2.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host-tools/metrology/iso230_2.h"

namespace compbox::metrology {

// What a person knows about the measurement; empty: not stated. For angles µm is µrad.
struct budget_inputs {
    std::optional<double> device_um, device_um_per_m;  // U of the instrument's calibration, k = 2
    std::optional<double> misalignment_mm;             // R: lateral offset over the travel
    std::optional<double> temperature_K;               // R(theta): range of the material
                                                       // temperature's possible error
    std::optional<double> expansion_range;             // R(alpha): range of the coefficient's
                                                       // possible error, µm/m per K
    std::optional<double> eve_um;                      // E_VE: range of the drift at one point
    std::optional<double> expansion_um_per_m_K;        // alpha of the machine's scale
    std::optional<double> material_degC;               // its mean temperature
};

// U of each contribution over the whole travel, µm or µrad; empty: not stated.
struct budget {
    std::optional<double> device, misalignment, temperature, expansion, environment;

    // The root of the sum of squares of what acts alike on all readings of a target: all but the
    // environment.
    double systematic() const;
};

// in : length_mm > 0. Inputs of temperature need expansion_um_per_m_K; those of the coefficient
//      need material_degC
// out: the contributions of ISO/TR 230-9: calibration, 0.3 R^2 / L, 0.6 alpha L R(theta),
//      0.6 |theta - 20| L R(alpha), 0.6 E_VE
budget positioning_budget(const budget_inputs &inputs, double length_mm);

// The same for straightness and angles: the instrument and the environment only.
budget transverse_budget(const budget_inputs &inputs, double length_mm);

// The figures by their letter: A, R, E of one direction or of both; M and B of both.
enum class approach { both, forward, backward };

// in : readings and their figures; letter: A, R, E, M or B, of an approach that has the figure
// out: U of the figure. A length-proportional error acts on A, E and M over the whole travel, and
//      on R and B not at all. The environment acts on each reading independently, so it enters
//      means by 1/n and standard deviations by 1/(n - 1).
double figure_uncertainty(const budget &known, const axis_readings &axis,
                          const iso230_2_figures &figures, char letter, approach which);

// Reference lines of straightness.
enum class reference { end_point, least_squares, minimum_zone };

// in : x strictly ascending, y: the mean at each, at least two; readings behind each mean
// out: U of the deviation about the line: the instrument's, and the environment's share of each
//      mean, weighted by its effect on the deviation
double straightness_uncertainty(const budget &known, reference line, const std::vector<double> &x,
                                const std::vector<double> &y, const std::vector<int> &readings);

}  // namespace compbox::metrology
