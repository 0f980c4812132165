// SPDX-License-Identifier: MIT
#include "host-tools/twin/geometry.h"

#include "host-tools/twin/frame.h"
#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr double mm_per_um = 1e-3, rad_per_urad = 1e-6;

xyz minus(const xyz &v) {
    return {-v[0], -v[1], -v[2]};
}

xyz scaled(double factor, const xyz &v) {
    return {factor * v[0], factor * v[1], factor * v[2]};
}

// The actual direction of travel of an axis.
xyz direction_of(int axis, const twin_chain &chain) {
    xyz unit = {}, turn = {};
    unit[static_cast<std::size_t>(axis)] = 1.0;
    if (axis == 1) turn = {0.0, 0.0, rad_per_urad * chain.c0y_urad};
    if (axis == 2) turn = {rad_per_urad * chain.a0z_urad, rad_per_urad * chain.b0z_urad, 0.0};
    return frame::rotation(turn) * unit;
}

// The errors of an axis as a displacement about the origin of its frame.
frame displaced_about(const xyz &origin_mm, const std::array<double, 6> &e) {
    const xyz shift = scaled(mm_per_um, {e[0], e[1], e[2]});
    const xyz turn = scaled(rad_per_urad, {e[3], e[4], e[5]});
    return frame::translation(origin_mm) * frame::translation(shift) * frame::rotation(turn) *
           frame::translation(minus(origin_mm));
}

}  // namespace

geometry::geometry(const twin_config &config) : chain_(config.chain), stages_(config.stages) {
    for (const auto &[name, error] : config.errors) {
        const error_name parts = parse_error_name(name).value();
        const twin_axis &axis = config.axes[static_cast<std::size_t>(parts.axis)];
        curves_.emplace(name, placed_curve{parts.axis, parts.direction,
                                           error_curve(error, axis, config, name)});
    }
    for (std::size_t a = 0; a < 3; ++a) {
        if (!stages_[a]) continue;
        for (std::size_t side = 0; side < 2; ++side) {
            const std::string &drive = stages_[a]->drives[side];
            sides_.emplace(drive,
                           error_curve(stages_[a]->errors[side], config.axes[a], config, drive));
        }
    }
}

// The chain from the workpiece to the tool. An axis that carries the tool moves the frame of its
// errors; one that carries the workpiece has it at rest, as seen from the workpiece.
xyz geometry::error_um(const twin_state &state) const {
    frame chain;
    bool tool_side = false;
    for (const char letter : chain_.order) {
        const int axis = axis_index(letter);
        if (axis < 0) {
            tool_side = true;
            continue;
        }
        const auto a = static_cast<std::size_t>(axis);
        const frame way =
            frame::translation(scaled(state.position_mm[a], direction_of(axis, chain_)));
        const frame error = displaced_about(
            chain_.reference_mm[a], errors_of(axis, state.position_mm[a], state.drive_um[a]));
        chain = chain * (tool_side ? way * error : error * way);
    }
    const xyz tip = chain * chain_.tool_mm;
    xyz error = {};
    for (std::size_t i = 0; i < 3; ++i) {
        error[i] = um_per_mm * (tip[i] - (chain_.tool_mm[i] + state.position_mm[i]));
    }
    return error;
}

geometry::six geometry::errors_of(int axis, double position_mm, const drives &drive_um) const {
    six errors = {};
    for (const auto &[name, placed] : curves_) {
        if (placed.axis != axis) continue;
        errors[static_cast<std::size_t>(placed.direction)] += placed.curve(position_mm);
    }
    add_stage(axis, position_mm, drive_um, errors);
    return errors;
}

// The middle of the stage moves by the mean of its sides; their difference yaws it. Compensation
// moves the sides too: its mean is part of the state's displacement and is not counted here.
void geometry::add_stage(int axis, double position_mm, const drives &drive_um, six &errors) const {
    const auto &stage = stages_[static_cast<std::size_t>(axis)];
    if (!stage) return;
    const double first_um = sides_.at(stage->drives[0])(position_mm);
    const double second_um = sides_.at(stage->drives[1])(position_mm);
    errors[static_cast<std::size_t>(axis)] += 0.5 * (first_um + second_um);
    const double ahead_um = second_um + drive_um[1] - first_um - drive_um[0];
    // X: sides along Y, a positive turn about Z moves the far side back. Y: sides along X.
    errors[5] += (axis == 0 ? -1.0 : 1.0) * um_per_mm * ahead_um / stage->span_mm;
}

double geometry::curve(const std::string &name, double position_mm) const {
    const auto side = sides_.find(name);
    return side != sides_.end() ? side->second(position_mm) : curves_.at(name).curve(position_mm);
}

xyz geometry::carriage_point_um(int axis, const xyz &point_mm, double position_mm) const {
    const xyz moved = displaced_about({}, errors_of(axis, position_mm, {})) * point_mm;
    xyz by_um = {};
    for (std::size_t i = 0; i < 3; ++i) by_um[i] = um_per_mm * (moved[i] - point_mm[i]);
    return by_um;
}

}  // namespace compbox::twin
