// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/duties.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace compbox::fakeplc {

const char *box_mode::name_of(unsigned mode) {
    static const char *const names[] = {"STANDBY", "ACTIVE", "HOLD", "RAMP", "FAULT", "STOPPED"};
    return mode < 6 ? names[mode] : "an unknown mode";
}

std::int64_t to_us(double seconds) {
    return std::llround(seconds * 1e6);
}

namespace {

// [take-over] Value, slope and reference of a channel as the box wrote them.
correction written(const taken_channel &channel, const std::vector<std::uint16_t> &registers) {
    const auto number = [&](const number_format &format, int address) {
        return format.decode(&registers[static_cast<std::size_t>(address)]);
    };
    correction value;
    value.um = number(channel.format, channel.address) * channel.scale_um;
    if (!channel.tangent) return value;
    const taken_tangent &tangent = *channel.tangent;
    value.slope = number(tangent.slope_format, tangent.slope_address) * tangent.slope_scale;
    value.reference_mm =
        number(tangent.reference_format, tangent.reference_address) * tangent.reference_scale_mm;
    return value;
}

// out: value, slope and reference are numbers, and so is what they make of any position in reach.
bool finite(const correction &value) {
    return std::isfinite(value.um) && std::isfinite(value.slope) &&
           std::isfinite(value.reference_mm) && std::isfinite(value.at_um(0.0));
}

}  // namespace

double toward(double held, double want, double step) {
    return std::fabs(want - held) <= step ? want : held + (want > held ? step : -step);
}

plc_duties::plc_duties(const register_map &map, const twin::twin_plc &limits,
                       std::vector<double> sizes_um, std::int64_t now_us)
    : map_(map),
      limits_(limits),
      sizes_um_(std::move(sizes_um)),
      commanded_(map.channels.size()),
      wanted_(map.channels.size()),
      limited_(map.channels.size(), false),
      box_moved_us_(now_us),
      whole_us_(now_us),
      numbers_us_(now_us) {}

std::vector<std::string> plc_duties::take_events() {
    return std::exchange(events_, {});
}

// [watchdog] The box is lost if its heartbeat does not change for watchdog_s.
void plc_duties::watch_box(const std::vector<std::uint16_t> &registers, std::int64_t now_us) {
    const std::uint16_t heartbeat = registers[static_cast<std::size_t>(map_.box_heartbeat)];
    status_ = registers[static_cast<std::size_t>(map_.status)];
    if (!scanned_) box_heartbeat_ = heartbeat;  // a value from before the start is no reference
    scanned_ = true;
    if (heartbeat != box_heartbeat_) {
        box_heartbeat_ = heartbeat;
        box_moved_us_ = now_us;
        line_left_s_ = map_.interpolate_s;
        if (!box_alive_)
            events_.push_back(box_seen_ ? "box heartbeat is back" : "box heartbeat seen");
        box_seen_ = box_alive_ = true;
        box_lost_ = false;
    }
    if (box_alive_ && now_us - box_moved_us_ >= to_us(limits_.watchdog_s)) {
        box_alive_ = false;
        box_lost_ = mode() != box_mode::stopped;
        events_.push_back(box_lost_ ? "watchdog: box heartbeat does not change; ramping to zero"
                                    : "box heartbeat ended after a clean stop");
    }
}

// [torn] The first and last register of a complete block have the same count.
bool plc_duties::block_is_whole(const std::vector<std::uint16_t> &registers, std::int64_t now_us) {
    const auto first = static_cast<std::size_t>(map_.write.start);
    const auto last = static_cast<std::size_t>(map_.write.end() - 1);
    const bool whole = !map_.write.counters || registers[first] == registers[last];
    if (whole) whole_us_ = now_us;
    torn_for_long_ = now_us - whole_us_ >= to_us(limits_.watchdog_s);
    return whole;
}

// Rejects a whole block if one of its values is not a number. Otherwise one of a stage's two motors
// would move without the other.
void plc_duties::take_over(const std::vector<std::uint16_t> &registers, std::int64_t now_us) {
    std::vector<correction> values;
    for (const auto &channel : map_.channels) values.push_back(written(channel, registers));
    numbers_ = std::all_of(values.begin(), values.end(), finite);
    if (!numbers_) return;
    commanded_ = values;
    numbers_us_ = now_us;
}

// [line] Interpolates linearly from the present values to those of the new block. All channels use
// the same fraction, so two motors never differ by more than in one of the two blocks.
double plc_duties::share_of_line(double dt_s) {
    const double share = dt_s < line_left_s_ ? dt_s / line_left_s_ : 1.0;
    line_left_s_ = std::max(line_left_s_ - dt_s, 0.0);
    return share;
}

// [slope] [ramp] Moves the correction at the axis position towards the commanded one by a limited
// step, along the commanded slope. Without permission, the target is zero and the slope is zero at
// once. An axis without a known position counts as at the reference.
void plc_duties::take_channel(std::size_t c, bool apply, const std::optional<double> &position_mm,
                              double dt_s, double share) {
    correction target = commanded_[c];
    const double at_mm = position_mm.value_or(target.reference_mm);
    if (!apply) target = {0.0, 0.0, at_mm};
    const double speed = apply ? limits_.slope_um_per_s : limits_.ramp_um_per_s;
    const double before_um = wanted_[c].at_um(at_mm);
    double asked_um = target.at_um(at_mm);
    if (apply && share < 1.0) asked_um = before_um + share * (asked_um - before_um);
    const double here_um = toward(before_um, asked_um, speed * dt_s);
    wanted_[c] = held_to_size(target, here_um, at_mm, sizes_um_[c]);
    note_limited(c, apply && beyond(target, at_mm, sizes_um_[c]));
}

// The NC follows a slope until its next set, over ahead_mm at most; the size includes that.
bool plc_duties::beyond(const correction &line, double position_mm, double size_um) const {
    const double ahead_um = std::fabs(1e3 * line.slope) * limits_.ahead_mm;
    return std::fabs(line.um) > size_um || std::fabs(line.at_um(position_mm)) + ahead_um > size_um;
}

// [size] in : target with slope and reference; here_um: wanted correction at position_mm
// out: the line through here_um, limited to the size; without a slope if it would lead beyond
correction plc_duties::held_to_size(const correction &target, double here_um, double position_mm,
                                    double size_um) const {
    const double held_um = std::clamp(here_um, -size_um, size_um);
    correction line = target;
    line.um = held_um - 1e3 * target.slope * (position_mm - target.reference_mm);
    return beyond(line, position_mm, size_um) ? correction{held_um, 0.0, position_mm} : line;
}

void plc_duties::note_limited(std::size_t c, bool limited) {
    if (limited && !limited_[c]) ++times_limited_;
    limited_[c] = limited;
}

// [permission] Applies values only while the control permits it, the box is alive, its values are
// numbers, and its status is a compensating or ramping mode.
void plc_duties::scan(const std::vector<std::uint16_t> &registers, bool permitted,
                      const std::vector<std::optional<double>> &position_mm, std::int64_t now_us,
                      double dt_s) {
    watch_box(registers, now_us);
    if (block_is_whole(registers, now_us)) take_over(registers, now_us);
    const bool numbers = numbers_ || now_us - numbers_us_ < to_us(limits_.watchdog_s);
    const bool apply = permitted && box_alive_ && numbers && mode() >= box_mode::active &&
                       mode() <= box_mode::fault;
    const double share = share_of_line(dt_s);
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        take_channel(c, apply, position_mm[c], dt_s, share);
    }
}

}  // namespace compbox::fakeplc
