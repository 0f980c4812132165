// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/plc.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"

namespace compbox {

namespace {

constexpr std::int64_t most_behind_us = 1000000;
constexpr std::int64_t reset_pulse_us = 500000;

enum control_bit : std::uint16_t { bit_enable = 1, bit_reset = 4, bit_permit = 8 };

// The low byte of the box's status register (docs/DESIGN.md).
enum box_mode { standby = 0, active = 1, hold = 2, ramp = 3, fault = 4, stopped = 5 };

const char *mode_name(unsigned mode) {
    static const char *const names[] = {"STANDBY", "ACTIVE", "HOLD", "RAMP", "FAULT", "STOPPED"};
    return mode < 6 ? names[mode] : "an unknown mode";
}

std::int64_t to_us(double seconds) {
    return std::llround(seconds * 1e6);
}

// held moved towards want by at most step.
double toward(double held, double want, double step) {
    return std::fabs(want - held) <= step ? want : held + (want > held ? step : -step);
}

// The index of the axis that a channel moves; nothing where the machine says that it moves none.
std::optional<std::size_t> axis_of(const taken_channel &channel, const twin_config &config,
                                   const std::string &file) {
    const auto mapped = config.channels.find(channel.name);
    if (mapped != config.channels.end() && mapped->second == no_axis) return std::nullopt;
    if (const auto drive = find_drive(config, channel.name)) return drive->axis;
    const int axis = mapped != config.channels.end() ? axis_index(mapped->second)
                     : channel.name.size() == 1      ? axis_index(channel.name[0])
                                                     : -1;
    if (axis < 0 || !config.axes[static_cast<std::size_t>(axis)].present) {
        throw input_error(file, 0, 0,
                          "the channel '" + channel.name +
                              "' moves no axis of the twin: name it after one, or map it in "
                              "'channels' of the twin file");
    }
    return static_cast<std::size_t>(axis);
}

}  // namespace

fake_plc::fake_plc(const twin_config &config, const register_map &map, const plc_profile &profile,
                   std::int64_t now_us)
    : config_(config),
      map_(map),
      profile_(profile),
      twin_(config),
      nc_(config),
      commanded_um_(map.channels.size(), 0.0),
      applied_um_(map.channels.size(), 0.0),
      commanded_(map.channels.size()),
      applied_(map.channels.size()),
      start_us_(now_us),
      nc_due_us_(now_us),
      scan_due_us_(now_us),
      nc_cycle_us_(to_us(config.nc.interpolation_s)),
      scan_us_(to_us(config.plc.scan_s)) {
    registers_.now.assign(static_cast<std::size_t>(map.size()), 0);
    registers_.before = registers_.now;
    for (const auto &channel : map.channels) {
        axis_of_channel_.push_back(axis_of(channel, config, map.file));
    }
    event("PLC started");
}

std::int64_t fake_plc::next_due_us() const {
    return std::min(nc_due_us_, scan_due_us_);
}

void fake_plc::forget_standstill(std::int64_t now_us) {
    const std::int64_t behind_us = now_us - next_due_us();
    if (behind_us <= most_behind_us) return;
    start_us_ += behind_us;
    nc_due_us_ += behind_us;
    scan_due_us_ += behind_us;
    event("the process stood still for " + std::to_string(behind_us / 1000) + " ms");
}

byte_string fake_plc::answer(const byte_string &request, bool torn) {
    return modbus::answer(request, profile_, registers_, torn);
}

void fake_plc::nc_cycle() {
    nc_.step();
    ++nc_cycles_;
    nc_due_us_ += nc_cycle_us_;
}

// Read the box's outputs, do the duties, show the new state.
void fake_plc::scan() {
    since_start_us_ = scan_due_us_ - start_us_;
    registers_.before = registers_.now;
    start_up();
    watch_box();
    take_over();
    start_program_once_active();
    show();
    note_changes();
    keep_state();
    scan_due_us_ += scan_us_;
}

// References the axes, then enables, unless somebody has taken that over by hand.
void fake_plc::start_up() {
    const double time_s = static_cast<double>(since_start_us_) * 1e-6;
    if (!reference_by_hand_ && time_s >= config_.plc.reference_s) referenced_ = true;
    const double enable_at_s = config_.plc.reference_s + config_.plc.enable_s;
    if (!enable_by_hand_ && referenced_ && time_s >= enable_at_s) enable_ = true;
}

void fake_plc::watch_box() {
    const std::uint16_t heartbeat = registers_.now[static_cast<std::size_t>(map_.box_heartbeat)];
    status_ = registers_.now[static_cast<std::size_t>(map_.status)];
    if (heartbeat != box_heartbeat_) {
        box_heartbeat_ = heartbeat;
        box_moved_us_ = since_start_us_;
        if (!box_alive_) event(box_seen_ ? "box heartbeat is back" : "box heartbeat seen");
        box_seen_ = box_alive_ = true;
    }
    if (box_alive_ && since_start_us_ - box_moved_us_ >= to_us(config_.plc.watchdog_s)) {
        box_alive_ = false;
        event((status_ & 0xFFu) == stopped
                  ? "box heartbeat ended after a clean stop"
                  : "watchdog: box heartbeat stands still; ramping to zero");
    }
}

bool fake_plc::may_apply() const {
    const unsigned mode = status_ & 0xFFu;
    return box_alive_ && enable_ && referenced_ && mode >= active && mode <= fault;
}

fake_plc::taken fake_plc::read_value(const taken_channel &channel) const {
    const auto number = [&](const number_format &format, int address) {
        return format.decode(&registers_.now[static_cast<std::size_t>(address)]);
    };
    taken value;
    value.um = number(channel.format, channel.address) * channel.scale_um;
    if (!channel.tangent) return value;
    const taken_tangent &tangent = *channel.tangent;
    value.slope = number(tangent.slope_format, tangent.slope_address) * tangent.slope_scale;
    value.reference_mm =
        number(tangent.reference_format, tangent.reference_address) * tangent.reference_scale_mm;
    return value;
}

// The value moves towards the commanded one with a limited slope, at the new reference position:
// there the old value with its slope is the same correction. Without permission it goes to zero
// from what is applied where the axis stands, and the slope with it.
void fake_plc::take_channel(std::size_t c, bool torn, double dt_s) {
    const auto &channel = map_.channels[c];
    const taken written = read_value(channel);
    taken &held = applied_[c];
    if (!torn && std::isfinite(written.um) && std::isfinite(written.slope) &&
        std::isfinite(written.reference_mm))
        commanded_[c] = written;
    const bool apply = may_apply();
    const double speed = apply ? config_.plc.slope_um_per_s : config_.plc.ramp_um_per_s;
    double reference_mm = commanded_[c].reference_mm;
    if (!apply && axis_of_channel_[c]) reference_mm = nc_.position_mm()[*axis_of_channel_[c]];
    held.um += 1e3 * held.slope * (reference_mm - held.reference_mm);
    held.reference_mm = reference_mm;
    held.slope = apply ? commanded_[c].slope : 0.0;
    held.um = toward(held.um, apply ? commanded_[c].um : 0.0, speed * dt_s);
    commanded_um_[c] = commanded_[c].um;
    applied_um_[c] = held.um;
}

// Takes over what the box wrote, with a limited slope; else goes to zero on the PLC's own ramp.
// Several channels of one axis act by their mean; those of a stage's two drives yaw it as well.
void fake_plc::take_over() {
    const double dt_s = static_cast<double>(scan_us_) * 1e-6;
    const auto first = static_cast<std::size_t>(map_.write.start);
    const auto last = static_cast<std::size_t>(map_.write.end() - 1);
    const bool torn = map_.write.counters && registers_.now[first] != registers_.now[last];
    xyz asked_um = {}, slope = {}, difference_um = {};
    const xyz position_mm = nc_.position_mm();
    std::array<int, 3> channels_of_axis = {};
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        take_channel(c, torn, dt_s);
        if (!axis_of_channel_[c]) continue;
        const std::size_t a = *axis_of_channel_[c];
        const taken &held = applied_[c];
        const double most = config_.nc.comp_add_velo_factor;
        const double clamped = std::clamp(held.slope, -most, most); /* as the control does */
        const double here_um = held.um + 1e3 * clamped * (position_mm[a] - held.reference_mm);
        if (const auto drive = find_drive(config_, map_.channels[c].name)) {
            difference_um[a] += drive->side == 0 ? -here_um : here_um;
        }
        asked_um[a] += here_um;
        slope[a] += clamped;
        ++channels_of_axis[a];
    }
    for (std::size_t a = 0; a < 3; ++a) {
        asked_um[a] /= std::max(channels_of_axis[a], 1);
        slope[a] /= std::max(channels_of_axis[a], 1);
    }
    nc_.set_compensation_um(asked_um, slope, position_mm);
    nc_.set_drive_difference_um(difference_um);
}

void fake_plc::start_program_once_active() {
    if (program_started_ || !box_alive_ || (status_ & 0xFFu) != active) return;
    program_started_ = true;
    for (const auto &step : config_.program) nc_.queue(step);
    if (!config_.program.empty()) event("program started");
}

std::uint16_t fake_plc::control_word() const {
    unsigned word = 0;
    if (referenced_) word |= map_.referenced_mask;
    if (enable_) word |= bit_enable;
    if (since_start_us_ < reset_until_us_) word |= bit_reset;
    if (permit_) word |= bit_permit;
    return static_cast<std::uint16_t>(word);
}

double fake_plc::signal_value(const shown_signal &signal) const {
    const auto forced = forced_.find(signal.name);
    if (forced != forced_.end()) return forced->second;
    const int axis = signal.name.size() == 1 ? axis_index(signal.name[0]) : -1;
    if (axis >= 0 && config_.axes[static_cast<std::size_t>(axis)].present) {
        return nc_.position_mm()[static_cast<std::size_t>(axis)];
    }
    const auto constant = config_.signals.find(signal.name);
    if (constant != config_.signals.end()) return constant->second;
    return std::min(std::max(0.0, signal.min.value_or(0.0)), signal.max.value_or(0.0));
}

void fake_plc::write_number(int address, const number_format &format, double raw) {
    const auto words = format.encode(raw);
    std::copy(words.begin(), words.end(), registers_.now.begin() + address);
}

// The heartbeat counts only what is fresh: a scan without a new NC position does not move it.
void fake_plc::show() {
    const bool fresh = !frozen_ && nc_cycles_ != nc_cycles_shown_;
    for (const auto &signal : map_.signals) {
        if (!fresh && forced_.count(signal.name) == 0) continue;
        write_number(signal.address, signal.format,
                     (signal_value(signal) - signal.zero) / signal.scale);
    }
    if (fresh) {
        nc_cycles_shown_ = nc_cycles_;
        ++plc_heartbeat_;
    }
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        const auto &channel = map_.channels[c];
        if (!channel.applied_address) continue;
        write_number(*channel.applied_address, channel.format, applied_um_[c] / channel.scale_um);
    }
    registers_.now[static_cast<std::size_t>(map_.control)] = control_word();
    registers_.now[static_cast<std::size_t>(map_.plc_heartbeat)] = plc_heartbeat_;
    if (map_.read.counters) {
        const auto first = static_cast<std::size_t>(map_.read.start);
        const auto count = static_cast<std::uint16_t>(registers_.now[first] + 1);
        registers_.now[first] = count;
        registers_.now[static_cast<std::size_t>(map_.read.end() - 1)] = count;
    }
}

void fake_plc::note_changes() {
    if (status_ != last_noted_status_) {
        event("box is " + std::string(mode_name(status_ & 0xFFu)) + " reason " +
              std::to_string(status_ >> 8));
        last_noted_status_ = status_;
    }
    const std::uint16_t control = control_word();
    const unsigned changed = control ^ last_noted_control_;
    if (changed & bit_enable) event(enable_ ? "enable on" : "enable off");
    if (changed & map_.referenced_mask) event(referenced_ ? "referenced" : "not referenced");
    if (changed & bit_permit) event(permit_ ? "permit resume on" : "permit resume off");
    if (changed & control & bit_reset) event("reset");
    last_noted_control_ = control;
}

void fake_plc::keep_state() {
    state_.time_s = static_cast<double>(since_start_us_) * 1e-6;
    state_.position_mm = nc_.position_mm();
    state_.commanded_um = commanded_um_;
    state_.applied_um = applied_um_;
    state_.displacement_um = nc_.displacement_um();
    keep_truth();
    state_.control = control_word();
    state_.status = status_;
    state_.plc_heartbeat = plc_heartbeat_;
    state_.box_heartbeat = box_heartbeat_;
    state_.box_alive = box_alive_;
    state_.events = std::move(events_);
    events_.clear();
}

void fake_plc::keep_truth() {
    if (!with_truth_) return;
    twin_state machine = nc_.state();
    state_.error_after_um = twin_.true_error_um(machine);
    machine.drive_um = {};
    state_.error_before_um = twin_.true_error_um(machine);
}

void fake_plc::set_enable(bool on) {
    enable_by_hand_ = true;
    enable_ = on;
}

void fake_plc::set_referenced(bool on) {
    reference_by_hand_ = true;
    referenced_ = on;
}

void fake_plc::set_permit(bool on) {
    permit_ = on;
}

void fake_plc::press_reset() {
    reset_until_us_ = since_start_us_ + reset_pulse_us;
}

void fake_plc::freeze_nc(bool frozen) {
    frozen_ = frozen;
    event(frozen ? "NC coupling frozen" : "NC coupling back");
}

void fake_plc::move(const twin_step &step) {
    nc_.queue(step);
}

bool fake_plc::force_signal(const std::string &name, double value) {
    for (const auto &signal : map_.signals) {
        if (signal.name != name) continue;
        forced_[name] = value;
        event("signal " + name + " forced");
        return true;
    }
    return false;
}

bool fake_plc::release_signal(const std::string &name) {
    if (forced_.erase(name) == 0) return false;
    event("signal " + name + " released");
    return true;
}

}  // namespace compbox
