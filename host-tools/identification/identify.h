// SPDX-License-Identifier: MIT
// Nine-line identification (S2): from three directions at three or more points to the six errors of
// an axis.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/identification/points.h"

namespace compbox::identification {

using nine_line_readings = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One row for each position, columns d1x d1y d1z d2x … in µm: three for each point.
struct nine_lines {
    std::string file;                 // for messages
    std::vector<double> position_mm;  // strictly ascending
    nine_line_readings reading_um;
    line_sigma sigma_um = {};  // of a value of each column; empty: unknown, all lines alike
    // Sigma of a line's slope over that of independent readings (noise.h); empty: 1.
    Eigen::VectorXd slope_factor = {};
};

enum class nine_line_method { improved, traditional };

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
    Eigen::Matrix<double, Eigen::Dynamic, 6> sigma;  // 1 standard deviation, by line_sigma_um
    // Sigma of a value of each line behind `sigma`: the table's, enlarged if the lines contradict
    // each other beyond chance. Of a table without: noise_um for all; 1 µm for the traditional
    // method, which has no redundant readings.
    line_sigma line_sigma_um;
    // Noise of a reading by the contradictions between the lines, root mean square over them; 0
    // without redundant readings.
    double noise_um = 0.0;
    // Contradictions over those that the table's sigma explains; 0 if either is unknown.
    double contradiction = 0.0;
    int freedom = 0;
    std::vector<std::string> remarks;  // the unidentified errors, with reasons

    struct outlier {
        std::size_t row;  // of position_mm
        int line;         // 0 …: d1x d1y …
        double studentised;
        // Other lines that would show a bad reading in the same way at these points.
        std::vector<int> or_lines = {};
    };
    std::vector<outlier> outliers;  // largest first; they remain in the solution (outliers.h)
};

// The ISO 230-1 names of the six curves of an axis: EXX EYX EZX EAX EBX ECX for axis 0.
std::array<std::string, 6> error_names(int axis);

// Weighted least squares by sigma_um, whose ratios are the weights. Throws input_error with the
// points' `file` if the points lie on one line or within 1 mm of it, are not as many as the table's
// lines need, or the traditional sequence is singular; with the table's file if separate set-ups
// have fewer than three positions.
six_curves identify(const nine_lines &table, const points_mm &points,
                    const identify_options &options, const std::string &file);

}  // namespace compbox::identification
