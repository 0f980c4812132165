// SPDX-License-Identifier: MIT
// The thermal network: heat sources warm nodes of the machine, which exchange heat with each other
// and with the air. Their expansion moves the tool; thermometers measure them. docs/twin.md,
// "Heat".
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host-tools/twin/random.h"

namespace compbox::twin {

struct thermal_node {
    std::string name;
    double capacity_kJ_per_K = 1.0;
    double to_air_W_per_K = 1.0;
};

struct thermal_coupling {
    std::size_t one = 0, other = 0;  // nodes
    double W_per_K = 0.0;
};

// Source of a node's heat: watt * (drive / at)^power. `at` in the drive's unit: 1/min, mm/min, W.
enum class heat_drive { always, spindle_rpm, travel_x, travel_y, travel_z, cutting_W };

struct thermal_heat {
    std::size_t node = 0;
    heat_drive drive = heat_drive::always;
    double watt = 0.0, at = 1.0, power = 1.0;
};

// Expansion of a node moves the tool by (T - reference) * (um_per_K + um_per_m_K * (P - from)),
// with P the position of the axis `along`: the control's K0 and tanβ parts.
struct thermal_expansion {
    std::size_t node = 0;
    int direction = 0;  // 0..2: X, Y, Z
    double um_per_K = 0.0;
    double um_per_m_K = 0.0;
    int along = 0;
    double from_mm = 0.0;
};

struct thermal_sensor {
    std::string signal;
    std::size_t node = 0;
    double lag_s = 20.0;
    double resolution_K = 0.1;
    double noise_K = 0.03;  // of a reading, 1 sigma
    double offset_K = 0.0;  // error of this sensor, within ± this value
};

struct thermal_air {
    double mean_degC = 20.0;
    double swing_K = 0.0;  // amplitude over a day of 24 h
    double warmest_h = 15.0;
    double start_h = 7.0;  // time of day at the start
};

struct thermal_config {
    double reference_degC = 20.0;  // temperature of zero expansion
    double spread = 0.0;           // a seed draws each parameter within ± this fraction
    thermal_air air;
    std::vector<thermal_node> nodes;
    std::vector<thermal_coupling> couplings;
    std::vector<thermal_heat> heats;
    std::vector<thermal_expansion> expansions;
    std::vector<thermal_sensor> sensors;

    bool empty() const { return nodes.empty(); }
};

// The seed's machine of this kind: capacities, conductances, heats and expansions within ± spread,
// each from its own stream, and offsets of the sensors. Names, drives, noise, lags and the air are
// unchanged.
thermal_config drawn(const thermal_config &kind, std::uint64_t seed);

// The machine's activity, as far as it produces heat.
struct thermal_load {
    double spindle_rpm = 0.0;
    std::array<double, 3> axis_mm_per_s = {};  // the sign is ignored
    double cutting_W = 0.0;
};

// Simulates the temperatures. Time is an argument; equal loads give equal temperatures for any
// division of the time, because it is counted in steps of one second, with the mean of the loads in
// each.
class thermal_process {
  public:
    static constexpr double step_s = 1.0;

    // Starts with all nodes and sensors at the air's temperature. seed determines the noise of the
    // sensors.
    thermal_process(const thermal_config &config, std::uint64_t seed);

    // in : 0 < dt_s <= step_s
    void advance(double dt_s, const thermal_load &load);

    double air_degC() const;
    const std::vector<double> &node_degC() const { return node_degC_; }
    // Displayed temperatures: delayed by the sensor's lag, with noise, rounded; updated once a
    // second.
    const std::vector<double> &sensor_degC() const { return shown_degC_; }

  private:
    void step();
    void warm();
    void read();

    thermal_config config_;
    std::vector<random_stream> noise_;  // of each sensor
    std::vector<double> node_degC_, sensor_degC_, shown_degC_, watt_;
    std::vector<double> warmth_;  // of each heat: time integral of its power since the last step, J
    double since_step_s_ = 0.0;
    long long steps_ = 0;
    int parts_ = 1;  // parts of a step, so that the fastest node is resolved
};

// Displacement of the tool relative to the workpiece, µm.
// in : a temperature for each node
std::array<double, 3> thermal_error_um(const thermal_config &config,
                                       const std::vector<double> &node_degC,
                                       const std::array<double, 3> &position_mm);

}  // namespace compbox::twin
