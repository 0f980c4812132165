// SPDX-License-Identifier: MIT
#include "host-tools/twin/process_parts.h"

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr int moments_of_a_day = 100;
constexpr int moment_s = 300;  // interval, which gives a day of 8 h
constexpr double usual_rpm = 6000.0, usual_travel_mm_per_s = 50.0;
constexpr double usual_depth_mm = 1.0, usual_feed_mm_per_min = 250.0;

cut cut_of(const twin_state &state) {
    return {state.spindle_rpm, state.feed_mm_per_min / s_per_min, state.depth_of_cut_mm};
}

}  // namespace

thermal_part::thermal_part(const twin_config &config)
    : config_(drawn(config.thermal, config.seed)) {
    work_a_day(config);
}

// Speeds change every half hour; all random values come from a separate stream.
void thermal_part::work_a_day(const twin_config &config) {
    thermal_config unwatched = config_;
    unwatched.sensors.clear();
    thermal_process process(unwatched, config.seed);
    random_stream stream(config.seed, "thermal day");
    thermal_load load;
    for (int moment = 0; moment < moments_of_a_day; ++moment) {
        if (moment % 6 == 0) {
            load.spindle_rpm = usual_rpm * stream.uniform();
            for (auto &speed : load.axis_mm_per_s) speed = usual_travel_mm_per_s * stream.uniform();
        }
        for (int s = 0; s < moment_s; ++s) process.advance(thermal_process::step_s, load);
        moments_.push_back(process.node_degC());
    }
}

xyz thermal_part::error_um(const twin_state &state) const {
    std::vector<double> node_degC;
    for (const auto &node : config_.nodes) {
        const auto found = state.temperature_degC.find(node.name);
        node_degC.push_back(found == state.temperature_degC.end() ? config_.reference_degC
                                                                  : found->second);
    }
    return thermal_error_um(config_, node_degC, state.position_mm);
}

void thermal_part::vary(twin_state &state, random_stream &stream) const {
    const auto &moment =
        moments_[static_cast<std::size_t>(stream.uniform() * static_cast<double>(moments_.size()))];
    for (std::size_t n = 0; n < config_.nodes.size(); ++n) {
        state.temperature_degC[config_.nodes[n].name] = moment[n];
    }
}

xyz force_part::error_um(const twin_state &state) const {
    return force_error_um(config_, cut_of(state), state.position_mm);
}

void force_part::vary(twin_state &state, random_stream &stream) const {
    state.spindle_rpm = usual_rpm * (0.5 + 0.5 * stream.uniform());
    state.feed_mm_per_min = usual_feed_mm_per_min;
    state.depth_of_cut_mm = usual_depth_mm * stream.uniform();
}

}  // namespace compbox::twin
