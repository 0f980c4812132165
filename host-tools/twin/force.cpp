// SPDX-License-Identifier: MIT
#include "host-tools/twin/force.h"

#include <fmt/core.h>

#include <cmath>

#include "host-tools/twin/random.h"
#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

// Relative position between two ends: 0 … 1 inside.
double part_of(double position, const std::array<double, 2> &ends) {
    return (position - ends[0]) / (ends[1] - ends[0]);
}

bool inside(double part) {
    return part >= 0.0 && part <= 1.0;
}

// 0 outside of the wall.
double compliance_um_per_N(const thin_wall &wall, const std::array<double, 3> &position_mm) {
    const double along = part_of(position_mm[static_cast<std::size_t>(wall.along)], wall.along_mm);
    const double height = part_of(position_mm[2], wall.z_mm);
    const double across =
        part_of(position_mm[static_cast<std::size_t>(wall.normal)], wall.normal_mm);
    if (!inside(along) || !inside(height) || !inside(across)) return 0.0;
    const double u = 2.0 * along - 1.0;
    return wall.compliance_um_per_N * height * height * height *
           (1.0 - wall.stiffer_middle * (1.0 - u * u));
}

}  // namespace

cutting_config drawn(const cutting_config &kind, std::uint64_t seed) {
    cutting_config one = kind;
    const auto vary = [&](double &value, const std::string &name) {
        value *= 1.0 + random_stream(seed, "force " + name).symmetric(kind.spread);
    };
    vary(one.N_per_mm, "coefficient");
    for (std::size_t a = 0; a < 3; ++a) {
        vary(one.share[a], fmt::format("share {}", a));
        vary(one.stiffness_N_per_um[a], fmt::format("stiffness {}", a));
    }
    for (auto &wall : one.walls) vary(wall.compliance_um_per_N, "wall " + wall.name);
    return one;
}

double force_N(const cutting_config &config, const cut &now) {
    if (now.depth_mm <= 0.0 || now.spindle_rpm <= 0.0 || now.feed_mm_per_s <= 0.0) return 0.0;
    const double per_tooth_mm = now.feed_mm_per_s * s_per_min / (now.spindle_rpm * config.teeth);
    return config.N_per_mm * now.depth_mm * std::pow(per_tooth_mm, config.exponent);
}

double cutting_power_W(const cutting_config &config, const cut &now) {
    const double speed_m_per_s =
        pi * m_per_mm * config.tool_diameter_mm * now.spindle_rpm / s_per_min;
    return force_N(config, now) * speed_m_per_s;
}

double spindle_load_percent(const cutting_config &config, const cut &now) {
    const double torque_Nm = force_N(config, now) * 0.5 * m_per_mm * config.tool_diameter_mm;
    return config.idle_percent * now.spindle_rpm / config.full_rpm +
           100.0 * torque_Nm / config.rated_Nm;
}

std::array<double, 3> force_error_um(const cutting_config &config, const cut &now,
                                     const std::array<double, 3> &position_mm) {
    const double force = force_N(config, now);
    std::array<double, 3> error_um = {0.0, 0.0, 0.0};
    if (force == 0.0) return error_um;
    for (std::size_t a = 0; a < 3; ++a) {
        error_um[a] = force * config.share[a] / config.stiffness_N_per_um[a];
    }
    for (const auto &wall : config.walls) {
        const auto a = static_cast<std::size_t>(wall.normal);
        error_um[a] += force * config.share[a] * compliance_um_per_N(wall, position_mm);
    }
    return error_um;
}

}  // namespace compbox::twin
