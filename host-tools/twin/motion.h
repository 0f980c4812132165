// SPDX-License-Identifier: MIT
// The axes: moves along a path within the limits of each axis, and the compensation on its way
// into them. One call is one interpolation cycle of the NC; nothing here reads a clock.
#pragma once

#include <deque>

#include "host-tools/twin/state.h"

namespace compbox::twin {

// A straight move with a trapezoidal velocity profile, evaluable at any time since its start.
class straight_move {
  public:
    straight_move() = default;
    // The path velocity and acceleration are the largest that every axis allows, the velocity at
    // most feed_mm_per_s. from and to must be inside the travels.
    straight_move(const xyz &from_mm, const xyz &to_mm, double feed_mm_per_s,
                  const std::array<twin_axis, 3> &axes);

    double duration_s() const { return duration_s_; }
    xyz position_mm(double since_start_s) const;

  private:
    xyz from_mm_ = {}, to_mm_ = {};
    double length_mm_ = 0.0, velocity_ = 0.0, acceleration_ = 0.0;
    double ramp_s_ = 0.0, duration_s_ = 0.0;
};

class nc_motion {
  public:
    explicit nc_motion(const twin_config &config);

    // Appends a move or dwell; steps run in order with a full stop between them. A target outside
    // the travel throws input_error.
    void queue(const twin_step &step);

    // The PLC's request for each axis, in µm of the register (before the control's sign). It takes
    // effect from the next cycle on: per cycle an axis takes over at most max velocity ×
    // comp_add_velo_factor × cycle. The rest follows in later cycles, without an alarm.
    void set_compensation_um(const xyz &asked_um) {
        asked_um_ = asked_um;
        slope_ = {};
    }
    // The control's temperature compensation: in each cycle asked_um + slope * (P - P0) with P the
    // axis' position of that cycle. slope in mm/mm; it is limited to comp_add_velo_factor, without
    // an alarm.
    void set_compensation_um(const xyz &asked_um, const xyz &slope, const xyz &reference_mm);
    // Difference between the two drives of each axis, second minus first, about that value. Each
    // drive takes over as much per cycle as an axis with one drive.
    void set_drive_difference_um(const xyz &difference_um) { difference_um_ = difference_um; }

    // One interpolation cycle of config.nc.interpolation_s.
    void step();

    double time_s() const { return static_cast<double>(cycles_) * cycle_s_; }
    bool moving() const { return busy_ || !waiting_.empty(); }
    // The control's displayed position, without the compensation.
    const xyz &position_mm() const { return position_mm_; }
    // Of each axis, in the last cycle.
    const xyz &velocity_mm_per_s() const { return velocity_mm_per_s_; }
    // Compensation applied to the axes so far, in µm of the register; the PLC can return it.
    xyz entered_um() const;
    // The resulting displacement of the tool: entered_um times the control's sign.
    xyz displacement_um() const;
    // The state of axes and drives, on which the machine's error depends.
    twin_state state() const;
    // Maximum change of an axis in one cycle.
    double max_step_um(int axis) const { return max_step_um_[static_cast<std::size_t>(axis)]; }

  private:
    void start_next();
    void move_axes();
    void take_over_compensation();

    std::array<twin_axis, 3> axes_;
    double cycle_s_;
    xyz max_step_um_;
    std::deque<twin_step> waiting_;
    bool busy_ = false;
    straight_move move_;
    double step_duration_s_ = 0.0;
    double spindle_rpm_ = 0.0, depth_mm_ = 0.0;
    double feed_mm_per_s_ = 0.0;  // along the path, in the last cycle
    long long cycles_ = 0, step_start_cycle_ = 0;
    xyz position_mm_, velocity_mm_per_s_ = {};
    xyz asked_um_ = {}, difference_um_ = {};
    std::array<std::array<double, 2>, 3> entered_um_ = {};  // by axis and drive
    xyz slope_ = {}, reference_mm_ = {};
    double most_slope_;
};

}  // namespace compbox::twin
