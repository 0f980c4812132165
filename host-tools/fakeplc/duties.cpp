// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/duties.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace compbox {

namespace {

std::int64_t to_us(double seconds) {
    return std::llround(seconds * 1e6);
}

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

bool finite(const correction &value) {
    return std::isfinite(value.um) && std::isfinite(value.slope) &&
           std::isfinite(value.reference_mm);
}

}  // namespace

double toward(double held, double want, double step) {
    return std::fabs(want - held) <= step ? want : held + (want > held ? step : -step);
}

plc_duties::plc_duties(const register_map &map, const twin_plc &limits, std::int64_t now_us)
    : map_(map),
      limits_(limits),
      commanded_(map.channels.size()),
      wanted_(map.channels.size()),
      box_moved_us_(now_us),
      whole_us_(now_us) {}

std::vector<std::string> plc_duties::take_events() {
    return std::exchange(events_, {});
}

// [watchdog] A heartbeat that stands still for long is a box that is not there.
void plc_duties::watch_box(const std::vector<std::uint16_t> &registers, std::int64_t now_us) {
    const std::uint16_t heartbeat = registers[static_cast<std::size_t>(map_.box_heartbeat)];
    status_ = registers[static_cast<std::size_t>(map_.status)];
    if (!scanned_) box_heartbeat_ = heartbeat;  // what was there before says nothing
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
        events_.push_back(box_lost_ ? "watchdog: box heartbeat stands still; ramping to zero"
                                    : "box heartbeat ended after a clean stop");
    }
}

// [torn] First and last register of a block that was written as one carry the same count.
bool plc_duties::block_is_whole(const std::vector<std::uint16_t> &registers, std::int64_t now_us) {
    const auto first = static_cast<std::size_t>(map_.write.start);
    const auto last = static_cast<std::size_t>(map_.write.end() - 1);
    const bool whole = !map_.write.counters || registers[first] == registers[last];
    if (whole) whole_us_ = now_us;
    torn_for_long_ = now_us - whole_us_ >= to_us(limits_.watchdog_s);
    return whole;
}

// [line] Every block begins a straight line that ends at its values. All channels go the same share
// of their ways, so two motors never stand further apart than in one block or the other.
double plc_duties::share_of_line(double dt_s) {
    const double share = dt_s < line_left_s_ ? dt_s / line_left_s_ : 1.0;
    line_left_s_ = std::max(line_left_s_ - dt_s, 0.0);
    return share;
}

// [slope] [ramp] The value moves towards the commanded one with a limited slope, at the new
// reference position: there the old value with its slope is the same correction. Without permission
// it goes to zero from what is applied where the axis stands, and the slope with it.
void plc_duties::take_channel(std::size_t c, bool apply, const std::optional<double> &position_mm,
                              double dt_s, double share) {
    const double speed = apply ? limits_.slope_um_per_s : limits_.ramp_um_per_s;
    correction &held = wanted_[c];
    double reference_mm = commanded_[c].reference_mm;
    if (!apply && position_mm) reference_mm = *position_mm;
    held.um = held.at_um(reference_mm);
    held.reference_mm = reference_mm;
    held.slope = apply ? commanded_[c].slope : 0.0;
    double target_um = apply ? commanded_[c].um : 0.0;
    if (apply && share < 1.0) target_um = held.um + share * (target_um - held.um);
    held.um = toward(held.um, target_um, speed * dt_s);
}

// [permission] Takes over only while the control permits it, and the box is there and says that it
// compensates or is on its way to zero.
void plc_duties::scan(const std::vector<std::uint16_t> &registers, bool permitted,
                      const std::vector<std::optional<double>> &position_mm, std::int64_t now_us,
                      double dt_s) {
    watch_box(registers, now_us);
    const bool whole = block_is_whole(registers, now_us);
    const bool apply =
        permitted && box_alive_ && mode() >= box_mode::active && mode() <= box_mode::fault;
    const double share = share_of_line(dt_s);
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        const correction value = written(map_.channels[c], registers);
        if (whole && finite(value)) commanded_[c] = value;
        take_channel(c, apply, position_mm[c], dt_s, share);
    }
}

}  // namespace compbox
