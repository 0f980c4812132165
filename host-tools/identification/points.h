// SPDX-License-Identifier: MIT
// Three measuring points on a carriage and what can be identified from them (S2).
//
// A point P, fixed on the carriage, moves by  d = delta + 1e-3 eps x P  (µm, µrad, mm). Nine
// readings, three directions at three points, give the six errors by least squares with
//     cov(e) = sigma^2 (A^T A)^-1,
// which has a closed form: with the centroid c and q_i = P_i - c, the angular part is
//     cov(eps) = 1e6 sigma^2 J^-1,  J = sum(|q_i|^2 I - q_i q_i^T)   (an inertia tensor),
// and cov(delta) = sigma^2 (I/3 + [c]x J^-1 [c]x^T).
#pragma once

#include <Eigen/Core>
#include <array>

namespace compbox::identification {

using point_mm = std::array<double, 3>;
using triple_mm = std::array<point_mm, 3>;

// One standard deviation of delta x, y, z (µm) and eps x, y, z (µrad) for readings with 1 µm.
using six = std::array<double, 6>;

// Whether the three points span a triangle: its height over the longest edge is more than 1e-6 of
// that edge. On a line, rotation about that line is invisible.
bool spans_triangle(const triple_mm &points);

// The smallest height of the triangle, which is its distance from a line.
double triangle_height_mm(const triple_mm &points);

// Closed form above for sigma = 1 µm. The points must span a triangle.
six closed_form_sigma(const triple_mm &points);

// The 9 x 6 matrix A: rows d1x d1y d1z d2x … d3z in µm; columns delta (µm), eps (µrad).
Eigen::Matrix<double, 9, 6> observation_matrix(const triple_mm &points);

// The traditional sequence of six readings: Δx at P1, P2, P3, Δy at P1, P2, Δz at P1. The first
// three give delta x, eps y, eps z, the next two delta y and eps x, the last one delta z. These are
// its rows of observation_matrix, in this order.
constexpr std::array<int, 6> traditional_rows = {0, 3, 6, 1, 4, 2};

// The same sequence for a moving axis 0 (X), 1 (Y) or 2 (Z), with the directions in cyclic order:
// the axis' own direction is measured at all three points.
std::array<int, 6> traditional_rows_of(int axis);

// sigma of the traditional sequence for readings with 1 µm; false where it is singular.
bool traditional_sigma(const triple_mm &points, int axis, six &sigma);

}  // namespace compbox::identification
