// SPDX-License-Identifier: MIT
#include "host-tools/twin/thermal.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr double J_per_kJ = 1000.0;
constexpr double rounding_s = 1e-9;
constexpr double fastest_part = 0.2;  // of the shortest time constant: longest part of a step

// out: the drive's present value in its unit: 1 for `always`, 1/min, mm/min or W
double drive_of(heat_drive drive, const thermal_load &load) {
    switch (drive) {
        case heat_drive::always:
            return 1.0;
        case heat_drive::spindle_rpm:
            return load.spindle_rpm;
        case heat_drive::travel_x:
            return s_per_min * std::fabs(load.axis_mm_per_s[0]);
        case heat_drive::travel_y:
            return s_per_min * std::fabs(load.axis_mm_per_s[1]);
        case heat_drive::travel_z:
            return s_per_min * std::fabs(load.axis_mm_per_s[2]);
        case heat_drive::cutting_W:
            return load.cutting_W;
    }
    return 0.0;
}

double watt_of(const thermal_heat &heat, const thermal_load &load) {
    const double drive = heat.drive == heat_drive::always ? heat.at : drive_of(heat.drive, load);
    return heat.watt * std::pow(drive / heat.at, heat.power);
}

// Heat flow from each node, W, by couplings and to air of temperature 0.
std::vector<double> outflow(const thermal_config &config, const std::vector<double> &degC) {
    std::vector<double> watt(config.nodes.size());
    for (std::size_t n = 0; n < watt.size(); ++n) {
        watt[n] = config.nodes[n].to_air_W_per_K * degC[n];
    }
    for (const auto &coupling : config.couplings) {
        const double flow = coupling.W_per_K * (degC[coupling.one] - degC[coupling.other]);
        watt[coupling.one] += flow;
        watt[coupling.other] -= flow;
    }
    return watt;
}

// Gershgorin's bound of the fastest mode's rate of heat loss, in 1/s.
double fastest_rate(const thermal_config &config) {
    std::vector<double> W_per_K;
    for (const auto &node : config.nodes) W_per_K.push_back(node.to_air_W_per_K);
    for (const auto &coupling : config.couplings) {
        W_per_K[coupling.one] += 2.0 * coupling.W_per_K;
        W_per_K[coupling.other] += 2.0 * coupling.W_per_K;
    }
    double rate = 0.0;
    for (std::size_t n = 0; n < W_per_K.size(); ++n) {
        rate = std::max(rate, W_per_K[n] / (J_per_kJ * config.nodes[n].capacity_kJ_per_K));
    }
    return rate;
}

}  // namespace

thermal_config drawn(const thermal_config &kind, std::uint64_t seed) {
    thermal_config one = kind;
    const auto vary = [&](double &value, const std::string &name) {
        value *= 1.0 + random_stream(seed, "thermal " + name).symmetric(kind.spread);
    };
    for (auto &node : one.nodes) {
        vary(node.capacity_kJ_per_K, "capacity " + node.name);
        vary(node.to_air_W_per_K, "air " + node.name);
    }
    for (std::size_t i = 0; i < one.couplings.size(); ++i) {
        auto &coupling = one.couplings[i];
        vary(coupling.W_per_K, fmt::format("coupling {}", i));
    }
    for (std::size_t i = 0; i < one.heats.size(); ++i) {
        vary(one.heats[i].watt, fmt::format("heat {}", i));
    }
    for (std::size_t i = 0; i < one.expansions.size(); ++i) {
        vary(one.expansions[i].um_per_K, fmt::format("expansion {}", i));
        vary(one.expansions[i].um_per_m_K, fmt::format("slope {}", i));
    }
    for (auto &sensor : one.sensors) {
        const double limit = sensor.offset_K;
        sensor.offset_K = random_stream(seed, "offset " + sensor.signal).symmetric(limit);
    }
    return one;
}

thermal_process::thermal_process(const thermal_config &config, std::uint64_t seed)
    : config_(config),
      node_degC_(config.nodes.size()),
      sensor_degC_(config.sensors.size()),
      shown_degC_(config.sensors.size()),
      watt_(config.nodes.size()),
      warmth_(config.heats.size(), 0.0) {
    for (const auto &sensor : config.sensors) noise_.emplace_back(seed, "noise " + sensor.signal);
    std::fill(node_degC_.begin(), node_degC_.end(), air_degC());
    std::fill(sensor_degC_.begin(), sensor_degC_.end(), air_degC());
    if (!config.empty()) {
        parts_ =
            std::max(1, static_cast<int>(std::ceil(step_s * fastest_rate(config) / fastest_part)));
    }
    read();
}

double thermal_process::air_degC() const {
    const thermal_air &air = config_.air;
    const double hour = air.start_h + static_cast<double>(steps_) * step_s / s_per_h;
    return air.mean_degC + air.swing_K * std::cos(two_pi * (hour - air.warmest_h) / 24.0);
}

void thermal_process::advance(double dt_s, const thermal_load &load) {
    double left_s = dt_s;
    while (left_s > rounding_s) {
        const double part_s = std::min(left_s, step_s - since_step_s_);
        for (std::size_t h = 0; h < warmth_.size(); ++h) {
            warmth_[h] += part_s * watt_of(config_.heats[h], load);
        }
        since_step_s_ += part_s;
        left_s -= part_s;
        if (since_step_s_ > step_s - rounding_s) step();
    }
}

void thermal_process::step() {
    since_step_s_ = 0.0;
    warm();
    ++steps_;
    read();
}

void thermal_process::warm() {
    std::fill(watt_.begin(), watt_.end(), 0.0);
    for (std::size_t h = 0; h < warmth_.size(); ++h) {
        watt_[config_.heats[h].node] += warmth_[h] / step_s;
        warmth_[h] = 0.0;
    }
    const double air = air_degC(), part_s = step_s / parts_;
    for (int part = 0; part < parts_; ++part) {
        const std::vector<double> out = outflow(config_, node_degC_);
        for (std::size_t n = 0; n < node_degC_.size(); ++n) {
            const thermal_node &node = config_.nodes[n];
            const double watt = watt_[n] - out[n] + node.to_air_W_per_K * air;
            node_degC_[n] += part_s * watt / (J_per_kJ * node.capacity_kJ_per_K);
        }
    }
}

void thermal_process::read() {
    for (std::size_t s = 0; s < sensor_degC_.size(); ++s) {
        const thermal_sensor &sensor = config_.sensors[s];
        const double gain = sensor.lag_s > 0.0 ? -std::expm1(-step_s / sensor.lag_s) : 1.0;
        sensor_degC_[s] += gain * (node_degC_[sensor.node] - sensor_degC_[s]);
        const double read = sensor_degC_[s] + sensor.offset_K + sensor.noise_K * noise_[s].normal();
        shown_degC_[s] = sensor.resolution_K > 0.0
                             ? sensor.resolution_K * std::round(read / sensor.resolution_K)
                             : read;
    }
}

std::array<double, 3> thermal_error_um(const thermal_config &config,
                                       const std::vector<double> &node_degC,
                                       const std::array<double, 3> &position_mm) {
    std::array<double, 3> error_um = {0.0, 0.0, 0.0};
    for (const auto &part : config.expansions) {
        const double way_m =
            m_per_mm * (position_mm[static_cast<std::size_t>(part.along)] - part.from_mm);
        error_um[static_cast<std::size_t>(part.direction)] +=
            (node_degC[part.node] - config.reference_degC) *
            (part.um_per_K + part.um_per_m_K * way_m);
    }
    return error_um;
}

}  // namespace compbox::twin
