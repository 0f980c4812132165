// SPDX-License-Identifier: MIT
// Cutting force and the deflection of the machine and of a thin wall of the workpiece.
// docs/twin.md, "Force".
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace compbox::twin {

// A wall of the workpiece, fixed at its foot. It yields along one axis, most at its top and its
// free ends:
//     compliance * h^3 * (1 - stiffer_middle * (1 - u^2)),  h = 0 at the foot, 1 at the top,
//     u = -1 … 1 along the wall.
struct thin_wall {
    std::string name;
    int normal = 1;                                                  // axis along which it yields
    int along = 0;                                                   // axis along its length
    std::array<double, 2> along_mm = {}, normal_mm = {}, z_mm = {};  // its extent
    double compliance_um_per_N = 0.0;                                // at the top of its ends
    double stiffer_middle = 0.0;                                     // 0 … 1
};

// Mean force, N: N_per_mm * depth * (feed per tooth / 1 mm)^exponent; its shares along X, Y, Z
// deflect the tool. Spindle load, %: the drive's display below its rated speed, torque as a
// fraction of the rated one: of the cut, and of idling in proportion to the speed.
struct cutting_config {
    double N_per_mm = 0.0;
    double exponent = 0.75;
    int teeth = 2;
    double tool_diameter_mm = 10.0;
    std::array<double, 3> share = {};
    std::array<double, 3> stiffness_N_per_um = {20.0, 20.0, 50.0};
    double rated_Nm = 20.0;
    double idle_percent = 0.0, full_rpm = 10000.0;
    double load_noise_percent = 0.0;
    double load_lag_s = 0.3;  // of the drive's display
    double spread = 0.0;      // a seed draws force, shares, stiffness and compliance within ± this
                              // fraction
    std::vector<thin_wall> walls;

    bool empty() const { return N_per_mm == 0.0; }
};

// The seed's machine of this kind.
cutting_config drawn(const cutting_config &kind, std::uint64_t seed);

// Motion and engagement of the tool.
struct cut {
    double spindle_rpm = 0.0;
    double feed_mm_per_s = 0.0;  // along the path
    double depth_mm = 0.0;       // 0: no cut
};

double force_N(const cutting_config &config, const cut &now);
double cutting_power_W(const cutting_config &config, const cut &now);
// Load without noise.
double spindle_load_percent(const cutting_config &config, const cut &now);

// Displacement of the tool relative to the workpiece, µm.
std::array<double, 3> force_error_um(const cutting_config &config, const cut &now,
                                     const std::array<double, 3> &position_mm);

}  // namespace compbox::twin
