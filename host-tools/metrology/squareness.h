// SPDX-License-Identifier: MIT
// Squareness of two axes from set-ups that share a reference.
//
// The signs are those of models/volumetric.h: C0Y > 0 opens the angle between +X and +Y, A0Z > 0
// that between +Y and +Z, B0Z > 0 closes that between +X and +Z. Errors are those of the tool
// relative to the workpiece. "First" and "second" are the axes in this order: X Y, Y Z, X Z.
#pragma once

#include <string>

namespace compbox::metrology {

struct squareness {
    double value_urad = 0.0;
    double sigma_urad = 0.0;  // 1 standard deviation
};

// +1 for C0Y and A0Z, -1 for B0Z; 0 for any other name.
int opening_sign(const std::string &name);

// Optical square: both straightnesses against one reference, which the square turns by 90 degrees.
// in : slopes in µrad (µm/m) of the first axis' straightness towards the second, and of the
//      second's towards the first; the square's own angle minus 90 degrees
squareness from_optical_square(const std::string &name, squareness first_slope,
                               squareness second_slope, double square_error_urad);

// Two face diagonals of a rectangle (ISO 230-6).
// in : its sides along the first and the second axis, > 0; measured minus nominal length of the
//      diagonal on which both positions rise together, and of the other; sigma of one length
// Positioning errors of both axes change both diagonals equally and cancel.
squareness from_diagonals(const std::string &name, double first_mm, double second_mm,
                          double rising_um, double falling_um, double sigma_um);

// A ball bar's circle (ISO 230-4), by its diameters at 45 degrees (both axes rising) and 135: the
// diagonals of the inscribed square.
squareness from_ball_bar(const std::string &name, double diameter_mm, double at_45_um,
                         double at_135_um, double sigma_um);

}  // namespace compbox::metrology
