// SPDX-License-Identifier: MIT
#include "host-tools/twin/set_up.h"

#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr double um_per_mm_per_urad = 1e-3;
constexpr double days = 30.0, reading_s = 10.0;

}  // namespace

double as_shown(double error_um, const twin_config &config) {
    // Uses the number of steps in 1 µm, which gives the shortest decimals: 0.07, not 0.07000…1.
    const double steps_per_um = std::round(1.0 / config.laser.resolution_um);
    return std::round(error_um * steps_per_um) / steps_per_um;
}

laser_set_up::laser_set_up(const twin_machine &twin, const std::string &name, bool straight,
                           bool angles)
    : twin_(twin),
      noise_(twin.config().seed, "laser noise " + name),
      time_s_(-s_per_day *
              (1.0 + days * random_stream(twin.config().seed, "when " + name).uniform())) {
    random_stream beam(twin.config().seed, "laser set-up " + name);
    const twin_laser &laser = twin.config().laser;
    const double slope_urad = beam.symmetric(laser.slope_urad);
    if (straight) slope_um_per_mm_ = um_per_mm_per_urad * slope_urad;
    offset_um_ = beam.symmetric(laser.offset_um);
    sigma_um_ =
        straight && !angles ? laser.straightness_um.value_or(laser.sigma_um) : laser.sigma_um;
}

double laser_set_up::reading_um(double error_um, double way_mm) {
    const twin_config &config = twin_.config();
    const double approach_um = config.repeatability_um * noise_.normal();
    const double reading_um = sigma_um_ * noise_.normal();
    const double beam_um = offset_um_ + slope_um_per_mm_ * way_mm;
    return as_shown(error_um + beam_um + approach_um + reading_um, config);
}

xyz laser_set_up::unexplained_um(const xyz &position_mm) {
    twin_state state = state_at(position_mm);
    state.time_s = time_s_;
    time_s_ += reading_s;
    return twin_.unexplained_error_um(state);
}

}  // namespace compbox::twin
