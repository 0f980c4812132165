// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/plc.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

constexpr std::int64_t most_behind_us = 1000000;
constexpr std::int64_t reset_pulse_us = 500000;

// A control without interpolation of the compensation applies any step at once.
twin::twin_config with_nc_of(const plc_profile &profile, const twin::twin_config &config) {
    twin::twin_config result = config;
    if (!profile.nc.spreads) result.nc.comp_add_velo_factor = 1e9;
    return result;
}

// out: index of the axis that a channel moves; nothing if the machine maps it to none
std::optional<std::size_t> axis_of(const taken_channel &channel, const twin::twin_config &config,
                                   const std::string &file) {
    const auto mapped = config.channels.find(channel.name);
    if (mapped != config.channels.end() && mapped->second == twin::no_axis) return std::nullopt;
    if (const auto drive = twin::find_drive(config, channel.name)) return drive->axis;
    const int axis = mapped != config.channels.end() ? twin::axis_index(mapped->second)
                     : channel.name.size() == 1      ? twin::axis_index(channel.name[0])
                                                     : -1;
    if (axis < 0 || !config.axes[static_cast<std::size_t>(axis)].present) {
        throw input_error(file, 0, 0,
                          "the channel '{}' moves no axis of the twin: name it after one, or map "
                          "it in 'channels' of the twin file",
                          channel.name);
    }
    return static_cast<std::size_t>(axis);
}

std::vector<std::optional<std::size_t>> axes_of(const register_map &map,
                                                const twin::twin_config &config) {
    std::vector<std::optional<std::size_t>> axes;
    for (const auto &channel : map.channels) axes.push_back(axis_of(channel, config, map.file));
    return axes;
}

// The largest offset of each channel: that of its axis.
std::vector<double> sizes_of(const std::vector<std::optional<std::size_t>> &axes,
                             const twin::twin_plc &plc) {
    std::vector<double> sizes_um;
    for (const auto &axis : axes) {
        sizes_um.push_back(axis ? plc.axis_size_um[*axis].value_or(plc.size_um) : plc.size_um);
    }
    return sizes_um;
}

// out: the map's probes with their axes of the twin; those of a missing axis are left out
std::vector<placed_probe> probes_of(const register_map &map, const twin::twin_config &config,
                                    const std::vector<std::optional<std::size_t>> &axes) {
    std::vector<placed_probe> probes;
    for (const auto &probe : map.probes) {
        int direction = probe.axis.size() == 1 ? twin::axis_index(probe.axis[0]) : -1;
        for (std::size_t c = 0; c < axes.size(); ++c) {
            if (map.channels[c].name == probe.axis && axes[c])
                direction = static_cast<int>(*axes[c]);
        }
        if (direction < 0 || !config.axes[static_cast<std::size_t>(direction)].present) continue;
        probes.push_back(
            {probe.axis, static_cast<std::size_t>(direction), probe.value, probe.count});
    }
    return probes;
}

}  // namespace

fake_plc::fake_plc(const twin::twin_config &config, const register_map &map,
                   const plc_profile &profile, std::int64_t now_us)
    : config_(with_nc_of(profile, config)),
      map_(map),
      profile_(profile),
      twin_(config),
      nc_(config_),
      process_(config_),
      axis_of_channel_(axes_of(map, config)),
      duties_(map, config.plc, sizes_of(axis_of_channel_, config.plc), 0),
      side_(make_nc_side(profile.nc, map, config.seed)),
      probes_(config.probe, probes_of(map, config, axis_of_channel_), config.seed, 0),
      jitter_(config.seed, "PLC scan"),
      start_us_(now_us),
      nc_due_us_(now_us),
      scan_due_us_(now_us),
      nc_cycle_us_(to_us(config.nc.interpolation_s)),
      scan_us_(to_us(config.plc.scan_s)),
      last_scan_us_(now_us - scan_us_),
      clock_us_(now_us) {
    registers_.now.assign(static_cast<std::size_t>(map.size()), 0);
    registers_.before = registers_.now;
    event("PLC started");
}

std::int64_t fake_plc::next_due_us() const {
    return std::min(nc_due_us_, scan_due_us_);
}

void fake_plc::run_to(std::int64_t now_us, const std::function<void(const plc_state &)> &on_scan,
                      const std::function<void()> &on_nc_cycle) {
    while (next_due_us() <= now_us) {
        if (nc_due_us_ <= scan_due_us_) {
            nc_cycle();
            if (on_nc_cycle) on_nc_cycle();
        } else {
            scan();
            if (on_scan) on_scan(state_);
        }
    }
}

void fake_plc::forget_standstill(std::int64_t now_us) {
    const std::int64_t behind_us = now_us - next_due_us();
    if (behind_us <= most_behind_us) return;
    for (auto *time_us : {&start_us_, &nc_due_us_, &scan_due_us_, &last_scan_us_, &clock_us_}) {
        *time_us += behind_us;
    }
    event(fmt::format("the process stood still for {} ms", behind_us / 1000));
}

byte_string fake_plc::answer(const byte_string &request, bool torn) {
    return modbus::answer(request, profile_, registers_, torn);
}

void fake_plc::nc_cycle() {
    side_->cycle(nc_due_us_ - start_us_);
    enter_compensation();
    nc_.step();
    process_.advance(static_cast<double>(nc_cycle_us_) * 1e-6, nc_.state());
    ++nc_cycles_;
    nc_due_us_ += nc_cycle_us_;
}

// out: effective correction of each channel: the NC limits slopes to MD32760 without an alarm.
// Several channels of one axis act by their mean; a difference between a stage's two drives yaws
// it.
void fake_plc::enter_compensation() {
    const twin::xyz position_mm = nc_.position_mm();
    const double most = config_.nc.comp_add_velo_factor;
    twin::xyz asked_um = {}, slope = {}, difference_um = {};
    std::array<int, 3> channels = {};
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        if (!axis_of_channel_[c]) continue;
        const std::size_t a = *axis_of_channel_[c];
        correction held = side_->held()[c];
        held.slope = std::clamp(held.slope, -most, most);
        const double here_um = held.at_um(position_mm[a]);
        if (const auto drive = twin::find_drive(config_, map_.channels[c].name)) {
            difference_um[a] += drive->side == 0 ? -here_um : here_um;
        }
        asked_um[a] += here_um;
        slope[a] += held.slope;
        ++channels[a];
    }
    for (std::size_t a = 0; a < 3; ++a) {
        asked_um[a] /= std::max(channels[a], 1);
        slope[a] /= std::max(channels[a], 1);
    }
    nc_.set_compensation_um(asked_um, slope, position_mm);
    nc_.set_drive_difference_um(difference_um);
}

// Reads the box's outputs, performs the duties, writes to the NC and updates the registers.
void fake_plc::scan() {
    since_start_us_ = scan_due_us_ - start_us_;
    registers_.before = registers_.now;
    start_up();
    std::vector<std::optional<double>> position_mm;
    for (const auto &axis : axis_of_channel_) {
        position_mm.push_back(axis ? std::optional(nc_.position_mm()[*axis]) : std::nullopt);
    }
    const double dt_s = static_cast<double>(scan_due_us_ - last_scan_us_) * 1e-6;
    duties_.scan(registers_.now, enabled() && referenced_, position_mm, since_start_us_, dt_s);
    side_->scan(duties_.wanted(), position_mm, since_start_us_);
    run_probes();
    watch_alarms();
    start_program_once_active();
    show();
    note_changes();
    keep_state();
    plan_next_scan();
}

// The measurement is physical: the true error, with the compensation that is in the axes now. The
// truth leaves the machine in no other way.
void fake_plc::run_probes() {
    const auto request = map_.request ? registers_.now[static_cast<std::size_t>(*map_.request)] : 0;
    const bool requested = duties_.box_alive() && (static_cast<unsigned>(request) & 1u) != 0;
    const bool standing = nc_.state().feed_mm_per_min == 0.0 && !frozen_;
    probes_.scan({since_start_us_, standing, requested},
                 [this] { return twin_.true_error_um(machine_state()); });
}

// Jitter of a scan does not shift the following scans.
void fake_plc::plan_next_scan() {
    last_scan_us_ = scan_due_us_;
    ++scans_;
    const double most_s = std::min(profile_.scan_jitter_s, 0.4 * config_.plc.scan_s);
    scan_due_us_ = clock_us_ + scans_ * scan_us_ + to_us(jitter_.symmetric(most_s));
}

// References the axes, then enables, unless a command has done so.
void fake_plc::start_up() {
    const double time_s = static_cast<double>(since_start_us_ - power_on_us_) * 1e-6;
    if (!reference_by_hand_ && time_s >= config_.plc.reference_s) referenced_ = true;
    const double enable_at_s = config_.plc.reference_s + config_.plc.enable_s;
    if (!enable_by_hand_ && referenced_ && time_s >= enable_at_s) enable_ = true;
}

// [alarms]
void fake_plc::watch_alarms() {
    const double now_s = seconds_since_start();
    const bool in_fault = duties_.box_alive() && duties_.mode() == box_mode::fault;
    alarms_.set("box-lost", "the box's heartbeat does not change", duties_.box_lost(), now_s);
    alarms_.set(
        "box-fault",
        in_fault ? fmt::format("the box is in FAULT, reason {}", duties_.status() >> 8) : "",
        in_fault, now_s);
    alarms_.set("box-torn", "the box's blocks are torn", duties_.torn_for_long(), now_s);
    alarms_.set("box-number", "a value of the box is not a number", duties_.not_a_number(), now_s);
    watch_sizes();
    alarms_.set("nc-coupling", "no positions come from the NC", frozen_, now_s);
    alarms_.set("nc-shift", side_->alarm(), !side_->alarm().empty(), now_s, true);
}

void fake_plc::watch_sizes() {
    for (std::size_t c = 0; c < map_.channels.size(); ++c) {
        if (!duties_.limited()[c]) continue;  // only a reset ends these alarms
        const std::string &name = map_.channels[c].name;
        alarms_.set("size-" + name,
                    fmt::format("the box requests more of {} than the PLC's own size of {} um",
                                name, duties_.sizes_um()[c]),
                    true, seconds_since_start(), true);
    }
}

void fake_plc::start_program_once_active() {
    if (program_started_ || !duties_.box_alive() || duties_.mode() != box_mode::active) return;
    program_started_ = true;
    for (const auto &step : config_.program) nc_.queue(step);
    if (!config_.program.empty()) event("program started");
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
    side_->reset();
    alarms_.reset();
}

// [start] The PLC forgets all applied values. The NC keeps its values, so the PLC writes them
// again.
void fake_plc::restart() {
    registers_.now.assign(registers_.now.size(), 0);
    registers_.before = registers_.now;
    duties_ = plc_duties(map_, config_.plc, duties_.sizes_um(), since_start_us_);
    alarms_.reset();  // the NC raises its own alarm again
    side_->restart_plc();
    probes_.restart();
    power_on_us_ = since_start_us_;
    reset_until_us_ = -1;
    enable_ = referenced_ = enable_by_hand_ = reference_by_hand_ = false;
    plc_heartbeat_ = read_count_ = 0;
    event("PLC restarted");
}

void fake_plc::freeze_nc(bool frozen) {
    frozen_ = frozen;
    event(frozen ? "NC coupling frozen" : "NC coupling back");
}

void fake_plc::move(const twin::twin_step &step) {
    nc_.queue(step);
}

bool fake_plc::force_signal(const std::string &name, double value) {
    for (const auto &signal : map_.signals) {
        if (signal.name != name) continue;
        forced_[name] = value;
        event(fmt::format("signal {} forced", name));
        return true;
    }
    return false;
}

bool fake_plc::release_signal(const std::string &name) {
    if (forced_.erase(name) == 0) return false;
    event(fmt::format("signal {} released", name));
    return true;
}

}  // namespace compbox::fakeplc
