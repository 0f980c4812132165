// SPDX-License-Identifier: MIT
#include "host-tools/twin/motion.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/twin/units.h"

namespace compbox::twin {

straight_move::straight_move(const xyz &from_mm, const xyz &to_mm, double feed_mm_per_s,
                             const std::array<twin_axis, 3> &axes)
    : from_mm_(from_mm), to_mm_(to_mm) {
    double squares = 0.0;
    for (std::size_t a = 0; a < 3; ++a) squares += std::pow(to_mm[a] - from_mm[a], 2.0);
    length_mm_ = std::sqrt(squares);
    if (length_mm_ == 0.0) return;
    double velocity = feed_mm_per_s, acceleration = 1e12;
    for (std::size_t a = 0; a < 3; ++a) {
        const double share = std::fabs(to_mm[a] - from_mm[a]) / length_mm_;
        if (share == 0.0) continue;
        velocity = std::min(velocity, axes[a].max_velocity_mm_per_s / share);
        acceleration = std::min(acceleration, axes[a].acceleration_mm_per_s2 / share);
    }
    // A short move never reaches its feed.
    velocity_ = std::min(velocity, std::sqrt(acceleration * length_mm_));
    acceleration_ = acceleration;
    ramp_s_ = velocity_ / acceleration_;
    duration_s_ = ramp_s_ + length_mm_ / velocity_;
}

xyz straight_move::position_mm(double since_start_s) const {
    if (since_start_s >= duration_s_) return to_mm_;
    const double t = std::max(since_start_s, 0.0);
    const double left_s = duration_s_ - t;
    double done_mm = velocity_ * (t - 0.5 * ramp_s_);
    if (t < ramp_s_) done_mm = 0.5 * acceleration_ * t * t;
    if (left_s < ramp_s_) done_mm = length_mm_ - 0.5 * acceleration_ * left_s * left_s;
    xyz position_mm = from_mm_;
    for (std::size_t a = 0; a < 3; ++a) {
        position_mm[a] += (to_mm_[a] - from_mm_[a]) * (done_mm / length_mm_);
    }
    return position_mm;
}

nc_motion::nc_motion(const twin_config &config)
    : axes_(config.axes),
      cycle_s_(config.nc.interpolation_s),
      position_mm_(config.start_mm),
      most_slope_(config.nc.comp_add_velo_factor) {
    for (std::size_t a = 0; a < 3; ++a) {
        max_step_um_[a] =
            um_per_mm * axes_[a].max_velocity_mm_per_s * config.nc.comp_add_velo_factor * cycle_s_;
    }
}

void nc_motion::queue(const twin_step &step) {
    for (std::size_t a = 0; a < 3; ++a) {
        if (!step.target_mm[a]) continue;
        const double target_mm = *step.target_mm[a];
        if (!axes_[a].present) {
            throw input_error(std::string("the machine has no axis ") + axis_letters[a]);
        }
        if (!(target_mm >= axes_[a].min_mm && target_mm <= axes_[a].max_mm)) {
            throw input_error(fmt::format("{} {} mm is outside the travel {} to {} mm",
                                          std::string(1, axis_letters[a]), target_mm,
                                          axes_[a].min_mm, axes_[a].max_mm));
        }
    }
    if (step.dwell_s <= 0.0 && !(step.feed_mm_per_s > 0.0)) {
        throw input_error("a move needs a feed above zero");
    }
    waiting_.push_back(step);
}

void nc_motion::start_next() {
    const twin_step step = waiting_.front();
    waiting_.pop_front();
    xyz target_mm = position_mm_;
    for (std::size_t a = 0; a < 3; ++a) target_mm[a] = step.target_mm[a].value_or(position_mm_[a]);
    const bool dwell = step.dwell_s > 0.0;
    move_ = dwell ? straight_move(position_mm_, position_mm_, 1.0, axes_)
                  : straight_move(position_mm_, target_mm, step.feed_mm_per_s, axes_);
    step_duration_s_ = dwell ? step.dwell_s : move_.duration_s();
    step_start_cycle_ = cycles_;
    if (step.spindle_rpm) spindle_rpm_ = *step.spindle_rpm;
    depth_mm_ = step.depth_of_cut_mm;
    busy_ = true;
}

void nc_motion::move_axes() {
    const double since_start_s = static_cast<double>(cycles_ - step_start_cycle_) * cycle_s_;
    position_mm_ = move_.position_mm(since_start_s);
    busy_ = since_start_s < step_duration_s_;
}

void nc_motion::set_compensation_um(const xyz &asked_um, const xyz &slope,
                                    const xyz &reference_mm) {
    asked_um_ = asked_um;
    reference_mm_ = reference_mm;
    for (std::size_t a = 0; a < 3; ++a) slope_[a] = std::clamp(slope[a], -most_slope_, most_slope_);
}

void nc_motion::take_over_compensation() {
    for (std::size_t a = 0; a < 3; ++a) {
        const double way_mm = position_mm_[a] - reference_mm_[a];
        const double middle_um = asked_um_[a] + um_per_mm * slope_[a] * way_mm;
        for (std::size_t side = 0; side < 2; ++side) {
            const double wanted_um = middle_um + (side == 0 ? -0.5 : 0.5) * difference_um_[a];
            double &entered_um = entered_um_[a][side];
            const double change_um = wanted_um - entered_um;
            const double step_um = std::clamp(change_um, -max_step_um_[a], max_step_um_[a]);
            entered_um = step_um == change_um ? wanted_um : entered_um + step_um;
        }
    }
}

void nc_motion::step() {
    if (!busy_ && !waiting_.empty()) start_next();
    ++cycles_;
    const xyz before_mm = position_mm_;
    if (busy_) move_axes();
    if (!busy_) depth_mm_ = 0.0;
    feed_mm_per_s_ = std::hypot(position_mm_[0] - before_mm[0], position_mm_[1] - before_mm[1],
                                position_mm_[2] - before_mm[2]) /
                     cycle_s_;
    for (std::size_t a = 0; a < 3; ++a)
        velocity_mm_per_s_[a] = (position_mm_[a] - before_mm[a]) / cycle_s_;
    take_over_compensation();
}

xyz nc_motion::entered_um() const {
    xyz mean = {};
    for (std::size_t a = 0; a < 3; ++a) mean[a] = 0.5 * (entered_um_[a][0] + entered_um_[a][1]);
    return mean;
}

xyz nc_motion::displacement_um() const {
    return state().displacement_um();
}

twin_state nc_motion::state() const {
    twin_state state;
    state.time_s = time_s();
    state.position_mm = position_mm_;
    state.spindle_rpm = spindle_rpm_;
    state.feed_mm_per_min = s_per_min * feed_mm_per_s_;
    state.depth_of_cut_mm = depth_mm_;
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t side = 0; side < 2; ++side) {
            state.drive_um[a][side] = entered_um_[a][side] * axes_[a].compensation_sign;
        }
    }
    return state;
}

}  // namespace compbox::twin
