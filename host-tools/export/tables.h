// SPDX-License-Identifier: MIT
// Equidistant compensation tables from a coefficient file, and their losses.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/export/channel_model.h"

namespace compbox::exports {

constexpr int looks_per_step = 16;  // places between two points at which table and curve meet

struct table_options {
    std::optional<double> step_mm;  // else the widest round step within tolerance_um
    double tolerance_um = 0.1;      // of the table against the curve
    std::size_t most_points = 0;    // that the control's table holds
    bool cross = false;             // tables of other axes' positions too
    bool directions = true;         // the table has forward and backward values
    std::map<std::string, coefficients::travel_range> range;  // by signal; else that of the curves
    std::map<std::string, double> at;              // values of signals that no table runs over
    std::map<std::string, std::string> axis_of;    // signal by channel, where the name does not say
    std::map<std::string, double> lost_motion_um;  // by channel; it counts for limit_um alone
};

// Displacement of one channel by the position of one axis.
struct table_column {
    unsigned channel = 0;
    bool own = false;               // the channel moves the axis that the table runs over
    std::vector<double> wanted_um;  // at each position, tool displacement wanted
    // Half of forward less backward, where the curves have branches; else empty.
    std::vector<double> half_um;
    double step_error_um = 0.0, step_error_at_mm = 0.0;  // table - curve, largest, with sign
};

struct axis_table {
    unsigned signal = 0;
    double step_mm = 0.0, from_mm = 0.0, to_mm = 0.0;  // to: end of the requested travel
    std::vector<double> position_mm;                   // from + k step; the last is >= to
    std::vector<table_column> columns;
    bool tolerance_met = true;
};

// Largest error of a channel's tables in the working space.
struct channel_loss {
    unsigned channel = 0;
    double largest_um = 0.0;
    std::map<std::string, double> where;  // positions
};

struct table_set {
    std::vector<axis_table> tables;
    std::vector<channel_loss> losses;
    std::map<std::string, double> held_at;  // signals that the tables hold constant
    std::vector<std::string> remarks;
};

// The signal of the axis that a channel moves: named like it (X), or like its first letter (X1).
// Throws input_error, also for one that is not in mm, as what a channel moves is.
unsigned axis_of_channel(const channel_model &model, unsigned channel,
                         const std::map<std::string, std::string> &named);

// Sets the signals of --at. Throws input_error for a value outside of the signal's range.
void hold(const channel_model &model, const std::map<std::string, double> &at,
          channel_model::values &values);

// Approximates a channel by a sum of functions of one position each. For a term of several
// positions, a table has its change along one axis, with the others at `at` or in the middle of
// their ranges; the term's value there is in the table of the channel's own axis. Throws
// input_error for a signal that is neither a position nor in `at`, a step that needs more points
// than the control holds, a control without room for any round step, and a file without any table.
table_set make_tables(const channel_model &model, const table_options &options);

// Linear between the points, constant outside, as in every control.
double interpolate(const std::vector<double> &x, const std::vector<double> &y, double at);

}  // namespace compbox::exports
