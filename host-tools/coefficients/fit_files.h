// SPDX-License-Identifier: MIT
// From measurement files to a coefficient file, like `compbox fit` and `compbox build`. It gets
// paths only and includes nothing of twin/, so that no true error can reach a fit (a gate and
// tests/cli/test_simulate.py check this).
#pragma once

#include <map>
#include <string>
#include <vector>

namespace compbox::coefficients {

// A way to fit curves, with the options of `compbox fit`.
struct fit_recipe {
    std::string file;                            // of the recipe, for messages
    std::string name;                            // in tables and reports
    std::string method;                          // bspline, bspline-lmc, polynomial, polyline
    std::string line;                            // taken off first: keep, end-point, least-squares
    int degree = 0;                              // 0: the method's usual one
    std::map<std::string, double> tolerance_um;  // by curve; none: the noise decides
};

// A fitted curve for a figure: the readings' means, the curve, and bspline-lmc's way to it.
struct drawn_curve {
    std::vector<double> position_mm, mean_um, at_mm, curve_um;
    std::vector<double> key_points, largest_residual_um;  // empty for other methods
};

struct fitted_files {
    std::string coefficients;                      // path of the coefficient file
    std::vector<std::string> warnings;             // of the fits
    std::map<std::string, int> coefficient_count;  // by curve
    std::map<std::string, drawn_curve> curves;     // likewise
};

// Reads MEASUREMENTS/NAME.csv for each curve (its third letter is the signal), writes FOLDER/
// NAME.json and FOLDER/coefficients.json, which the box's loader has taken. Throws input_error.
fitted_files fit_files(const std::string &measurements, const std::vector<std::string> &curves,
                       const fit_recipe &recipe, const std::string &machine,
                       const std::string &folder);

}  // namespace compbox::coefficients
