// SPDX-License-Identifier: MIT
// Nine-line identification (S2): from three directions at three points to the six errors of an
// axis.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/identification/points.h"

namespace compbox {

using nine_line_readings = Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>;

// One row for each position, columns d1x d1y d1z d2x … d3z in µm.
struct nine_lines {
    std::string file;                 // for messages
    std::vector<double> position_mm;  // strictly ascending
    nine_line_readings reading_um;
};

enum class nine_line_method { improved, traditional };

// How the nine lines hang together.
enum class setups {
    // Each line was a laser set-up of its own: its offset means nothing, and the slope of a
    // straightness line means nothing either. They are nuisance parameters. What they hide cannot
    // be identified: every constant; the slope of both straightnesses (it is squareness) and the
    // linear part of roll. These are zero in the result. The slopes of positioning, pitch and yaw
    // are real: they come from the three positioning lines.
    separate,
    // All nine lines share one reference frame (a tracker, a simulation): taken as they are.
    common,
};

struct identify_options {
    int axis = 0;  // 0 X, 1 Y, 2 Z
    nine_line_method how = nine_line_method::improved;
    setups lines = setups::separate;
    double outlier_probability = 0.001;  // of calling any good reading of a table an outlier
};

// The six errors in the order EXa EYa EZa (µm) EAa EBa ECa (µrad).
struct six_curves {
    std::vector<double> position_mm;
    Eigen::Matrix<double, Eigen::Dynamic, 6> value;
    Eigen::Matrix<double, Eigen::Dynamic, 6> sigma;  // 1 standard deviation, by noise_um
    // Noise of a reading, estimated from what the nine lines contradict each other; 0 for the
    // traditional method, which uses every reading up (its sigma is then for 1 µm).
    double noise_um = 0.0;
    int freedom = 0;
    std::vector<std::string> remarks;  // what could not be identified, and why

    struct outlier {
        std::size_t row;  // of position_mm
        int line;         // 0 … 8: d1x … d3z
        double studentised;
        // Lines that show a bad reading in the same way at these points: it may be theirs.
        std::vector<int> or_lines = {};
    };
    std::vector<outlier> outliers;  // largest first; they stay in the solution (outliers.h)
};

// The ISO 230-1 names of the six curves of an axis: EXX EYX EZX EAX EBX ECX for axis 0.
std::array<std::string, 6> error_names(int axis);

// Throws input_error naming `file`, the points', where they lie on one line or within 1 mm of it,
// or the traditional sequence is singular; naming the table's where there are fewer than three
// positions for set-ups with slopes.
six_curves identify(const nine_lines &table, const triple_mm &points,
                    const identify_options &options, const std::string &file);

}  // namespace compbox
