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

// result.options.method's own, and the best estimate before a form is chosen.
void fit_one(fit_result &result);
void find_estimate(fit_result &result);

// What the curve is measured from. check_reference throws for a zero outside the travel;
// take_off_line and put_to_zero do as result.options say.
void check_reference(const fit_result &result);
void take_off_line(fit_result &result);
void put_to_zero(fit_result &result);

// result becomes the forward branch, its data and estimate ready, result.backward the other one.
// Throws where the file has not both directions.
void split_branches(fit_result &result);

// Before a line is taken off: notes and warns where every reading is the same.
void warn_of_constant(fit_result &result);
void add_warnings(fit_result &result);
std::string noise_text(const fit_result &result);  // of one reading, with its unit

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
