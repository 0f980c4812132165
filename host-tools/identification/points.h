// SPDX-License-Identifier: MIT
// Measuring points on a carriage and what can be identified from them (S2).
//
// A point P, fixed on the carriage, moves by  d = delta + 1e-3 eps x P  (µm, µrad, mm). Readings in
// three directions at three or more points give the six errors by weighted least squares with
//     cov(e) = (A^T W A)^-1,  W = diag(1 / sigma_line^2),
// which closed_form_sigma takes apart into blocks of 3 x 3. With one sigma for all lines, the
// centroid c and q_i = P_i - c they are
//     cov(eps) = 1e6 sigma^2 J^-1,  J = sum(|q_i|^2 I - q_i q_i^T)   (an inertia tensor),
//     cov(delta) = sigma^2 (I/n + [c]x J^-1 [c]x^T).
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace compbox::identification {

using point_mm = std::array<double, 3>;
using points_mm = std::vector<point_mm>;  // P1, P2, P3 …: three or more

// One standard deviation of delta x, y, z (µm) and eps x, y, z (µrad).
using six = std::array<double, 6>;

// One standard deviation of a reading of each line d1x d1y d1z d2x …, µm, all above 0.
using line_sigma = Eigen::VectorXd;

// How the lines relate to each other.
enum class setups {
    // Each line was a separate laser set-up. Its offset has no meaning, and neither has the slope
    // of a straightness line: both are nuisance parameters. They hide every constant, the slope of
    // both straightnesses (squareness) and the linear part of roll, which are zero in the result.
    // The slopes of positioning, pitch and yaw are real: they come from the positioning lines.
    separate,
    // All lines share one reference frame (a tracker, a simulation): taken unchanged.
    common,
};

// The moving axis (0 X, 1 Y, 2 Z) and the relation of its lines.
struct line_model {
    int axis = 0;
    setups lines = setups::separate;
    int positions = 21;  // targets of each line; at least 3 if separate
};

// in : sigma of the lines along the axis and across it, µm
line_sigma sigma_of_lines(double along_um, double across_um, int axis, std::size_t points);

// Distance of the farthest point from the line through the two points farthest from each other; of
// a triangle its smallest height.
double height_mm(const points_mm &points);

// The same as seen along an axis. Only points off a line there show pitch and yaw to the lines
// along the axis.
double height_seen_along_mm(const points_mm &points, int axis);

// A reflector is placed to about 0.1 mm, so points closer than ten times that to a line give no
// information.
constexpr double least_height_mm = 1.0;

// out: the reason why the lines at these points cannot be solved, with the remedy; "" if they can.
// Points within least_height_mm of a line hide a rotation about it; separate set-ups need points
// off one line also as seen along the axis.
std::string obstacle(const points_mm &points, const line_model &model);

// The closed form above, one position, lines in one frame. The points must not lie on a line.
six closed_form_sigma(const points_mm &points, const line_sigma &sigma_um);

// The 3n x 6 matrix A: rows d1x d1y d1z d2x … in µm; columns delta (µm), eps (µrad).
Eigen::MatrixXd observation_matrix(const points_mm &points);

// in : positioning lines only: readings along the axis at each point
// out: the n x 3 matrix of delta, eps of the next axis and eps of the one after that (X: EXX, EBX,
//      ECX). Separate set-ups leave only these lines for the slopes of these three errors.
Eigen::MatrixXd along_matrix(const points_mm &points, int axis);
// Their places among the six errors.
std::array<int, 3> along_errors(int axis);

// The traditional sequence of six readings: Δx at P1, P2, P3, Δy at P1, P2, Δz at P1. The first
// three give delta x, eps y, eps z, the next two delta y and eps x, the last one delta z. These are
// its rows of observation_matrix, in this order.
constexpr std::array<int, 6> traditional_rows = {0, 3, 6, 1, 4, 2};

// The same sequence for a moving axis 0 (X), 1 (Y) or 2 (Z), with the directions in cyclic order:
// the axis' own direction is measured at all three points.
std::array<int, 6> traditional_rows_of(int axis);

// sigma of the traditional sequence, one position, one frame; false where it is singular.
bool traditional_sigma(const points_mm &points, int axis, const line_sigma &sigma_um, six &sigma);

// in : one: sigma of one position in one frame (closed_form_sigma or traditional_sigma)
// out: root mean square over the positions of the sigma that identify gives; of separate set-ups
//      with the slopes of the lines along the axis, and without the parts that they hide. Infinite
//      for pitch and yaw where obstacle() names them.
six sigma_over_positions(const points_mm &points, const line_sigma &sigma_um, const six &one,
                         const line_model &model);

}  // namespace compbox::identification
