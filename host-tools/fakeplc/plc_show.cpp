// SPDX-License-Identifier: MIT
// Outputs of the control: registers, log and events.
#include <fmt/core.h>

#include <algorithm>

#include "host-tools/fakeplc/plc.h"

namespace compbox::fakeplc {

namespace {

enum control_bit : std::uint16_t { bit_enable = 1, bit_reset = 4, bit_permit = 8 };

}  // namespace

std::uint16_t fake_plc::control_word() const {
    unsigned word = 0;
    if (referenced_) word |= map_.referenced_mask;
    if (enabled()) word |= bit_enable;
    if (since_start_us_ < reset_until_us_) word |= bit_reset;
    if (permit_) word |= bit_permit;
    return static_cast<std::uint16_t>(word);
}

// out: what the PLC shows as the signal, in its unit: a forced value, a position, its velocity, a
// probe's number, a process value, a constant of the twin file; else 0 or the end of the range
// nearest to it
double fake_plc::signal_value(const shown_signal &signal) const {
    const auto forced = forced_.find(signal.name);
    if (forced != forced_.end()) return forced->second;
    if (const auto measured = probes_.shown(signal.name)) return *measured;
    const bool is_velocity = !signal.velocity_of.empty();
    const std::string &position = is_velocity ? signal.velocity_of : signal.name;
    const int axis = position.size() == 1 ? twin::axis_index(position[0]) : -1;
    if (axis >= 0 && config_.axes[static_cast<std::size_t>(axis)].present) {
        const auto a = static_cast<std::size_t>(axis);
        return is_velocity ? signal.per_s * nc_.velocity_mm_per_s()[a] : nc_.position_mm()[a];
    }
    if (const auto shown = process_.signal(signal.name)) return *shown;
    const auto constant = config_.signals.find(signal.name);
    if (constant != config_.signals.end()) return constant->second;
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {  // the position of one motor
        if (map_.channels[c].name != signal.name || !axis_of_channel_[c]) continue;
        return nc_.position_mm()[*axis_of_channel_[c]];
    }
    return std::min(std::max(0.0, signal.min.value_or(0.0)), signal.max.value_or(0.0));
}

void fake_plc::write_number(int address, const number_format &format, double raw) {
    format.encode_to(raw, &registers_.now[static_cast<std::size_t>(address)]);
}

// [heartbeat] Counts only scans with a new NC position.
void fake_plc::show_signals() {
    const bool fresh = !frozen_ && nc_cycles_ != nc_cycles_shown_;
    for (const auto &signal : map_.signals) {
        if (!fresh && forced_.count(signal.name) == 0) continue;
        write_number(signal.address, signal.format,
                     (signal_value(signal) - signal.zero) / signal.scale);
    }
    if (!fresh) return;
    nc_cycles_shown_ = nc_cycles_;
    ++plc_heartbeat_;
}

// [show]
void fake_plc::show() {
    show_signals();
    const auto put = [this](int address, unsigned word) {
        registers_.now[static_cast<std::size_t>(address)] = static_cast<std::uint16_t>(word);
    };
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        const auto &channel = map_.channels[c];
        if (!channel.applied_address) continue;
        write_number(*channel.applied_address, channel.format,
                     side_->applied()[c].um / channel.scale_um);
    }
    put(map_.control, control_word());
    put(map_.plc_heartbeat, plc_heartbeat_);
    if (map_.handshake) put(*map_.handshake, side_->handshake());
    // [count]
    if (!map_.read.counters) return;
    ++read_count_;
    put(map_.read.start, read_count_);
    put(map_.read.end() - 1, read_count_);
}

void fake_plc::tell(const std::vector<std::string> &words) {
    events_.insert(events_.end(), words.begin(), words.end());
}

// Adds an event for each change since the last scan: of the box's status, of alarms and probes, of
// the control word.
void fake_plc::note_changes() {
    tell(duties_.take_events());
    if (duties_.status() != last_noted_status_) {
        last_noted_status_ = duties_.status();
        event(fmt::format("box is {} reason {}", box_mode::name_of(duties_.mode()),
                          last_noted_status_ >> 8));
    }
    tell(alarms_.take_events());
    tell(probes_.take_events());
    const std::uint16_t control = control_word();
    const unsigned changed = control ^ last_noted_control_;
    if (changed & bit_enable) event(enabled() ? "enable on" : "enable off");
    if (changed & map_.referenced_mask) event(referenced_ ? "referenced" : "not referenced");
    if (changed & bit_permit) event(permit_ ? "permit resume on" : "permit resume off");
    if (changed & control & bit_reset) event("reset");
    last_noted_control_ = control;
}

// Copies the values of this scan to state_ and moves the events there.
void fake_plc::keep_state() {
    state_.time_s = seconds_since_start();
    state_.position_mm = nc_.position_mm();
    state_.commanded_um.clear();
    state_.applied_um.clear();
    for (const auto &value : duties_.commanded()) state_.commanded_um.push_back(value.um);
    for (const auto &value : side_->applied()) state_.applied_um.push_back(value.um);
    state_.held = side_->held();
    state_.displacement_um = nc_.displacement_um();
    keep_truth();
    state_.control = control_word();
    state_.status = duties_.status();
    state_.plc_heartbeat = plc_heartbeat_;
    state_.box_heartbeat = duties_.box_heartbeat();
    state_.handshake = side_->handshake();
    state_.alarms = static_cast<int>(alarms_.standing().size());
    state_.box_alive = duties_.box_alive();
    state_.events = std::move(events_);
    events_.clear();
}

twin::twin_state fake_plc::machine_state() const {
    twin::twin_state state = nc_.state();
    process_.fill(state);
    return state;
}

void fake_plc::keep_truth() {
    if (!with_truth_) return;
    twin::twin_state machine = machine_state();
    state_.error_after_um = twin_.true_error_um(machine);
    machine.drive_um = {};
    state_.error_before_um = twin_.true_error_um(machine);
}

}  // namespace compbox::fakeplc
