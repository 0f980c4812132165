// SPDX-License-Identifier: MIT
// machine_twin.json: the simulated machine as data. Every key: docs/twin.md, "The twin file".
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/twin/force.h"
#include "host-tools/twin/thermal.h"

namespace compbox::twin {

// X, Y, Z in this order; mm or µm by the name. An axis that a machine lacks stays at 0.
using xyz = std::array<double, 3>;
constexpr char axis_letters[] = "XYZ";
constexpr char no_axis = '-';

struct twin_axis {
    bool present = false;
    double min_mm = 0.0, max_mm = 0.0;
    double max_velocity_mm_per_s = 0.0;
    double acceleration_mm_per_s2 = 0.0;
    double measure_every_mm = 0.0;  // interval of the virtual laser
    double cutoff_mm = 0.0;         // shortest significant wavelength of the guideway
    // Effect of a positive compensation value on this axis in the control: +1 moves the tool in the
    // positive direction, -1 in the negative.
    int compensation_sign = 1;
};

// An error along its axis, in µm, or µrad for a rotation (error_curve.h).
struct twin_error {
    double amplitude = 0.0;  // range about the least-squares line
    double slope_per_mm = 0.0, offset = 0.0;
    std::vector<std::array<double, 2>> points;  // {position_mm, value}; replaces the random curve
};

// A stage with two drives, one on either side of its middle (geometry.h): X has its sides along Y,
// Y along X. Each side has its own positioning error.
struct twin_stage {
    std::array<std::string, 2> drives;  // names, as used by the channels
    double span_mm = 0.0;               // from the first side to the second
    std::array<twin_error, 2> errors;
};

// Structure of the machine (geometry.h).
struct twin_chain {
    std::string order = "fXYZ";            // from the workpiece over the foundation f to the tool
    std::array<xyz, 3> reference_mm = {};  // origin of each axis' frame, all axes at 0
    xyz tool_mm = {};                      // tip of the tool, all axes at 0
    double c0y_urad = 0.0, b0z_urad = 0.0, a0z_urad = 0.0;  // squareness, as docs/volumetric.md
};

// A coordinated move in a straight line, or a dwell.
struct twin_step {
    std::array<std::optional<double>, 3> target_mm;  // absent: this axis does not move
    double feed_mm_per_s = 0.0;                      // along the path
    double dwell_s = 0.0;                            // > 0: a dwell, without target and feed
    std::optional<double> spindle_rpm;               // from here on; absent: unchanged
    double depth_of_cut_mm = 0.0;                    // in this move
};

struct twin_laser {
    double sigma_um = 0.3;                  // of each reading
    std::optional<double> straightness_um;  // of a straightness instrument's; absent: sigma_um
    double resolution_um = 0.01;
    int runs = 3;
    double slope_urad = 10.0;  // each set-up: a slope within ± this …
    double offset_um = 50.0;   // … and an offset within ± this
};

struct twin_nc {
    double interpolation_s = 0.004;
    double comp_add_velo_factor = 0.01;  // of the axis' maximum velocity (MD32760)
};

struct twin_plc {
    double scan_s = 0.008;
    double watchdog_s = 0.2;         // maximum time without a change of the box's heartbeat; then
                                     // ramp to zero
    double ramp_um_per_s = 50.0;     // rate of that ramp
    double slope_um_per_s = 1000.0;  // rate of taking over the box's values
    // Largest accepted offset of an axis, with exceptions for single axes; a slope counts as its
    // offset at ahead_mm.
    double size_um = 500.0, ahead_mm = 40.0;
    std::array<std::optional<double>, 3> axis_size_um;
    double reference_s = 0.5;  // from power-on until the axes are referenced …
    double enable_s = 0.5;     // … and from there until enable
};

// The control's touch-probe cycle (docs/fakeplc.md).
struct twin_probe {
    double sigma_um = 0.5;        // of each measurement
    double duration_s = 1.0;      // of a cycle, at standstill
    double interval_s = 0.0;      // from one cycle to the next; 0: only on command and on request
    double wrong_fraction = 0.0;  // share of measurements that are wrong …
    double wrong_um = 100.0;      // … by plus or minus this
};

struct twin_config {
    std::string file;  // for messages; "" if made in code
    std::string machine;
    std::uint64_t seed = 1;
    std::array<twin_axis, 3> axes;
    std::map<std::string, twin_error> errors;  // by ISO 230-1 name: EZX, EAX …
    twin_chain chain;
    std::array<std::optional<twin_stage>, 3> stages;  // of axes with two drives
    double unexplained_percent = 0.0;                 // unexplained.h
    thermal_config thermal;                           // of the kind; the seed draws (thermal.h)
    cutting_config cutting;                           // likewise (force.h)
    double spectrum_exponent = 2.5;
    double spectrum_roll_off = 8.0;
    double repeatability_um = 0.3;  // standard deviation of each approach to a position
    twin_laser laser;
    twin_nc nc;
    twin_plc plc;
    twin_probe probe;
    xyz start_mm = {0.0, 0.0, 0.0};
    std::vector<twin_step> program;
    // Channel name to axis letter, where they differ; no_axis: it moves no axis (never from a
    // file).
    std::map<std::string, char> channels;
    std::map<std::string, double> signals;  // other constant signals of the PLC
    std::string coefficients;               // path of the register map; "" if not given
};

// Reads and checks a twin file; its paths become relative to the working directory. Throws
// input_error with one sentence that names file and key.
twin_config load_twin(const std::string &path);

// Place of a stage's drive by its name; empty if unknown.
struct drive_place {
    std::size_t axis, side;
};
std::optional<drive_place> find_drive(const twin_config &config, const std::string &name);

// 0, 1, 2 for 'X', 'Y', 'Z'; -1 otherwise.
int axis_index(char letter);

// Parts of an ISO 230-1 error name: EZX is direction Z of axis X.
struct error_name {
    int direction;  // 0..2: displacement along X, Y, Z; 3..5: rotation about A, B, C
    int axis;       // 0..2: the axis that moves
};
std::optional<error_name> parse_error_name(const std::string &name);

}  // namespace compbox::twin
