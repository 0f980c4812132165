// SPDX-License-Identifier: MIT
// The fewest knots: a least-squares B-spline that keeps every point inside its own tolerance.
#pragma once

#include <vector>

#include "host-tools/fitting/least_squares.h"

namespace compbox::fitting {

struct knot_task {
    weighted_points points;
    std::vector<double> tolerance;  // > 0, one for each point
    int degree = 3;
    int max_coefficients = 1024;
    bool guard_between = true;  // limit the curve half-way between points too (course.h)
    int patience = 4;           // trials to save one knot by moving its neighbours; 0 = none
    double mendable = 1.7;      // largest residual / tolerance without it for such trials
};

struct knot_result {
    spline curve;
    double worst = 0.0;   // largest |residual| / tolerance
    bool inside = false;  // worst <= 1
    double swing = 0.0;   // guard_between: largest distance of the curve from the points' course
                          // half-way between two of them, beyond the course's own range; unit of y
    int fits = 0;         // number of least-squares solutions
};

// Adds knots where residuals are outside, at the residuals' centre of gravity, until all are inside
// (at the limit, the curve through every point). Then removes the least needed knots and moves
// their neighbours, as long as all residuals stay inside and nothing swings (or no more than the
// calmest curve found that is inside). Without enough coefficients the result is the best found and
// not inside. Needs points.size() >= degree + 1. Deterministic.
knot_result fewest_knots(const knot_task &task);

}  // namespace compbox::fitting
