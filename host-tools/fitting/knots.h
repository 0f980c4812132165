// SPDX-License-Identifier: MIT
// The fewest knots: a least-squares B-spline that keeps every point inside its own tolerance.
#pragma once

#include <vector>

#include "host-tools/fitting/least_squares.h"

namespace compbox {

struct knot_task {
    weighted_points points;
    std::vector<double> tolerance;  // > 0, one for each point
    int degree = 3;
    int max_coefficients = 1024;
    bool guard_between = true;  // keep the curve on the points' own course half-way between them
    int patience = 4;           // trials to save one knot by moving its neighbours; 0 = none
    double mendable = 1.7;      // largest residual / tolerance without it at which that is tried
};

struct knot_result {
    spline curve;
    double worst = 0.0;   // largest |residual| / tolerance
    bool inside = false;  // worst <= 1
    double swing = 0.0;   // guard_between: how far the curve is off the points' course half-way
                          // between two of them, beyond what they leave open; unit of y
    int fits = 0;         // least-squares solutions that it took
};

// Knots are added where residuals are outside, at the residuals' centre of gravity, until all are
// inside (the curve through every point, if need be); then the least needed ones are taken away
// again, neighbours moved to make up for it, as long as all stay inside and nothing swings (or no
// more than the calmest curve found that is inside). When there may not be enough coefficients
// the result is the best found and not inside. Needs points.size() >= degree + 1. Deterministic.
knot_result fewest_knots(const knot_task &task);

}  // namespace compbox
