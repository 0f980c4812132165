// SPDX-License-Identifier: MIT
// One measured error curve: the file's readings, their mean at each position, and the noise by the
// repeats.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/formats/rtl.h"

namespace compbox::fitting {

// One run along the axis, in one direction.
struct measured_run {
    std::string name;                  // as in the file; "" without a run column
    int direction = 0;                 // +1, -1, or 0 if the file does not state it
    std::vector<double> position;      // strictly ascending, mm
    std::vector<double> error;         // as read
    std::vector<double> sigma;         // as read; 1 without a sigma column
    double offset = 0.0, slope = 0.0;  // subtracted line: offset + slope (position - centre)
};

// Readings averaged in cells of equal width, for files of very many positions (cells.h).
struct cell_averages {
    std::size_t readings = 0;  // of the file; 0: not averaged
    std::size_t cells = 0;
    double width_mm = 0.0;
    double variance = 0.0;  // noise^2 of a cell's mean by the readings within cells
    int freedom = 0;        // its degrees of freedom
};

struct measurement {
    std::string file;
    std::string unit = "um";  // "um" or "urad"
    std::vector<measured_run> runs;
    std::optional<formats::laser_environment> environment;  // of a laser file
    cell_averages cells;
    formats::laser_particulars about;  // of a laser file

    std::vector<double> position;  // strictly ascending, mm
    std::vector<double> mean;      // of the runs (of both directions' means), at each position
    std::vector<double> variance;  // of that mean, in units of noise^2
    std::vector<int> readings;     // at each position

    bool sigma_given = false;      // the file's sigma is one standard deviation of each reading
    double repeat_variance = 0.0;  // noise^2 between repeats, pooled; 0 without repeats
    int repeat_freedom = 0;        // its degrees of freedom; 0 without repeats
    double short_variance = 0.0;   // the same without slow noise: beside each run's line, if the
                                   // lines explain much; else equal
    bool runs_aligned = false;     // each run had its own offset and slope, which were removed
    // Variance of the mean line that was left, at d from the centre: [0] + [1] d + [2] d^2.
    std::array<double, 3> line_variance = {};
    std::vector<double> lost_motion;  // forward - backward at each position; NaN where one is
                                      // missing
    double mean_lost_motion = 0.0;
    bool bidirectional = false;

    double from() const { return position.front(); }
    double to() const { return position.back(); }
    double centre() const { return 0.5 * (from() + to()); }
};

// How to read a file beyond its content.
struct reading_options {
    std::vector<std::string> columns;  // names of the columns of a file without a header
    // Units where the file states none: "um", or "mm,um" for position and error.
    std::string unit;
    bool unit_option = false;  // the command has the option --unit, which messages may name
};

// Reads position_mm and error_um or error_urad, with optional run, direction (+1/-1,
// forward/backward) and sigma (or sigma_um, sigma_urad). Throws input_error with file and line for
// missing columns, text in numbers, positions out of order in a run (a backward run may descend),
// repeated positions in a run, an unknown direction, a sigma that is not positive, an unknown unit.
// Accepts other programs' names and units of columns (columns.h), and one column per run. A laser
// file is recognised by its content (formats/rtl.h).
measurement read_measurement(const std::string &path, const reading_options &options = {});
measurement measurement_of_laser(const formats::laser_file &laser);

// Throws input_error for values beyond any machine: a position beyond 1 km, an error beyond 1 m (or
// 1 rad) or a sigma outside 10^-6 … 10^6. line 0: unknown.
void check_reading(const std::string &file, long line, double position, double error, double sigma);

// Positions closer than this, mm, are one target.
double closest_positions(const std::vector<measured_run> &runs);

// Throws input_error if a run has two readings of one target, because they would count as repeats.
// in : measurement.runs, each ascending; lines: of their readings; has_runs: the file has a run
//      column
void refuse_near_positions(const measurement &data, const std::vector<std::vector<long>> &lines,
                           bool has_runs);

// Averages measurement.runs into position, mean, variance, readings and the noise of the repeats.
// Called by read_measurement; public for tests and other readers.
void average_runs(measurement &data);

}  // namespace compbox::fitting
