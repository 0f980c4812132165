// SPDX-License-Identifier: MIT
// The four methods behind fit_curve, and their common functions.
#pragma once

#include "host-tools/fitting/fit.h"
#include "host-tools/fitting/least_squares.h"

namespace compbox::fitting {

// Each method sets result.curve (and warnings, converged) from result.data and result.options.
void fit_bspline(fit_result &result);
void fit_lmc(fit_result &result);
void fit_polynomial(fit_result &result);
void fit_polyline(fit_result &result);

// Runs the method of result.options, after the best estimate.
void fit_one(fit_result &result);
void find_estimate(fit_result &result);

// The reference of the curve. check_reference throws for a zero outside the travel; take_off_line
// and put_to_zero follow result.options.
void check_reference(const fit_result &result);
void take_off_line(fit_result &result);
void put_to_zero(fit_result &result);

// Makes result the forward branch, with its data and estimate, and result.backward the other one.
// Throws if the file lacks a direction.
void split_branches(fit_result &result);

// Before the subtraction of a line: records and warns if all readings are equal.
void warn_of_constant(fit_result &result);
void add_warnings(fit_result &result);
std::string noise_text(const fit_result &result);  // of one reading, with its unit

// Throws input_error for too few points, or more coefficients than the box can hold.
void require_points(const fit_result &result, std::size_t coefficients);
void require_room(const fit_result &result, std::size_t coefficients);

// Rounds knots to float32, solves for the control points again and rounds them too, so that the
// judged curve is the written one. False when the rounding makes knots coincide.
bool round_to_float(spline &curve, const weighted_points &points);

double to_float(double value);

}  // namespace compbox::fitting
