// SPDX-License-Identifier: MIT
// Nine-line identification (S2): from three directions at three points to the six errors of an
// axis.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/identification/points.h"

namespace compbox::identification {

using nine_line_readings = Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>;

// One row for each position, columns d1x d1y d1z d2x … d3z in µm.
struct nine_lines {
    std::string file;                 // for messages
    std::vector<double> position_mm;  // strictly ascending
    nine_line_readings reading_um;
};

enum class nine_line_method { improved, traditional };

// Relation of the nine lines to each other.
enum class setups {
    // Each line was a separate laser set-up. Its offset has no meaning, and neither has the slope
    // of a straightness line: both are nuisance parameters. They hide every constant, the slope of
    // both straightnesses (squareness) and the linear part of roll, which are zero in the result.
    // The slopes of positioning, pitch and yaw are real: they come from the three positioning
    // lines.
    separate,
    // All nine lines share one reference frame (a tracker, a simulation): taken unchanged.
    common,
};

struct identify_options {
    int axis = 0;  // 0 X, 1 Y, 2 Z
    nine_line_method how = nine_line_method::improved;
    setups lines = setups::separate;
    double outlier_probability = 0.001;  // probability that any good reading of a table is flagged
};

// The six errors in the order EXa EYa EZa (µm) EAa EBa ECa (µrad).
struct six_curves {
    std::vector<double> position_mm;
    Eigen::Matrix<double, Eigen::Dynamic, 6> value;
    Eigen::Matrix<double, Eigen::Dynamic, 6> sigma;  // 1 standard deviation, by noise_um
    // Noise of a reading, estimated from the contradictions between the nine lines; 0 for the
    // traditional method, which has no redundant readings (its sigma is then for 1 µm).
    double noise_um = 0.0;
    int freedom = 0;
    std::vector<std::string> remarks;  // the unidentified errors, with reasons

    struct outlier {
        std::size_t row;  // of position_mm
        int line;         // 0 … 8: d1x … d3z
        double studentised;
        // Other lines that would show a bad reading in the same way at these points.
        std::vector<int> or_lines = {};
    };
    std::vector<outlier> outliers;  // largest first; they remain in the solution (outliers.h)
};

// The ISO 230-1 names of the six curves of an axis: EXX EYX EZX EAX EBX ECX for axis 0.
std::array<std::string, 6> error_names(int axis);

// Throws input_error with the points' `file` if they lie on one line or within 1 mm of it, or the
// traditional sequence is singular; with the table's file if separate set-ups have fewer than three
// positions.
six_curves identify(const nine_lines &table, const triple_mm &points,
                    const identify_options &options, const std::string &file);

}  // namespace compbox::identification
