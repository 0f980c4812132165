// SPDX-License-Identifier: MIT
#include "host-tools/twin/process.h"

#include <algorithm>
#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr double load_every_s = 0.1;  // of the display

}  // namespace

machine_process::machine_process(const twin_config &config)
    : cutting_(drawn(config.cutting, config.seed)),
      thermal_config_(drawn(config.thermal, config.seed)),
      thermal_(thermal_config_, config.seed),
      load_noise_(config.seed, "noise spindle load"),
      has_any_(!config.thermal.empty() || !config.cutting.empty()) {
    now_.position_mm = config.start_mm;
}

void machine_process::advance(double dt_s, const twin_state &now) {
    const cut cutting = {now.spindle_rpm, now.feed_mm_per_min / s_per_min, now.depth_of_cut_mm};
    thermal_load load;
    load.spindle_rpm = now.spindle_rpm;
    load.cutting_W = cutting_power_W(cutting_, cutting);
    for (std::size_t a = 0; a < 3; ++a) {
        load.axis_mm_per_s[a] = (now.position_mm[a] - now_.position_mm[a]) / dt_s;
    }
    if (!thermal_config_.empty()) thermal_.advance(dt_s, load);
    now_ = now;
    now_.spindle_load_percent = spindle_load_percent(cutting_, cutting);
    const double gain = cutting_.load_lag_s > 0.0 ? -std::expm1(-dt_s / cutting_.load_lag_s) : 1.0;
    filtered_load_percent_ += gain * (now_.spindle_load_percent - filtered_load_percent_);
    since_load_s_ += dt_s;
    if (since_load_s_ < load_every_s) return;
    since_load_s_ = 0.0;
    const double noise = cutting_.load_noise_percent * load_noise_.normal();
    shown_load_percent_ = std::max(0.0, filtered_load_percent_ + noise);
}

void machine_process::fill(twin_state &state) const {
    for (std::size_t n = 0; n < thermal_config_.nodes.size(); ++n) {
        state.temperature_degC[thermal_config_.nodes[n].name] = thermal_.node_degC()[n];
    }
    state.spindle_load_percent = now_.spindle_load_percent;
}

std::optional<double> machine_process::signal(const std::string &name) const {
    if (!has_any_) return std::nullopt;
    for (std::size_t s = 0; s < thermal_config_.sensors.size(); ++s) {
        if (thermal_config_.sensors[s].signal == name) return thermal_.sensor_degC()[s];
    }
    if (name == "spindle_rpm") return now_.spindle_rpm;
    if (name == "spindle_load_percent") return shown_load_percent_;
    if (name == "feed_mm_per_min") return now_.feed_mm_per_min;
    if (name == "depth_of_cut_mm") return now_.depth_of_cut_mm;
    return std::nullopt;
}

}  // namespace compbox::twin
