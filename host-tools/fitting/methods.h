// SPDX-License-Identifier: MIT
// The four methods behind fit_curve, and what they share.
#pragma once

#include "host-tools/fitting/fit.h"
#include "host-tools/fitting/least_squares.h"

namespace compbox {

// Each fills result.curve (and warnings, converged) from result.data and result.options.
void fit_bspline(fit_result &result);
void fit_lmc(fit_result &result);
void fit_polynomial(fit_result &result);
void fit_polyline(fit_result &result);

// Throws the sentence for too few points or more coefficients than the box can hold.
void require_points(const fit_result &result, std::size_t coefficients);
void require_room(const fit_result &result, std::size_t coefficients);

// Rounds knots to float32, solves for the control points again and rounds them too, so that what
// is judged is what is written. False when the rounding lets knots coincide.
bool round_to_float(spline &curve, const weighted_points &points);

double to_float(double value);

// A number for a sentence, with so many digits that count.
std::string text_of(double value, int digits);

}  // namespace compbox
